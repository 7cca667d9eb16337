"""A Gaussian process of several outputs that knows slopes at some of its points.

Matern 5/2 in features: k = (1 + s + s^2/3) exp(-s), s = sqrt(5) |d|. With d = p - q

    cov(f(p), df/dq_a) = g d_a           cov(df/dp_a, df/dq_b) = g delta_ab - h d_a d_b
    g = 5/3 (1 + s) exp(-s)              h = 25/3 exp(-s)

All outputs share the process up to their scales, so that one factorisation serves all of them.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve, cholesky, solve_triangular
from scipy.spatial.distance import cdist

__all__ = ["SlopedProcess"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]

_LEAST = 1e-10  # variance


class SlopedProcess:
    """points (n, k); sloped (s,): which points have slopes; values (n, r); slopes (s, k, r).

    noise: variance of values beside 1, three times as much of slopes.
    scales (r,): variance of every output    likelihood (r,): its logarithm, over the number of data

    >>> points = np.array([[0.0], [1.0]])
    >>> line = SlopedProcess(points, np.array([0, 1]), points, np.ones((2, 1, 1)), noise=1e-8)
    >>> print(line.mean(np.array([[0.1], [1.0]])).ravel().round(2))
    [0.1 1. ]
    """

    def __init__(self, points: Array, sloped: Places, values: Array, slopes: Array, *, noise: float) -> None:
        self.points, self.sloped = points, sloped
        n, k = points.shape
        size = n + len(sloped) * k
        K, G, _ = _parts(cdist(points, points))
        table = np.empty((size, size))
        table[:n, :n] = K
        if len(sloped):
            apart = points[:, None, :] - points[sloped][None]
            table[:n, n:] = (G[:, sloped][..., None] * apart).reshape(n, -1)
            table[n:, :n] = table[:n, n:].T
            d = apart[sloped]
            _, g, h = _parts(cdist(points[sloped], points[sloped]))
            both = -(h[..., None, None] * d[..., :, None] * d[..., None, :])
            own = np.arange(k)
            both[..., own, own] += g[..., None]
            table[n:, n:] = both.transpose(0, 2, 1, 3).reshape(size - n, size - n)
        table[np.arange(size), np.arange(size)] += np.where(np.arange(size) < n, noise, 3.0 * noise)
        self._root = cholesky(table, lower=True, overwrite_a=True)
        data = np.vstack([values, slopes.reshape(size - n, values.shape[1])])
        self._weights = cho_solve((self._root, True), data)
        self.scales = np.maximum((data * self._weights).sum(axis=0) / size, 1e-300)
        self.likelihood = -0.5 * np.log(self.scales) - np.log(np.diag(self._root)).sum() / size

    def mean(self, at: Array) -> Array:
        """(p, r) at points (p, k)."""
        n, k = self.points.shape
        K, G, _ = _parts(cdist(at, self.points))
        found = K @ self._weights[:n]
        if len(self.sloped):
            weights, G = self._weights[n:].reshape(len(self.sloped), k, -1), G[:, self.sloped]
            found -= G @ np.einsum("ia,iar->ir", self.points[self.sloped], weights)
            along = (G @ weights.reshape(len(self.sloped), -1)).reshape(len(at), k, -1)
            found += np.einsum("pa,par->pr", at, along)
        return np.asarray(found)

    def variance(self, at: Array) -> Array:
        """(p,) at points (p, k), for an output of scale 1."""
        K, G, _ = _parts(cdist(at, self.points))
        apart = at[:, None, :] - self.points[self.sloped][None]
        cross = np.hstack([K, (G[:, self.sloped][..., None] * apart).reshape(len(at), -1)])
        half = solve_triangular(self._root, cross.T, lower=True)
        return np.asarray(np.maximum(1.0 - (half * half).sum(axis=0), _LEAST))


def _parts(distance: Array) -> tuple[Array, Array, Array]:
    s = np.sqrt(5.0) * distance
    decay = np.exp(-s)
    return (1.0 + s + s * s / 3.0) * decay, 5.0 / 3.0 * (1.0 + s) * decay, 25.0 / 3.0 * decay
