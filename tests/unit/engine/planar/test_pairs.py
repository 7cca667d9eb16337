"""Maps between pair coordinates and bodies: rates, virtual motions and forces belong together."""

import numpy as np
import pytest

from workbench.engine.planar._kernels import pairs

# the bare functions: only kernels call the compiled ones
pair_coordinates, pair_covector, pull_back = (
    getattr(pairs, name).py_func for name in ("pair_coordinates", "pair_covector", "pull_back")
)
BODIES = 3
CASES = [(0, 1, 3), (1, 0, 3), (0, 2, 2), (2, 1, 2)]  # bodies i and j, the first so many are free


def state(seed):
    rng = np.random.default_rng(seed)
    return rng.standard_normal(3 * BODIES), rng.standard_normal(3 * BODIES)


def turn(q):
    return np.array([np.cos(q[2::3]), np.sin(q[2::3])])


def coordinates(q, v, i, j):
    big = np.zeros(6)
    pair_coordinates(q, v, turn(q), i, j, big)
    return big


@pytest.mark.parametrize(("i", "j", "free"), CASES)
def test_rates_are_the_time_derivative_of_the_coordinates(i, j, free):
    q, v = state(1)
    h = 1e-6
    ahead, behind = coordinates(q + h * v, v, i, j)[:3], coordinates(q - h * v, v, i, j)[:3]
    assert coordinates(q, v, i, j)[3:] == pytest.approx((ahead - behind) / (2 * h), abs=1e-8)


@pytest.mark.parametrize(("i", "j", "free"), CASES)
def test_a_virtual_motion_of_the_free_bodies_moves_the_pair(i, j, free):
    q, v = state(2)
    v[3 * free :] = 0.0
    w = np.zeros(3)
    pair_covector(turn(q), i, j, free, v[: 3 * free], coordinates(q, v, i, j), w)
    assert w == pytest.approx(coordinates(q, v, i, j)[3:], abs=1e-14)


@pytest.mark.parametrize(("i", "j", "free"), CASES)
def test_forces_do_the_same_work_on_the_pair_and_on_the_bodies(i, j, free):
    q, v = state(3)
    mu, force = v[: 3 * free], np.array([0.7, -1.3, 0.4])
    w, out = np.zeros(3), np.zeros(3 * free)
    big = coordinates(q, v, i, j)
    pair_covector(turn(q), i, j, free, mu, big, w)
    pull_back(turn(q), i, j, free, big, *force, out)
    assert out @ mu == pytest.approx(force @ w, abs=1e-14)
