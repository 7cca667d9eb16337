"""Minimax searches of models that fail: regions of the uncertainty, of the design, of both; resumption."""

import json
import math

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.models.evaluator import FunctionEvaluator, Outcome
from workbench.models.readings import within
from workbench.robust.minimax import MinimaxStatus, minimax
from workbench.space.box import Parameter, Space

ONE_PERCENT = 0.01


def box(prefix, count):
    return Space([Parameter(f"{prefix}{i}", lower=-1, upper=1) for i in range(count)])


SPACES = (box("x", 2), box("u", 2))


def plane(x, u):
    return (x["x0"] - 0.3) ** 2 + (x["x1"] + 0.2) ** 2 + u["u0"] * (1 + x["x0"]) + u["u1"] * x["x1"]


def failing(where, *, calls=None):
    def model(x, u):
        if calls is not None:
            calls.append((*x.values(), *u.values()))
        if where(x, u):
            raise RuntimeError("solver diverged")
        return plane(x, u)

    return model


def limited(limit):
    """min over x of the worst that can be run when u0 stays below `limit`."""
    x0 = 0.3 - limit / 2
    return (x0 - 0.3) ** 2 + 0.04 + limit * (1 + x0)


@pytest.mark.parametrize(
    ("limit", "seed"),
    [(0.95, 0), (0.5, 1)]
    + [pytest.param(a, s, marks=pytest.mark.slow) for a in (0.95, 0.8, 0.5, 0.1) for s in (1, 2)],
)
def test_a_failing_end_of_the_uncertainty_is_closed_in_on(limit, seed):
    calls = []
    result = minimax(failing(lambda x, u: u["u0"] > limit, calls=calls), *SPACES, seed=seed)
    assert result.value == pytest.approx(limited(limit), rel=ONE_PERCENT)
    assert limited(limit) * (1 - ONE_PERCENT) < plane(result.design, {"u0": limit, "u1": 1.0})
    assert plane(result.design, {"u0": limit, "u1": 1.0}) < limited(limit) * (1 + ONE_PERCENT)
    assert plane(result.design, result.scenario) == pytest.approx(result.value, rel=1e-12)
    assert len(calls) == len(set(calls)) == result.evaluations <= 300
    assert result.failures == sum(c[2] > limit for c in calls)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("where", "known"),
    [
        (lambda x, u: x["x0"] > 0.6, 1.09),  # away from the best design
        # the best that can be run lies on the border: the search goes on to its last run
        pytest.param(lambda x, u: x["x0"] > -0.3, 1.1, marks=pytest.mark.slow),
        (lambda x, u: x["x0"] > 0 and u["u0"] > 0.3 and u["u1"] > -0.3, 1.09),  # a box of both
        (lambda x, u: u["u0"] > 0 and u["u1"] > 0, 1.09),  # a quarter of the uncertainty
        (lambda x, u: u["u0"] + u["u1"] > 1.2, 1.09),
        (lambda x, u: math.sin(1e4 * (x["x0"] + 2 * x["x1"] + 3 * u["u0"] + 5 * u["u1"])) > 0.7, 1.09),
    ],
)
def test_failures_that_depend_on_design_or_uncertainty(where, known, seed):
    result = minimax(failing(where), *SPACES, seed=seed)
    assert result.value == pytest.approx(known, rel=ONE_PERCENT)
    assert plane(result.design, result.scenario) == pytest.approx(result.value, rel=1e-12)
    assert not where(result.design, result.scenario)


@pytest.mark.slow
def test_a_border_that_depends_on_the_design_gives_a_design_that_stands_a_little_more():
    # u0 <= 0.6 + 0.3 x0 can be run: the best of 0.7079 is at x0 = -0.115
    result = minimax(failing(lambda x, u: u["u0"] > 0.6 + 0.3 * x["x0"]), *SPACES, seed=0)
    limit = 0.6 + 0.3 * result.design["x0"]
    worst = max(plane(result.design, {"u0": limit, "u1": u1}) for u1 in (-1.0, 1.0))
    assert result.value == pytest.approx(worst, rel=ONE_PERCENT)
    assert result.value == pytest.approx(0.7079, rel=0.04)


