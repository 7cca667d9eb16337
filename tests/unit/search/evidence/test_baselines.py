"""What plain searches would have found at the same cost."""

import numpy as np
import pytest

from workbench.search.evidence.baselines import predicted_baselines
from workbench.search.runs.unit_space import SearchSpace
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.success import SuccessChance
from workbench.space.box import Parameter, Space

BOX = Space([Parameter("a", lower=0.0, upper=1.0), Parameter("b", lower=0.0, upper=1.0)])
WHERE = SearchSpace.of(BOX)
SOUND = SuccessChance.of(np.full((1, 2), 0.5), np.array([True]))  # no run has failed
NOTHING = {"u": np.empty((0, 2)), "v": np.empty(0), "success": SOUND}


@pytest.fixture(scope="module")
def model():
    u = np.random.default_rng(0).random((15, 2))
    return fit_search_model(WHERE.features(u), 3 * u[:, 0] - u[:, 1], previous=None, seed=0)


def test_predicted_baselines_equal_the_truth_of_a_linear_response(model):
    found = predicted_baselines(WHERE, model, **NOTHING, runs=16, sign=1.0, rng=np.random.default_rng(1))
    assert found["random corners"].median == pytest.approx(3.0, abs=1e-3)  # 4 corners, all of them run
    assert found["grid"].median == pytest.approx(3.0, abs=1e-3)
    assert found["grid"].runs == 16
    sampled = np.random.default_rng(2).random((4000, 16, 2)) @ np.array([3.0, -1.0])
    assert found["Latin hypercube"].median == pytest.approx(np.median(sampled.max(axis=1)), abs=0.25)
    assert found["Latin hypercube"].low < found["Latin hypercube"].median < found["Latin hypercube"].high
    assert {b.kind for b in found.values()} == {"predicted by the Kriging"}


def test_a_point_that_was_run_counts_by_its_run(model):
    known = {**NOTHING, "u": np.array([[1.0, 0.0]]), "v": np.array([2.5])}  # the Kriging says 3
    found = predicted_baselines(WHERE, model, **known, runs=16, sign=1.0, rng=np.random.default_rng(1))
    assert found["random corners"].median == 2.5
    assert found["grid"].median == pytest.approx(3.0 - 1 / 3, abs=1e-3)  # its next best point was not run


def test_a_run_that_would_rather_fail_brings_nothing(model):
    """All corners fail: a search of corners has no value, and a grid that of its best point inside."""
    corners = WHERE.corners()
    inside = np.random.default_rng(0).random((12, WHERE.dimension)) * 0.6 + 0.2
    fails = SuccessChance.of(np.vstack([corners, inside]), np.arange(len(corners) + 12) >= len(corners))
    found = predicted_baselines(
        WHERE,
        model,
        **{**NOTHING, "success": fails},
        runs=9,
        sign=1.0,
        rng=np.random.default_rng(1),
    )
    plain = predicted_baselines(WHERE, model, **NOTHING, runs=9, sign=1.0, rng=np.random.default_rng(1))
    assert "random corners" not in found
    assert found["grid"].median < plain["grid"].median


def test_a_grid_of_one_level_is_left_out(model):
    found = predicted_baselines(WHERE, model, **NOTHING, runs=3, sign=1.0, rng=np.random.default_rng(0))
    assert set(found) == {"Latin hypercube", "random corners"}
