"""Six kinds of borders: the worst of each is one, and runs fail where they should."""

import numpy as np
import pytest
from scipy.optimize import minimize

from studies.border_kinds import FAILING, INPUTS, KINDS, drawn_kind, run
from studies.failure_border import SolverError


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("number", [1, 3])
def test_no_run_that_succeeds_is_beyond_the_worst_and_some_come_near(kind, number):
    problem = drawn_kind(kind, number)
    even = np.random.default_rng(1).random((6000, problem.dimension))
    succeeds = np.array([problem.margin(u) >= 0 for u in even])
    values = np.array([problem.response(u) for u in even])
    ends = [u for u in np.round(even) if problem.margin(u) < 0]
    assert problem.dimension == INPUTS[number]
    assert FAILING[0] - 0.03 < 1 - succeeds.mean() < FAILING[1] + 0.03
    assert values[succeeds].max() <= problem.worst * (1 + 1e-9)
    assert values[succeeds].max() > 0.6 * problem.worst
    assert max(problem.response(u) for u in ends) > problem.worst  # it grows into the failures


@pytest.mark.parametrize("kind", KINDS)
def test_a_run_fails_as_a_solver_does_and_a_number_is_one_problem(kind):
    problem = drawn_kind(kind, 2)
    even = np.random.default_rng(2).random((200, problem.dimension))
    lost = next(u for u in even if problem.margin(u) < 0)
    with pytest.raises(SolverError, match="step size underflow"):
        problem(**{f"x{i + 1}": float(v) for i, v in enumerate(lost)})
    assert drawn_kind(kind, 2).worst == problem.worst != drawn_kind(kind, 9).worst


def test_only_the_inputs_of_a_border_move_it():
    rng = np.random.default_rng(3)
    for kind, count in (("one", 1), ("two", 2), ("plane", 6)):
        problem = drawn_kind(kind, 4)
        u = rng.random(6)
        moved = [problem.margin(np.where(np.arange(6) == j, 0.9 - 0.8 * u, u)) for j in range(6)]
        assert sum(abs(m - problem.margin(u)) > 1e-9 for m in moved) == count


def test_the_worst_is_sought_in_every_basin():
    """Around an ellipsoid the largest runs of a sample may all lie in one: there 7.424 is the largest."""
    problem = drawn_kind("corner", 39)
    even = np.random.default_rng(4).random((200, problem.dimension))
    reached = []
    for start in even[[problem.margin(u) >= 0 for u in even]]:
        climbed = minimize(
            lambda u: -problem.response(u), start, bounds=[(0, 1)] * problem.dimension, method="SLSQP",
            constraints={"type": "ineq", "fun": problem.margin},
        )  # fmt: skip
        if problem.margin(climbed.x) >= -1e-9:
            reached.append(problem.response(climbed.x))
    assert problem.worst == pytest.approx(max(reached), rel=1e-6)


@pytest.mark.slow
def test_one_search_of_each_of_two_kinds():
    found = run([0], budget=20, kinds=("one", "own"))
    assert found["short"].shape == (2, 1)
    assert float(found["short"].max()) < 0.05
    assert float(found["says"].min()) == 1.0
    assert float(found["covers"].min()) == 1.0