@pytest.mark.slow
def test_nan_is_a_failure_as_an_exception_is():
    def model(x, u):
        return math.nan if u["u0"] > 0.8 else plane(x, u)

    def raising(x, u):
        if u["u0"] > 0.8:
            raise ZeroDivisionError("no stiffness")
        return plane(x, u)

    result, same = (minimax(f, *SPACES, budget=60, seed=3) for f in (model, raising))
    assert result.cycles == same.cycles
    assert {run.status for run in result.failed} == {"nonfinite"}
    assert {run.error for run in same.failed} == {"ZeroDivisionError: no stiffness"}


def test_runs_that_a_reading_leaves_out_are_named():
    def two(x, u):
        return {"y": plane(x, u), "travel": u["u0"]}

    result = minimax(two, *SPACES, response=within("y", {"travel": (None, 0.5)}), seed=0)
    assert result.value == pytest.approx(limited(0.5), rel=ONE_PERCENT)
    assert {run.status for run in result.failed} == {"excluded"}


def test_failures_are_told_in_the_document_and_the_sentence():
    result = minimax(failing(lambda x, u: u["u0"] > 0.5), *SPACES, seed=0)
    assert result.failures == len(result.failed) > 0
    assert all(run.scenario["u0"] > 0.5 for run in result.failed)
    assert all(dict(run.design) == dict(result.design) for run in result.failed_here)
    assert f"{result.failures} runs gave no value ({result.failures} x RuntimeError: solver diverged), " in (
        result.sentence
    )
    assert (
        f"{len(result.failed_here)} of them at this design: scenarios that cannot be run" in result.sentence
    )
    document = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert document["failures"] == len(document["failed"]) == result.failures
    assert document["failed"][0]["status"] == "failed"


@pytest.mark.slow
def test_a_cycle_whose_design_cannot_be_run_has_no_upper_bound():
    result = minimax(failing(lambda x, u: x["x0"] > -0.3), *SPACES, budget=60, seed=0)
    uppers = [cycle.upper for cycle in result.cycles]
    assert math.inf in uppers
    document = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert [c["upper"] for c in document["cycles"]] == [u if u < math.inf else None for u in uppers]


@pytest.mark.slow
def test_a_search_interrupted_among_failures_goes_on_as_if_it_had_not_been():
    def joint(**row):
        calls.append(tuple(row.values()))
        if len(calls) == stops[-1]:
            raise KeyboardInterrupt
        if row["u0"] > 0.8:
            raise RuntimeError("solver diverged")
        return plane(row, row)

    def model(x, u):
        return joint(**x, **u)

    stops, calls = [-1], []
    whole = minimax(model, *SPACES, budget=60, seed=2)
    total = len(calls)
    for stop in (5, 30, total - 1):
        stops.append(stop)
        calls, evaluate = [], FunctionEvaluator(joint)
        with pytest.raises(KeyboardInterrupt):
            minimax(model, *SPACES, budget=60, seed=2, evaluator=evaluate)
        assert minimax(model, *SPACES, budget=60, seed=2, evaluator=evaluate) == whole
        assert len(calls) == total + 1


@pytest.mark.slow
def test_an_evaluator_that_runs_batches_gives_the_same():
    class Batches:
        purposes: list[str] = []

        def __call__(self, rows, *, purpose):
            self.purposes.append(purpose)
            answers = {}
            for i in reversed(range(len(rows))):  # any order of completion
                row = rows[i]
                ok = row["u0"] <= 0.5
                answers[i] = Outcome(
                    parameters=row,
                    status="ok" if ok else "timeout",
                    outputs={"y": plane(row, row)} if ok else {},
                )
            return [answers[i] for i in range(len(rows))]

    evaluate = Batches()
    result = minimax(plane, *SPACES, budget=60, seed=0, evaluator=evaluate)
    plain = minimax(failing(lambda x, u: u["u0"] > 0.5), *SPACES, budget=60, seed=0)
    assert result.cycles == plain.cycles
    assert {run.status for run in result.failed} == {"timeout"}
    assert set(evaluate.purposes) == {"minimax start", "minimax fill", "minimax oracle"}


