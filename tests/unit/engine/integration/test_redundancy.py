"""Rows of constraints that others imply are found by name, near ones and none alike."""

import numpy as np
import pytest

from workbench.engine.integration.redundancy import redundancy

NAMES = tuple("abcdef")


def rows(seed: int, number: int = 6, coordinates: int = 9) -> np.ndarray:
    """Independent rows of very different lengths."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=(number, coordinates)) * 10.0 ** rng.integers(-6, 7, size=(number, 1))


@pytest.mark.parametrize("seed", range(5))
def test_independent_rows_are_all_kept(seed):
    found = redundancy(NAMES, rows(seed))
    assert (found.rank, found.rows) == (6, ())
    assert found.rank == np.linalg.matrix_rank(rows(seed) / np.linalg.norm(rows(seed), axis=1)[:, None])


@pytest.mark.parametrize("seed", range(5))
def test_a_row_that_earlier_ones_imply_is_named(seed):
    phi = rows(seed)
    phi[4] = 2.0 * phi[1] / np.linalg.norm(phi[1]) - phi[3] / np.linalg.norm(phi[3])
    found = redundancy(NAMES, phi)
    assert (found.rank, found.rows) == (5, ("e",))


@pytest.mark.parametrize(("apart", "named"), [(1e-3, ()), (1e-4, ()), (1e-6, ("b",)), (0.0, ("b",))])
def test_rows_that_are_nearly_the_same(apart, named):
    """On either side of the quick test for rows that are clearly independent."""
    phi = np.array([[1.0, 0.0, 0.0], [1.0, apart, 0.0], [0.0, 0.0, 1.0]])
    assert redundancy(NAMES[:3], phi).rows == named


def test_more_rows_than_coordinates_and_a_row_of_zeros():
    assert redundancy(NAMES[:3], np.eye(3)[[0, 1, 0]][:, :2]).rows == ("c",)
    assert redundancy(NAMES[:2], np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])).rows == ("a",)
    assert redundancy((), np.zeros((0, 3))).rank == 0
