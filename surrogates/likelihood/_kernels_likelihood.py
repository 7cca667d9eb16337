# mypy: ignore-errors
"""Profiled log-likelihood of a Kriging with constant trend: gradient, average information and ascent.

For small designs (about a hundred runs) the ascent spends its time in calls, not in arithmetic, so the whole
loop is compiled. Notation, with pairs packed as t = i (i - 1) / 2 + j for j < i:

    D       (u, n (n - 1) / 2)   distances of a group, summed over the inputs that share its theta
    at      (m,)                 rows of D that have a theta
    phi     (m + 1,)             log theta of these groups, then log nugget g
    R       exp(-sum_k theta_k D_k) + g I,    M = L^-1 of R = L L',    b = R^-1 1,    alpha = P y
    P       R^-1 - b b' / (1'b)
    W       P - alpha alpha' / s2    (R^-1 in place of P for maximum likelihood)

dl/dphi_k = theta_k sum_t W_t R_t D_kt. The average information of Gilmour, Thompson & Cullis (Biometrics 51,
1995, 1440-1450) is A_kl = q_k' P q_l / (2 s2) - a_k a_l / (2 (n - 1) s2^2) with q_k = dR/dphi_k alpha,
a_k = alpha' q_k; the second term takes out the profiled s2. A is positive semi-definite, so damped Newton
steps with it always climb.
"""

import numpy as np

from .._kernel_cache import kernel
from ._kernels_matrix import (
    FAILED,
    exp_minus,
    factor,
    lower_gram,
    weighted,
)

__all__ = ["ascend", "likelihood"]

RISE, FALL = 2.0, 3.0  # longest steps in log theta: a theta that vanishes may do so fast


@kernel()
def likelihood(D, at, y, phi, restricted, level, gradient, information, dead, least):
    """Return (l, s2) at phi; fill gradient (level >= 1) and information (level >= 2) where l exceeds `least`.

    Groups with log theta <= dead count as theta = 0 and cost nothing.
    """
    m = at.shape[0]
    pairs = D.shape[1]
    n = y.shape[0]
    theta = np.exp(phi[:m])
    nugget = np.exp(phi[m])
    alive = np.empty(m, dtype=np.intp)
    count = 0
    for k in range(m):
        if phi[k] > dead:
            alive[count] = k
            count += 1
    R = np.zeros(pairs)
    G = np.empty(pairs)
    weighted(D, at, theta, alive[:count], R)
    exp_minus(R, G)
    L = np.empty((n, n))
    M = np.zeros((n, n))
    log_det = factor(R, 1.0 + nugget, L, M)
    if log_det == FAILED:
        return FAILED, 1.0
    e = np.zeros(n)
    z = np.zeros(n)
    for i in range(n):
        s = 0.0
        c = 0.0
        for j in range(i + 1):
            s += M[i, j]
            c += M[i, j] * y[j]
        e[i] = s
        z[i] = c
    s11 = 0.0
    s1y = 0.0
    for i in range(n):
        s11 += e[i] * e[i]
        s1y += e[i] * z[i]
    beta = s1y / s11
    Q = 0.0
    for i in range(n):
        z[i] -= beta * e[i]
        Q += z[i] * z[i]
    if not Q > 1e-300:
        return FAILED, 1.0
    dof = n - 1 if restricted else n
    s2 = Q / dof
    l = -0.5 * (dof * np.log(s2) + log_det + dof)
    if restricted:
        l -= 0.5 * np.log(s11)
    if level == 0 or not l > least:
        return l, s2
    alpha = np.zeros(n)
    b = np.zeros(n)
    W = np.zeros((n, n))
    for k in range(n):
        ek = e[k]
        zk = z[k]
        for i in range(k + 1):
            b[i] += M[k, i] * ek
            alpha[i] += M[k, i] * zk
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
    gradient[:] = 0.0
    gradient[m] = -0.5 * nugget * trace
    if level == 1:
        for k in alive[:count]:
            s = 0.0
            for t in range(pairs):
                s += D[at[k], t] * G[t]
            gradient[k] = theta[k] * s
        return l, s2
    q = np.zeros((m + 1, n))
    a = np.zeros(m + 1)
    h = np.zeros(m + 1)
    v = np.zeros((m + 1, n))
    t = 0
    for i in range(n):  # gradient and q in one pass over D, which is read from far
        ai = alpha[i]
        for k in alive[:count]:
            s = 0.0
            g = 0.0
            for j in range(i):
                g += D[at[k], t + j] * G[t + j]
                c = D[at[k], t + j] * R[t + j]
                s += c * alpha[j]
                q[k, j] += c * ai
            q[k, i] += s
            gradient[k] += g
        q[m, i] = nugget * ai
        t += i
    for k in range(m):
        gradient[k] *= theta[k]
    for k in range(m + 1):
        if k < m and phi[k] <= dead:
            continue
        if k < m:
            for i in range(n):
                q[k, i] *= -theta[k]
        for i in range(n):
            a[k] += alpha[i] * q[k, i]
            h[k] += b[i] * q[k, i]
            s = 0.0
            for j in range(i + 1):
                s += M[i, j] * q[k, j]
            v[k, i] = s
    for k in range(m + 1):
        for j in range(k + 1):
            s = 0.0
            if (k < m and phi[k] <= dead) or (j < m and phi[j] <= dead):
                information[k, j] = information[j, k] = 0.0
                continue
            for i in range(n):
                s += v[k, i] * v[j, i]
            s = 0.5 * (s - h[k] * h[j] / s11) / s2 - 0.5 * a[k] * a[j] / (dof * s2 * s2)
            information[k, j] = s
            information[j, k] = s
    return l, s2