@pytest.mark.slow
def test_given_scenarios_that_cannot_be_run_do_no_harm():
    scenarios = [{"u0": 1.0, "u1": 1.0}, {"u0": 0.0, "u1": -1.0}]
    result = minimax(failing(lambda x, u: u["u0"] > 0.5), *SPACES, seed=0, scenarios=scenarios)
    assert result.value == pytest.approx(limited(0.5), rel=ONE_PERCENT)
    assert [dict(s) for s in result.scenarios[:2]] == scenarios


@pytest.mark.slow
def test_more_of_the_start_is_run_where_most_of_it_fails():
    result = minimax(failing(lambda x, u: u["u0"] > -0.6), *SPACES, seed=0)
    assert result.value == pytest.approx(limited(-0.6), abs=0.01)


def test_a_model_that_always_fails_is_refused_after_its_start():
    calls = []
    with pytest.raises(
        NotEnoughRuns,
        match=r"0 of 32 runs of the start design gave a value and 3 are needed "
        r"\(32 x RuntimeError: solver diverged\); mend the model or narrow the spaces",
    ):
        minimax(failing(lambda x, u: True, calls=calls), *SPACES)
    assert len(calls) == 32


@pytest.mark.slow
def test_designs_that_all_fail_are_refused_with_the_counts():
    start = []

    def only_the_start(x, u):
        start.append(1)
        if len(start) > 20:
            raise RuntimeError("licence lost")
        return plane(x, u)

    with pytest.raises(
        NotEnoughRuns,
        match=r"no design could be confirmed: every run at a proposed design failed, \d+ of 60 runs in all "
        r"\(\d+ x RuntimeError: licence lost\); mend the model",
    ):
        minimax(only_the_start, *SPACES, budget=60)


def test_a_kriging_that_cannot_be_fitted_costs_no_confirmed_design(monkeypatch):
    from workbench.robust import worst_scenario as minimax_oracle

    fit = minimax_oracle.fit_near
    fits = []

    def breaks_down(runs, region):
        fits.append(1)
        if len(fits) > 3:
            raise np.linalg.LinAlgError("SVD did not converge")
        return fit(runs, region)

    monkeypatch.setattr(minimax_oracle, "fit_near", breaks_down)
    monkeypatch.setattr("workbench.robust.cycles.fit_near", breaks_down)
    tilted = (Space([Parameter("x0", lower=-1, upper=1)]), Space([Parameter("u0", lower=-1, upper=1)]))

    def steep(x, u):
        return math.exp(2 * x["x0"] * u["u0"]) + math.sin(5 * u["u0"]) * x["x0"]

    result = minimax(steep, *tilted, budget=60, seed=0)
    assert result.status is MinimaxStatus.UNMODELLED
    assert result.note == "LinAlgError: SVD did not converge"
    json.dumps(result.to_dict(), allow_nan=False)  # no cycle was finished: there is no lower bound
    assert steep(result.design, result.scenario) == result.value
    fits.clear()
    fits += [1, 1, 1]
    with pytest.raises(
        NotEnoughRuns, match=r"no Kriging could be fitted to 16 runs \(LinAlgError: SVD did not"
    ):
        minimax(steep, *tilted, budget=60, seed=0)


def test_an_error_of_the_user_is_not_taken_for_a_failure():
    with pytest.raises(StudyError, match="response 'z' is not among the model's outputs"):
        minimax(plane, *SPACES, response="z")
