"""Products and inverses in a fixed order equal those of NumPy up to rounding."""

import numpy as np
import pytest

from doe.portable import _kernels_linear as kernels
from doe.portable.linear import (
    gram,
    inverse_root,
    product,
    quadratic_forms,
)


@pytest.mark.parametrize(("n", "p"), [(1, 1), (5, 3), (63, 7), (64, 8), (65, 45), (200, 2)])
def test_they_equal_numpy(n, p):
    rng = np.random.default_rng(n)
    x = rng.normal(size=(n, p))
    np.testing.assert_allclose(gram(x), x.T @ x, rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(product(x, x.T), x @ x.T, rtol=1e-12, atol=1e-12)
    matrix = x.T @ x + np.eye(p)
    values = np.einsum("ij,jk,ik->i", x, matrix, x)
    np.testing.assert_allclose(quadratic_forms(x, matrix), values, rtol=1e-12)
    before = matrix.copy()
    root = inverse_root(matrix)
    np.testing.assert_array_equal(matrix, before)
    np.testing.assert_allclose(root.T @ root @ matrix, np.eye(p), atol=1e-9)
    assert not np.triu(root, 1).any()
    out = np.empty(n)
    kernels.times(x, x[0], out)
    np.testing.assert_allclose(out, x @ x[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("matrix", [[[1.0, 2.0], [2.0, 1.0]], [[0.0]], [[np.nan]]])
def test_what_is_not_positive_definite_has_no_root(matrix):
    assert inverse_root(np.array(matrix)) is None
