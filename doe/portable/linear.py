"""Products and inverses of model matrices with the same bits on every processor: see `_kernels_linear`."""

import numpy as np
from numpy.typing import NDArray

from doe.portable import _kernels_linear as kernels

__all__ = ["gram", "inverse_root", "product", "quadratic_forms"]

Floats = NDArray[np.float64]


def gram(x: Floats) -> Floats:
    """X'X of x (n, p): (p, p)."""
    out = np.zeros((x.shape[1], x.shape[1]))
    kernels.add_gram(x, x.shape[1], out)
    return out


def product(a: Floats, b: Floats) -> Floats:
    """a @ b."""
    out = np.empty((a.shape[0], b.shape[1]))
    kernels.product(a, b, out)
    return out


def inverse_root(matrix: Floats) -> Floats | None:
    """L^-1 of matrix = L L', so that its inverse is root' root; None when it is not positive definite."""
    root = np.empty_like(matrix)
    return root if kernels.cholesky_root(matrix.copy(), root) else None


def quadratic_forms(f: Floats, matrix: Floats) -> Floats:
    """f_i' matrix f_i for every row of f (n, p) and a symmetric matrix: (n,)."""
    values = np.empty(len(f))
    kernels.quadratic_forms(f, matrix, values)
    return values
