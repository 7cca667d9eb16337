"""Tables 3.1 and 3.2: what the first step says about the number of runs."""

import pytest

from studies.printed_screening_tables import PRINTED, first_steps, successful_path

FAR = 2.0  # standard deviations


@pytest.mark.slow
def test_only_fifty_runs_fit_both_tables():
    off = {}
    for n in (40, 50, 64):
        found = {s: first_steps(s, n, samples=24) for s in PRINTED}
        off[n] = max(abs(found[s]["l"] - PRINTED[s][2]) / found[s]["spread"] for s in PRINTED)
    assert off[50] < FAR < min(off[40], off[64])
    # the second column read as sigma, not sigma^2
    assert found["ihs"]["sigma"] == pytest.approx(PRINTED["ihs"][1], rel=0.3)


def test_a_successful_path_ends_with_the_rejected_step():
    path = successful_path("ihs", most=12)
    assert [s.accepted for s in path] == [True] * 6 + [False]
    assert path[5].theta_common < 1e-3 < path[0].theta_common
