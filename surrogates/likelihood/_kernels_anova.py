# mypy: ignore-errors
"""The likelihood of a correlation that is a product of sums: weights beside ranges, one of each per unit."""

import numpy as np

from .._kernel_cache import kernel
from ._kernels_matrix import FAILED, exp_minus, factor, lower_gram

__all__ = ["anova_likelihood"]


@kernel()
def anova_likelihood(D, at, y, weight, theta, nugget, restricted, gradient):
    """Return (l, s2) of R = prod_k (1 + w_k e_k) / (1 + w_k), e_k = exp(-theta_k D[at_k]).

    D: (u, pairs) packed by rows of the lower triangle; gradient (2 m + 1,) is filled with dl/dw, dl/dlog
    theta and dl/dlog nugget; restricted: REML, else ML.
    """
    m = at.shape[0]
    pairs = D.shape[1]
    n = y.shape[0]
    E = np.empty((m, pairs))
    G = np.empty(pairs)
    R = np.ones(pairs)
    for k in range(m):
        u = at[k]
        for t in range(pairs):
            E[k, t] = theta[k] * D[u, t]
        exp_minus(E[k], G)
        w = weight[k]
        c = 1.0 / (1.0 + w)
        for t in range(pairs):
            R[t] *= (1.0 + w * E[k, t]) * c
    L = np.empty((n, n))
    M = np.zeros((n, n))
    log_det = factor(R, 1.0 + nugget, L, M)
    if log_det == FAILED:
        return FAILED, 1.0
    e = np.zeros(n)
    z = np.zeros(n)
    s11 = 0.0
    s1y = 0.0
    for i in range(n):
        for j in range(i + 1):
            e[i] += M[i, j]
            z[i] += M[i, j] * y[j]
        s11 += e[i] * e[i]
        s1y += e[i] * z[i]
    Q = 0.0
    for i in range(n):
        z[i] -= s1y / s11 * e[i]
        Q += z[i] * z[i]
    if not Q > 1e-300:
        return FAILED, 1.0
    dof = n - 1 if restricted else n
    s2 = Q / dof
    l = -0.5 * (dof * np.log(s2) + log_det + dof)
    if restricted:
        l -= 0.5 * np.log(s11)
    alpha = np.zeros(n)
    b = np.zeros(n)
    W = np.zeros((n, n))
    for k in range(n):
        for i in range(k + 1):
            b[i] += M[k, i] * e[k]
            alpha[i] += M[k, i] * z[k]
    lower_gram(M, W)
    trace = 0.0
    t = 0
    for i in range(n):
        bi = b[i] / s11 if restricted else 0.0
        ai = alpha[i] / s2
        for j in range(i):
            G[t + j] = R[t + j] * (W[i, j] - bi * b[j] - ai * alpha[j])
        t += i
        trace += W[i, i] - bi * b[i] - ai * alpha[i]
    for k in range(m):
        u = at[k]
        w = weight[k]
        by_weight = 0.0
        by_theta = 0.0
        for t in range(pairs):
            g = G[t] / (1.0 + w * E[k, t])
            by_weight += g * (1.0 - E[k, t])
            by_theta += g * E[k, t] * D[u, t]
        gradient[k] = by_weight / (1.0 + w)
        gradient[m + k] = w * theta[k] * by_theta
    gradient[2 * m] = -0.5 * nugget * trace
    return l, s2
