"""What a search along a border could reach that knows the response."""

import numpy as np
import pytest

from studies.border_known_response import DRAWS, RULES, _ahead, _Planes, _terms, run


def test_drawn_planes_agree_with_all_runs():
    rng = np.random.default_rng(3)
    slopes, u = np.array([1.0, 0.5, 0.8]), rng.random((12, 3))
    ok = u @ np.array([0.9, 0.7, 0.4]) <= 1.1
    planes = _Planes(slopes, rng)
    planes.learn(u, ok)
    margins = _terms(u) @ planes.drawn.T
    assert margins.shape == (12, DRAWS)
    assert ((margins >= -1e-9) == ok[:, None]).mean() > 0.999
    assert len(np.unique(planes.drawn[:, 0])) > DRAWS / 2


def test_the_tops_of_drawn_planes_lie_on_them():
    rng = np.random.default_rng(0)
    slopes, u = np.array([1.0, 0.5, 0.8]), rng.random((8, 3))
    planes = _Planes(slopes, rng)
    planes.learn(u, u @ slopes <= 1.3)
    tops = planes.tops(slopes)
    margin = (_terms(tops) * planes.drawn[: len(tops)]).sum(axis=1)
    whole = (tops == 1.0).all(axis=1)
    assert np.allclose(margin[~whole], 0.0, atol=1e-9)
    assert (margin[whole] >= 0).all()


def test_two_steps_ahead_ask_what_decides_between_good_runs():
    """One step prefers the likely run; two see that either answer to the other one leads to a good run."""
    succeeds = np.array([[1, 1, 1, 0], [1, 1, 0, 0], [0, 0, 1, 1]], dtype=float)
    values = np.array([0.6, 0.8, 1.0])
    assert int(np.argmax(values * succeeds.mean(axis=1) ** 2)) == 0
    assert _ahead(succeeds, values, 0.0) == 1


@pytest.mark.parametrize("rule", list(RULES))
def test_a_plane_in_two_inputs_is_met(rule):
    found = run(2, (0,), rules=(rule,))
    assert float(found["short"].max()) < 0.01
    assert 0.0 < float(found["failed"].mean()) < 0.6
