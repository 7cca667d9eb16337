"""How a search begins: space-filling, and on and on where the first runs fail."""

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns
from workbench.models.readings import within
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.start import far_points
from workbench.search.worst_case import worst_case
from workbench.search.worst_quantile import worst_quantile
from workbench.space.box import Parameter, Space

UNIT = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])
BELT = Space(
    [Parameter("load", lower=0, upper=2, unit="kN"), Parameter("slack", lower=0, upper=1, unit="dm")]
)


def belt(load, slack):
    return {"force": load * (1 + slack), "travel": slack + load**2 / 10}


def half(a, b):
    if a + b > 1:
        raise RuntimeError("the solver diverged")
    return a - b * b


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_a_search_goes_on_where_half_of_its_start_fails(seed):
    found = worst_case(half, UNIT, budget=40, seed=seed)
    assert found.value == pytest.approx(1.0, abs=1e-3)
    assert found.evaluations <= 40
    starts = [run for run in found.runs if run.proposal == "start"]
    assert len(starts) > 4
    assert sum(run.value is not None for run in starts) >= 3


def test_further_start_points_are_those_of_the_seed():
    once, again = (worst_case(half, UNIT, budget=12, seed=4) for _ in range(2))
    assert [run.parameters for run in once.runs] == [run.parameters for run in again.runs]


@pytest.mark.slow
def test_limits_that_exclude_most_of_the_start_are_searched():
    found = worst_case(belt, BELT, response=within("force", {"travel": (None, 0.6)}), budget=40, seed=0)
    assert found.value == pytest.approx(2.4, rel=0.01)  # load 2, slack 0.2


def test_a_quantile_goes_on_too():
    found = worst_quantile(half, UNIT, budget=25, seed=0)
    assert found.evaluations <= 25
    assert found.failed > 0


def test_far_points_keep_away_from_runs_and_from_each_other():
    where = SearchSpace.of(UNIT)
    u = np.array([[0.5, 0.5], [0.1, 0.1]])
    points = far_points(where, u, size=6, rng=np.random.default_rng(0))
    every = np.vstack([u, points])
    distance = np.linalg.norm(every[:, None] - every[None], axis=2) + np.eye(len(every))
    assert distance.min() > 0.2


def test_far_points_meet_levels_and_constraints_and_end_with_them():
    space = Space(
        [
            Parameter("n", kind="integer", lower=0, upper=3),
            Parameter("road", kind="categorical", levels=["dry", "wet", "ice"]),
        ],
        constraints=("n <= 1",),
    )
    where = SearchSpace.of(space)
    u = where.unit([{"n": 0, "road": "dry"}])
    points = far_points(where, u, size=20, rng=np.random.default_rng(0))
    assert len(np.unique(points, axis=0)) == len(points) == 5
    assert where.allowed(points).all()


def test_the_budget_is_spent_before_a_search_gives_up_and_the_models_error_is_quoted():
    def broken(a, b):
        raise RuntimeError("no licence")

    words = (
        r"0 of 10 runs gave a value and 3 are needed; runs without a value: 10 failed; "
        r"the model's error \(10 times\): RuntimeError: no licence\. Mend the model"
    )
    with pytest.raises(NotEnoughRuns, match=words):
        worst_case(broken, UNIT, budget=10)


def test_of_errors_that_differ_from_run_to_run_one_is_quoted():
    def broken(a, b):
        raise RuntimeError(f"no equilibrium at a = {a}")

    words = r"10 failed; one of the model's 10 errors: RuntimeError: no equilibrium at a = \S+ Mend the model"
    with pytest.raises(NotEnoughRuns, match=words):
        worst_case(broken, UNIT, budget=10)


def test_a_wrong_name_of_an_argument_ends_the_search_at_its_start():
    words = r"0 of 4 runs gave a value.*TypeError: .*unexpected keyword argument 'a'"
    with pytest.raises(NotEnoughRuns, match=words):
        worst_case(lambda x, b: x, UNIT, budget=50)
