"""LU of band matrices beside numpy, and matrices without a pivot."""

import numpy as np
import pytest
from numba import njit

from workbench.engine.compiler._kernels_band import band_factor, band_solve, band_solve_transposed

ROUNDING = 1e-11  # relative, at the condition numbers drawn here


@njit
def solved(a, below, above, pivot, b, transposed):
    lost = band_factor(a, below, above, pivot)
    if lost == 0:
        if transposed:
            band_solve_transposed(a, below, above, pivot, b)
        else:
            band_solve(a, below, above, pivot, b)
    return lost


def drawn(rng, n, below, above):
    """A full matrix with the given diagonals, half of them of tiny entries, so that rows are exchanged."""
    i, j = np.indices((n, n))
    full = rng.standard_normal((n, n)) * rng.choice([1e-3, 1.0], (n, n))
    return np.where((j - i <= above) & (i - j <= below), full, 0.0)


def banded(full, below, above):
    n = len(full)
    a = np.zeros((n, 2 * below + above + 1))
    for i in range(n):
        for j in range(max(0, i - below), min(n, i + above + 1)):
            a[i, j - i + below] = full[i, j]
    return a


@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize(
    ("n", "below", "above"), [(1, 0, 0), (7, 2, 3), (40, 5, 5), (40, 1, 6), (12, 11, 11)]
)
def test_a_band_is_solved_as_the_full_matrix(n, below, above, transposed):
    rng = np.random.default_rng(811)
    for _ in range(20):
        full, b = drawn(rng, n, below, above), rng.standard_normal(n)
        pivot, x = np.zeros(n, np.int64), b.copy()
        assert solved(banded(full, below, above), below, above, pivot, x, transposed) == 0
        exact = np.linalg.solve(full.T if transposed else full, b)
        scale = np.linalg.cond(full) * np.abs(exact).max()
        assert np.abs(x - exact).max() < 1e-14 * n * scale + ROUNDING * np.abs(exact).max()
        assert n < 7 or (pivot != np.arange(n)).any()


def test_a_column_without_pivot_is_told():
    full = drawn(np.random.default_rng(812), 9, 2, 2)
    full[:, 4] = 0.0
    assert solved(banded(full, 2, 2), 2, 2, np.zeros(9, np.int64), np.zeros(9), False) == 5
