"""Dense factors and the list of what is not zero of them give the solutions of LAPACK."""

import numpy as np
import pytest
from numba import njit

from workbench.engine.compiler._kernels_dense import lu_factor, lu_list, lu_solve, lu_solve_listed
from workbench.engine.compiler.options import CAREFUL

UNCACHED = {**CAREFUL, "cache": False}


@njit(**UNCACHED)
def solved(a, pivot, value, column, start, dense, listed):
    """Factor a and solve both right-hand sides; how many entries the list has, or minus the lost column."""
    lost = lu_factor(a, pivot)
    if lost > 0:
        return -lost
    lu_solve(a, pivot, dense)
    entries = lu_list(a, value, column, start)
    lu_solve_listed(pivot, value, column, start, listed)
    return entries


def call(a, b):
    n = len(a)
    factors, dense, listed = a.copy(), b.copy(), b.copy()
    start = np.zeros((n + 1, 2), np.int64)
    room = np.zeros(n * n), np.zeros(n * n, np.int64)
    return solved(factors, np.zeros(n, np.int64), *room, start, dense, listed), dense, listed, factors


@pytest.mark.parametrize("filled", [0.1, 0.4, 1.0])
def test_lists_of_sparse_and_full_factors_solve(filled):
    rng = np.random.default_rng(7)
    for n in (1, 2, 17, 48):
        a = rng.standard_normal((n, n)) * (rng.random((n, n)) < filled) + np.diag(rng.uniform(0.5, 1.0, n))
        b = rng.standard_normal(n)
        entries, dense, listed, factors = call(a, b)
        wanted = np.linalg.solve(a, b)
        scale = np.linalg.cond(a) * np.abs(wanted).max()
        assert np.abs(dense - wanted).max() < 1e-14 * scale
        assert np.abs(listed - wanted).max() < 1e-14 * scale
        assert entries == np.count_nonzero(factors - np.diag(np.diag(factors))) + n


def test_a_saddle_matrix_needs_its_rows_exchanged():
    a = np.array([[0.0, 1.0, 0.0], [1.0, 2.0, 3.0], [0.0, 3.0, 1.0]])
    entries, dense, listed, _ = call(a, np.array([1.0, 2.0, 3.0]))
    assert entries < 9
    assert dense == pytest.approx(np.linalg.solve(a, [1.0, 2.0, 3.0]))
    assert listed == pytest.approx(dense)


def test_a_column_without_a_pivot_is_told():
    a = np.array([[1.0, 2.0], [2.0, 4.0]])
    assert call(a, np.ones(2))[0] == -2
