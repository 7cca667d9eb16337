"""Which of the drawn cases stand out of a trend."""

import numpy as np

from workbench.search.evidence.attack.surprise import surprises


def _drawn(d, n=120):
    return np.random.default_rng(5).random((n, d))


def test_the_flank_of_a_needle_stands_out_though_other_cases_are_worse():
    u = _drawn(3)
    slope = u @ np.array([5.0, 3.0, -2.0])
    flank = int(np.argmin(slope))
    values = slope + 0.05 * np.cos(40 * u[:, 0])
    values[flank] += 1.0
    assert values[flank] < np.median(values)
    scores = surprises(u, values)
    assert int(np.argmax(scores)) == flank
    assert scores[flank] > 10


def test_nothing_stands_far_out_of_a_quadratic():
    u = _drawn(4)
    values = u @ np.arange(4.0) - 3 * ((u - 0.3) ** 2).sum(axis=1) + 0.01 * np.sin(1e4 * u.sum(axis=1))
    assert surprises(u, values).max() < 4


def test_cases_without_a_value_never_stand_out():
    u, values = _drawn(2, 20), np.arange(20.0)
    values[4] = -np.inf
    assert surprises(u, values)[4] == -np.inf
    assert np.isfinite(np.delete(surprises(u, values), 4)).all()
    assert (surprises(u[:2], values[:2]) == -np.inf).all()
