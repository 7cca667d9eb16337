"""Restricted and full log-likelihood of Gaussian-correlation Kriging: definition and fast profiled form.

    y ~ N(F b, Z),    Z = sigma^2 (R + g I),    R_ij = exp(-sum_k theta_k (x_ik - x_jk)^2)        eq. (3.7)

The restricted likelihood (3.13) of the dissertation does not need b; maximised over sigma^2 it does not need
sigma^2 either. Every log-likelihood of this package is l (not 2 l), with the constant of (3.13) set to 0;
larger is better. The proper density of n - p error contrasts differs by -(n - p)/2 log 2 pi + 1/2 log|F'F|.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import cholesky, lapack, solve_triangular

from ..errors import NotPositiveDefinite
from .correlation import Correlation

__all__ = ["ProfiledLikelihood", "profiled_log_likelihood", "restricted_log_likelihood"]

Array = NDArray[np.float64]


def restricted_log_likelihood(
    theta: ArrayLike,
    sigma2: float,
    x: ArrayLike,
    y: ArrayLike,
    *,
    trend: ArrayLike | None = None,
    nugget: float = 0.0,
) -> float:
    """l of eq. (3.13) without its constant, for any theta and sigma^2.

        2 l = -log|Z| - log|F' Z^-1 F| - (y - F b)' Z^-1 (y - F b),    b = (F' Z^-1 F)^-1 F' Z^-1 y

    >>> x = [[0.0], [0.4], [1.0]]
    >>> print(round(restricted_log_likelihood([2.0], 1.0, x, [0.0, 1.0, 0.5]), 6))
    -0.822284

    Args:
        theta: (d,) >= 0, per unit of x squared.
        sigma2: process variance, unit of y squared.
        x: (n, d) runs.
        y: (n,) responses.
        trend: F, (n, p); a column of ones by default.
        nugget: g, relative to sigma2.

    Raises:
        NotPositiveDefinite: Z has no Cholesky factor.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    f = np.ones((len(y), 1)) if trend is None else np.asarray(trend, dtype=float)
    r = Correlation().matrix(x, np.asarray(theta, dtype=float))
    r.flat[:: len(r) + 1] += nugget
    try:
        L = cholesky(sigma2 * r, lower=True)  # Z = L L'
    except np.linalg.LinAlgError:
        raise NotPositiveDefinite(
            f"covariance of {len(y)} runs is not positive definite at nugget={nugget:g}: two runs are equal "
            "or theta is too small. Set a nugget, for example nugget=1e-8"
        ) from None
    z = solve_triangular(L, np.column_stack([f, y]), lower=True)
    q, rf = np.linalg.qr(z[:, :-1])
    residual = z[:, -1] - q @ (q.T @ z[:, -1])  # L^-1 (y - F b), b from (3.9)
    log_det_trend = 2.0 * np.log(np.abs(np.diag(rf))).sum()
    return float(-np.log(np.diag(L)).sum() - 0.5 * log_det_trend - 0.5 * residual @ residual)


@dataclass(frozen=True, slots=True, kw_only=True)
class ProfiledLikelihood:
    """l at the best sigma^2, with its gradient.

    Attributes:
        value: l, its constant 0.
        sigma2: the sigma^2 that maximises l: Q / (n - p) restricted, Q / n full, with Q = y' P y.
        beta: (p,) trend coefficients, eq. (3.9).
        gradient: (d,) dl / dlog theta.
        gradient_nugget: dl / dlog g; 0 without a nugget.
    """

    value: float
    sigma2: float
    beta: Array
    gradient: Array
    gradient_nugget: float


def profiled_log_likelihood(
    log_theta: ArrayLike,
    x: ArrayLike,
    y: ArrayLike,
    *,
    trend: ArrayLike | None = None,
    nugget: float = 0.0,
    restricted: bool = True,
) -> ProfiledLikelihood:
    """l maximised over sigma^2, and its gradient in log theta, in two matrix products for all inputs at once.

        l = -1/2 [(n - p) log s2 + log|C| + log|F' C^-1 F| + (n - p)],    C = R + g I,   s2 = y' P y / (n - p)

    With `restricted=False` the full likelihood (3.11): n in place of n - p, no log|F' C^-1 F|. The restricted
    one has n - p because log|F' Z^-1 F| holds -p log sigma^2. With W = P - P y y' P / s2 the gradient is
    theta_k (sum_i v_i x_ik^2 - x_k' V x_k), V = W * R elementwise, v its row sums: memory O(n^2 + n d).

    >>> import numpy as np
    >>> x, y = np.array([[0.0], [0.4], [1.0]]), np.array([0.0, 1.0, 0.5])
    >>> best = profiled_log_likelihood(np.log([2.0]), x, y)
    >>> print(np.isclose(best.value, restricted_log_likelihood([2.0], best.sigma2, x, y)))
    True

    Raises:
        NotPositiveDefinite: R + g I has no Cholesky factor.
    """
    x, y = np.asarray(x, dtype=float), np.asarray(y, dtype=float)
    n = len(y)
    f = np.ones((n, 1)) if trend is None else np.asarray(trend, dtype=float)
    theta = np.exp(np.asarray(log_theta, dtype=float))
    r = Correlation().matrix(x, theta)
    c = r.copy()
    c.flat[:: n + 1] += nugget
    lower, info = lapack.dpotrf(c, lower=1, overwrite_a=1)
    if info != 0:
        raise NotPositiveDefinite(
            f"correlation of {n} runs is not positive definite at nugget={nugget:g}: two runs are equal or "
            "theta is too small. Set a nugget, for example nugget=1e-8"
        )
    z = solve_triangular(lower, np.column_stack([f, y]), lower=True, check_finite=False)
    q, rf = np.linalg.qr(z[:, :-1])
    residual = z[:, -1] - q @ (q.T @ z[:, -1])
    g, alpha = np.split(
        solve_triangular(lower, np.column_stack([q, residual]), lower=True, trans=1, check_finite=False),
        [f.shape[1]],
        axis=1,
    )
    m = n - f.shape[1] if restricted else n
    s2 = float(residual @ residual) / m
    value = -0.5 * m * (np.log(s2) + 1.0) - np.log(np.diagonal(lower)).sum()
    inverse, _ = lapack.dpotri(lower, lower=1)
    w = np.tril(inverse)
    diagonal = np.diagonal(w).copy()
    w += w.T
    w.flat[:: n + 1] = diagonal
    if restricted:
        value -= np.log(np.abs(np.diagonal(rf))).sum()
        w -= g @ g.T
    w -= alpha @ alpha.T / s2
    trace = float(np.trace(w))
    w *= r
    centred = x - x.mean(axis=0)  # less cancellation in the difference below
    slope = w.sum(axis=1) @ (centred * centred) - np.einsum("ik,ik->k", centred, w @ centred)
    return ProfiledLikelihood(
        value=float(value),
        sigma2=s2,
        beta=solve_triangular(rf, q.T @ z[:, -1]),
        gradient=theta * slope,
        gradient_nugget=-0.5 * nugget * trace,
    )
