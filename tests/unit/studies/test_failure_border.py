"""Searches that grow into failures: few runs fail, the worst is met in few inputs, and it is said."""

import numpy as np
import pytest

from studies.failure_border import CLOSE, MODELS, drawn, run, run_drawn

# of eight models with ten seeds; in seven inputs and more the border is not found within 1 %
FAILED, SAYS = 0.4, 0.9
DRAWN_CLOSE = 0.5  # of 12 drawn problems; 8 were counted
FEW_INPUTS = ("plane 2", "own 4", "own 6")


def test_one_model_with_one_seed():
    found = run((0,), models=("plane 2",), budget=30)
    assert float(found["short"].max()) <= CLOSE
    assert float(found["says"].min()) == 1.0
    assert float(found["failed"].max()) <= FAILED


@pytest.mark.parametrize("name", MODELS)
def test_the_worst_that_is_claimed_lies_on_the_border(name):
    model = MODELS[name]()
    u = np.random.default_rng(1).random((20_000, model.dimension))
    u = np.vstack([u, np.round(u)])
    inside = np.array([model.margin(row) >= 0 for row in u])
    values = np.array([model.response(row) for row in u[inside]])
    assert values.max() <= model.worst * (1 + 1e-9)
    assert 0.02 < 1 - inside[:20_000].mean() < 0.4


@pytest.mark.slow
@pytest.mark.count
def test_all_models_with_three_seeds():
    found = run(range(3))
    assert float(found["failed"].mean()) <= FAILED
    assert float(found["says"].mean()) >= SAYS
    few = found.sel(model=list(FEW_INPUTS))
    assert float((few["short"] <= CLOSE).mean()) >= 0.8


def test_a_drawn_worst_is_the_largest_value_that_can_be_run():
    for number in (0, 4):  # a plane and an ellipsoid
        problem = drawn(number)
        u = np.random.default_rng(1).random((5000, problem.dimension))
        u = np.vstack([u, np.round(u)])
        inside = np.array([problem.margin(row) >= 0 for row in u])
        values = np.array([problem.response(row) for row in u])
        assert 0.97 * problem.worst < values[inside].max() <= problem.worst * (1 + 1e-6)
        assert values.max() > 1.02 * problem.worst  # it grows into the failures
        assert 0.02 < 1 - inside[:5000].mean() < 0.4


@pytest.mark.slow
@pytest.mark.count
def test_drawn_problems():
    """Twelve problems that nothing was tuned to; of 24 that were counted 20 came within 1 %."""
    found = run_drawn(range(12))
    assert float(found["failed"].mean()) <= FAILED
    assert float((found["short"] <= CLOSE).mean()) >= DRAWN_CLOSE
