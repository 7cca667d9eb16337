"""Where runs fail beside the worst case: said in the solver's words, with the share of the box."""

import numpy as np
import pytest

from studies.failure_border import MODELS
from surrogates.analysis.success import SuccessChance
from workbench.errors import StudyError
from workbench.models.stored.evaluation import Evaluation
from workbench.search.evidence.border import border_of
from workbench.search.record import Status
from workbench.search.runs.ledger import Ledger
from workbench.search.worst_case import worst_case
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])


def success_of(ledger):
    return SuccessChance.of(ledger.u, ledger.ok)


def growing(a, b):
    """Grows with a, and fails for a > 0.8: a fifth of the box."""
    if a > 0.8:
        raise RuntimeError("no convergence\nin 50 steps")
    return a + 0.1 * b


def elsewhere(a, b):
    """Grows with a; the failures are at the other end."""
    if a < 0.2:
        raise RuntimeError("negative volume")
    return a + 0.1 * b


def test_a_worst_case_that_grows_into_failures_says_so_in_the_solvers_words():
    border = worst_case(growing, BOX, budget=14, seed=0).border
    assert border.borders
    assert border.grows
    assert border.words == "RuntimeError: no convergence"
    assert border.sentence.startswith(
        'The worst case borders on failures of this kind: "RuntimeError: no convergence", and the Kriging '
    )
    assert border.counted.low <= 0.2 <= border.counted.high
    assert border.parameters["a"] > 0.8


@pytest.mark.slow
@pytest.mark.parametrize("seed", [8190, 8191])
def test_a_border_across_the_slope_is_told_in_ten_inputs(seed):
    model = MODELS["plane 10"]()
    found = worst_case(model, model.space, budget=30, seed=seed, attack=0)
    at = np.array(list(found.parameters.values()))
    assert model.margin(np.minimum(at + 0.1, 1.0)) < 0 < model.margin(at)
    assert found.border.borders


def test_failures_that_differ_in_their_numbers_are_of_one_kind():
    """The folder that a failed command left bears the run's key, its solver's words the number of a step."""

    def failed(k):
        return Evaluation(
            id=k, key=f"{k:032x}", status="failed", attempt=1, batch="design",
            inputs={"a": 0.8 + 0.05 * k, "b": 0.3 * k}, outputs={}, gradients={},
            error=f"solver ended with exit code 3 (kept in work/{k:032x})",
            log=f"reading\nERROR 4711: did not converge in step {97 * k}\nbye",
            created=0.0, started=None, finished=None, wall=None, cpu=None, host=None, seed=None,
        )  # fmt: skip

    start = [{"a": a, "b": b, "y": a} for a in (0.1, 0.4, 0.7) for b in (0.1, 0.9)]
    border = worst_case(lambda a, b: a, BOX, budget=4, start=[*start, *map(failed, range(1, 4))]).border
    words = "solver ended with exit code 3: ERROR 4711: did not converge in step"
    assert border.kinds == {f"{words} …": 3}
    assert border.words in {f"{words} {97 * k}" for k in range(1, 4)}


def test_failures_far_from_the_worst_case_are_told_apart():
    start = [{"a": a, "b": b, "y": elsewhere(a, b)} for a in (0.3, 0.6, 0.9) for b in (0.1, 0.9)]
    start += [{"a": 0.1, "b": b, "y": None} for b in (0.1, 0.5, 0.9)]
    border = worst_case(elsewhere, BOX, budget=5, seed=0, start=start).border
    assert not border.borders
    near = sum(abs(run["a"] - 1.0) <= 0.1 and run["b"] >= 0.9 for run in start)  # of those that are given
    assert border.near >= near
    place = "within a tenth of the box of the worst case in every input"
    assert f"none of the {border.near} other runs {place} does" in border.sentence


def test_what_within_excludes_is_no_failure():
    """Failures in a corner far from the worst case, and excluded runs beside it."""

    def answer(a, b):
        if a < 0.2 and b < 0.2:
            raise RuntimeError("solver gave up at rest")
        return {"force": 3 * a + b, "travel": a}

    def read(outputs):
        return outputs["force"] if outputs["travel"] <= 0.6 else np.nan

    rows = [(a, b) for a in np.linspace(0.05, 0.95, 10) for b in np.linspace(0.05, 0.95, 5)]
    start = []
    for a, b in rows:
        row = {"a": float(a), "b": float(b)}
        try:
            start.append(row | answer(**row))
        except RuntimeError:
            start.append(row | {"force": None, "travel": None})
    ledger = Ledger.opened(BOX, response=read, sense="max", start=start, progress=None)
    assert sum(run.status == "excluded" for run in ledger.runs) > 10
    border = border_of(ledger, None, success_of(ledger), rng=np.random.default_rng(0))
    assert not border.borders
    assert border.counted.hits == 2
    assert border.counted.draws == len(ledger.runs)  # of the box, in which excluded runs lie too


