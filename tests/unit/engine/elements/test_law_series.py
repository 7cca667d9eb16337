"""Laws over histories of elongations: the engine's, users' with and without slopes of their own."""

import numpy as np
import pytest

from workbench.engine import Spring, UserLaw
from workbench.engine.elements.law_series import law_series

TIMES = np.linspace(0.0, 1.0, 5)
DELTA, RATE = np.random.default_rng(0).normal(size=(2, 5, 3))


def force(delta, rate, t, k, c):
    return k * delta + c * rate


def slopes(delta, rate, t, k, c):
    return k + 0.0 * delta, c + 0.0 * rate


@pytest.mark.parametrize("given", [None, slopes])
def test_a_users_spring_is_the_engines_but_for_the_energy(given):
    own = [UserLaw(force=force, slopes=given, parameters={"k": k, "c": 2.0}) for k in (5.0, 6.0, 7.0)]
    ours = law_series([Spring(k=k, c=2.0) for k in (5.0, 6.0, 7.0)], DELTA, RATE, TIMES)
    theirs = law_series(own, DELTA, RATE, TIMES)
    for one, other in zip(ours[:3], theirs[:3], strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-14)
    np.testing.assert_allclose(ours.energy, 0.5 * np.array([5.0, 6.0, 7.0]) * DELTA**2, rtol=1e-14)
    assert not theirs.energy.any()