@kernel()
def step(gradient, information, phi, lower, upper, damping, delta):
    """Damped Newton step inside the box; returns the predicted gain."""
    m = phi.shape[0]
    A = np.zeros((m, m))
    ridge = 1e-5
    for i in range(m):
        ridge = max(ridge, 1e-5 * information[i, i])
    for i in range(m):
        pinned = lower[i] >= upper[i]
        pinned |= phi[i] <= lower[i] and gradient[i] <= 0.0
        pinned |= phi[i] >= upper[i] and gradient[i] >= 0.0
        delta[i] = 0.0 if pinned else gradient[i]
        for j in range(i):
            if not pinned and delta[j] != 0.0:
                A[i, j] = information[i, j]
        A[i, i] = information[i, i] * (1.0 + damping) + ridge * (0.01 + damping)
    for j in range(m):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = np.sqrt(max(A[j, j], 1e-12))
        for i in range(j + 1, m):
            s = A[i, j]
            for k in range(j):
                s -= A[i, k] * A[j, k]
            A[i, j] = s / A[j, j]
    for i in range(m):
        s = delta[i]
        for k in range(i):
            s -= A[i, k] * delta[k]
        delta[i] = s / A[i, i]
    for i in range(m - 1, -1, -1):
        s = delta[i]
        for k in range(i + 1, m):
            s -= A[k, i] * delta[k]
        delta[i] = s / A[i, i]
    gain = 0.0
    for i in range(m):
        d = min(max(delta[i], -FALL), RISE)
        d = min(max(phi[i] + d, lower[i]), upper[i]) - phi[i]
        if lower[i] >= upper[i]:
            d = 0.0
        delta[i] = d
        gain += abs(d * gradient[i])
    return gain


@kernel()
def ascend(D, at, y, start, lower, upper, restricted, iterations, tolerance):
    """Climb from start to a maximum in the box; returns (phi, l, s2, evaluations)."""
    m = start.shape[0]
    phi = np.minimum(np.maximum(start, lower), upper)
    gradient = np.zeros(m)
    information = np.zeros((m, m))
    delta = np.zeros(m)
    trial_gradient = np.zeros(m)
    trial_information = np.zeros((m, m))
    # a theta on its lower bound stays there: its gradient in log theta is theta times a slope
    dead = lower[0]
    level = np.int64(2)  # numba compiles a kernel anew for each literal that it is called with
    l, s2 = likelihood(D, at, y, phi, restricted, level, gradient, information, dead, -np.inf)
    damping = 1e-2
    evaluations = 1
    if l == FAILED:
        return phi, l, s2, evaluations
    while evaluations < iterations:
        gain = step(gradient, information, phi, lower, upper, damping, delta)
        if gain < tolerance:
            break
        trial = phi + delta
        value, variance = likelihood(
            D, at, y, trial, restricted, level, trial_gradient, trial_information, dead, l
        )
        evaluations += 1
        if value > l:
            phi = trial
            l = value
            s2 = variance
            gradient, trial_gradient = trial_gradient, gradient
            information, trial_information = trial_information, information
            damping = max(damping * 0.5, 1e-6)
        else:
            damping = max(damping, 1e-3) * 8.0
            if damping > 1e8:
                break
    return phi, l, s2, evaluations