def test_a_predicted_worst_case_is_asked_where_it_is_and_its_run_is_no_neighbour():
    start = [{"a": a, "b": 0.5, "y": a} for a in (0.0, 0.2, 0.4, 0.8)] + [{"a": 0.9, "b": 0.5, "y": None}]
    ledger = Ledger.opened(BOX, response="y", sense="max", start=start, progress=None)

    def border_at(worst):
        return border_of(ledger, None, success_of(ledger), worst=worst, rng=np.random.default_rng(0))

    assert border_at(None).borders
    elsewhere = border_at(np.array([0.0, 0.2]))
    assert not elsewhere.borders
    assert elsewhere.near == 0
    assert "no other run lies within a tenth of the box of the worst case in every input to tell" in (
        elsewhere.sentence
    )
    beside = border_at(np.array([0.0, 0.45]))
    assert "the only other run within a tenth of the box of the worst case in every input does not" in (
        beside.sentence
    )


def test_without_failures_there_is_no_border():
    found = worst_case(lambda a, b: a + b, BOX, budget=10, seed=0)
    assert found.border is None
    assert found.to_dict()["border"] is None
    assert found.to_dict()["failure"] is None


def test_a_failed_run_as_the_answer():
    found = worst_case(growing, BOX, budget=40, seed=0, failures="worst")
    assert found.status is Status.FAILED
    assert found.border.is_answer
    assert found.border.sentence.startswith('The worst case is a failure, "RuntimeError: no convergence"')
    assert sum(run.proposal == "even" for run in found.runs) > 20
    assert found.evaluations == 40
    assert found.border.counted.low <= 0.2 <= found.border.counted.high
    assert found.border.chance == found.border.counted.hits / found.border.counted.draws
    assert found.gap.width == np.inf
    assert found.gap.sentence == (
        "No bound is known on how much worse it could be: a failed run counts as worse, and has no value."
    )
    document = found.to_dict()
    assert document["failure"]["parameters"] == dict(found.border.parameters)
    assert document["failure"]["words"] == "RuntimeError: no convergence"
    assert growing(**document["parameters"]) == document["value"]  # these two belong together
    with pytest.raises(RuntimeError):
        growing(**found.border.parameters)


def test_without_a_failure_worst_is_the_search_that_avoids():
    plain = worst_case(lambda a, b: a * b, BOX, budget=12, seed=0)
    asked = worst_case(lambda a, b: a * b, BOX, budget=12, seed=0, failures="worst")
    assert [run.parameters for run in asked.runs] == [run.parameters for run in plain.runs]
    assert asked.border is None


def test_the_interval_of_the_share_holds():
    """Thirty even samples of 20 runs of a model that fails in 30 % of the box."""
    held = 0
    for seed in range(30):
        rng = np.random.default_rng(seed)
        start = [
            {"a": a, "b": b, "y": None if a + 0 * b > 0.7 else a} for a, b in rng.random((20, 2)).tolist()
        ]
        ledger = Ledger.opened(BOX, response="y", sense="max", start=start, progress=None)
        border = border_of(ledger, None, success_of(ledger), rng=rng)
        held += border.counted.low <= 0.3 <= border.counted.high
        assert border.chance == border.counted.hits / 20
    assert held >= 26  # exact intervals hold in at least 95 %


def test_runs_of_another_search_are_no_even_sample():
    start = [{"a": 0.9, "b": 0.5, "y": None}, *({"a": 0.1 * k, "b": 0.5, "y": 0.1 * k} for k in range(6))]
    ledger = Ledger.opened(BOX, response="y", sense="max", start=start, progress=None)
    border = border_of(ledger, None, success_of(ledger), given_are_even=False, rng=np.random.default_rng(0))
    assert border.counted.draws == 0
    assert "by the classifier alone, as no even sample was run" in border.sentence


def test_what_failures_may_be():
    with pytest.raises(StudyError, match="failures needs 'avoid' or 'worst', got 'count'"):
        worst_case(growing, BOX, failures="count")
    with pytest.raises(StudyError, match="failures='worst' does not go with noise=True"):
        worst_case(growing, BOX, failures="worst", noise=True)
