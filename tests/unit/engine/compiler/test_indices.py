"""Indices of compiled kernels count from the front."""

import numpy as np
import pytest
from numba import njit
from numba.core.errors import UnsupportedError

from workbench.engine.compiler.options import ENTRY, INNER

UNCACHED = {**ENTRY, "cache": False}


@njit(**INNER)
def cell(table, i, j):
    return table[i, j] + 10.0 * table[i][1]


@njit(**UNCACHED)
def filled(table, row, out):
    for i in range(table.shape[0]):
        for j in range(table.shape[1]):
            out[i, j] = cell(table, i, j) + row[j]
            out[i, j] += table[1:][0, j]
    out[0, 1] = row[2]


def test_indices_of_every_form_find_their_items():
    """Pairs, single numbers, constants and slices, read and written, as in numpy."""
    table, row, out = np.arange(6.0).reshape(2, 3), np.array([7.0, 8.0, 9.0]), np.zeros((2, 3))
    filled(table, row, out)
    wanted = table + 10.0 * table[:, 1:2] + row + table[1]
    wanted[0, 1] = row[2]
    np.testing.assert_array_equal(out, wanted)


@pytest.mark.parametrize("text", ["return x[-1]", "x[-2] = 1.0\n    return x[0]", "return y[0, -1]"])
def test_indices_from_the_end_are_refused(text):
    """They would be taken for very large ones."""
    names = {}
    exec(f"def last(x, y):\n    {text}", names)
    with pytest.raises(UnsupportedError, match="kernels of the engine count from the front"):
        njit(**UNCACHED)(names["last"])(np.ones(3), np.ones((2, 2)))
