"""Among noise: the stated mean is no luck, its interval holds, its gap is narrow."""

import pytest

from studies.noisy_worst_case import asked_budget, run, run_undeclared

# 60 runs, ten functions with ten seeds: bias -0.02, held 93 %; bias of the luckiest run 2.1. The
# median gap is 16 %; with seeds 7201 and 7202 it covers in 19 of 20
BIAS, HELD, GAP, COVERED = 0.3, 0.9, 0.19, 0.9


@pytest.mark.slow
def test_two_functions_with_one_seed():
    found = run((0,), budget=60, cases=(("branin", "max"), ("circuit", "max")))
    assert float(abs(found["bias"]).max()) < 1.0  # of the noise: three times the error of a mean of 12
    assert float(found["lucky"].min()) > 1.0
    assert float(found["short"].max()) < 0.05
    assert float(found["covered"].min()) == 1.0


@pytest.mark.slow
@pytest.mark.count
def test_all_functions_with_four_seeds():
    found = run(range(4), budget=60)
    assert abs(float(found["bias"].mean())) < BIAS
    assert float(found["held"].mean()) >= HELD
    assert float(found["gap"].median()) <= GAP
    assert float(found["covered"].mean()) >= COVERED
    assert float(found["lucky"].mean()) > 1.5


@pytest.mark.slow
def test_noise_that_nobody_declares_is_found_and_its_luckiest_run_not_reported():
    ds = run_undeclared(0.03, (7303,), cases=(("camel", "max"),))
    assert bool(ds["found"].item())
    assert abs(ds["bias"].item()) < 1.0


def test_runs_that_are_no_number_are_refused():
    assert (asked_budget(["60"]), asked_budget([])) == (60, None)
    with pytest.raises(SystemExit, match="need a whole number after FIRST LAST, got many"):
        asked_budget(["many"])
