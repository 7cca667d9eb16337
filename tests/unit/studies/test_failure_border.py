"""Searches that grow into failures: few runs fail, the worst is met in few inputs, and it is said."""

import numpy as np
import pytest

from studies.failure_border import CLOSE, MODELS, run

# of eight models with ten seeds; in seven inputs and more the border is not found within 1 %
FAILED, SAYS = 0.4, 0.9
FEW_INPUTS = ("plane 2", "own 4", "own 6")


def test_one_model_with_one_seed():
    found = run((0,), models=("plane 2",), budget=20)
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
def test_all_models_with_three_seeds():
    found = run(range(3))
    assert float(found["failed"].mean()) <= FAILED
    assert float(found["says"].mean()) >= SAYS
    few = found.sel(model=list(FEW_INPUTS))
    assert float((few["short"] <= CLOSE).mean()) >= 0.8
