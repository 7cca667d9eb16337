"""Published values of exact D-optimal designs, D = |X'X|^(1/p) / n on [-1, 1]."""

import itertools

import numpy as np
import pytest

import doe

# the printed values have six digits
PRINTED = 1e-6


def test_two_factors_six_runs_box_and_draper():
    # Borkowski 2003, table for k = 2, N = 6; Box & Draper 1971: |X'X| / N^6 = 5.7385e-3
    points = doe.coordinate_exchange(6, 2, rng=np.random.default_rng(1))
    efficiency = doe.d_efficiency(points, model="quadratic")
    assert efficiency == pytest.approx(0.423123, abs=PRINTED)
    assert efficiency**6 == pytest.approx(5.7385e-3, abs=1e-7)


def test_three_factors_ten_runs():
    # Borkowski 2003, table for k = 3, N = 10
    points = doe.coordinate_exchange(10, 3, rng=np.random.default_rng(1))
    assert doe.d_efficiency(points, model="quadratic") == pytest.approx(0.423472, abs=PRINTED)


def test_three_factors_on_three_levels():
    # AlgDesign's documentation, quadratic in 3 factors on levels -1, 0, 1, N = 14: printed 0.463
    grid = np.array(np.meshgrid(*[[0, 0.5, 1]] * 3)).reshape(3, -1).T
    rows = doe.exchange(grid, 14, starts=20, rng=np.random.default_rng(1))
    assert doe.d_efficiency(grid[rows], model="quadratic") == pytest.approx(0.463, abs=5e-4)


def test_eleven_two_level_factors_in_twelve_runs_are_orthogonal():
    # Plackett & Burman 1946: D = 1
    points = doe.coordinate_exchange(12, 11, model="linear", levels=2, rng=np.random.default_rng(1))
    assert doe.d_efficiency(points) == pytest.approx(1.0, abs=PRINTED)


def test_one_factor_quadratic_has_equal_weight_on_three_levels():
    # Guest 1958: the exact optimum for n = 3 m is m runs at -1, 0 and 1
    points = doe.coordinate_exchange(9, 1, rng=np.random.default_rng(1))
    np.testing.assert_allclose(np.sort(points[:, 0]), np.repeat([0, 0.5, 1], 3), atol=1e-6)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_thirty_four_corners_for_two_factor_interactions_by_default(seed):
    # the best value of 500 starts; a single start reaches 0.872 to 0.919
    corners = np.array(list(itertools.product((0.0, 1.0), repeat=7)))
    rows = doe.exchange(corners, 34, model="interactions", rng=np.random.default_rng(seed))
    assert doe.d_efficiency(corners[rows], model="interactions") == pytest.approx(0.92233, abs=1e-5)


def test_three_factors_on_three_levels_by_default():
    grid = np.array(np.meshgrid(*[[0, 0.5, 1]] * 3)).reshape(3, -1).T
    rows = doe.exchange(grid, 14, rng=np.random.default_rng(2))
    assert doe.d_efficiency(grid[rows], model="quadratic") == pytest.approx(0.46304, rel=1e-3)
