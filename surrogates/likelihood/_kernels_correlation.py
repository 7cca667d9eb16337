# mypy: ignore-errors
"""Products of one-dimensional correlations over all pairs of runs, and their derivatives in log theta.

Kinds: 1 power-exponential exp(-theta |h|^eta); 2 Matern 3/2 (1 + a) exp(-a), a = sqrt(3 theta) |h|;
3 Matern 5/2 (1 + a + a^2/3) exp(-a), a = sqrt(5 theta) |h|; 4 Matern 7/2 (1 + a + 2 a^2/5 + a^3/15) exp(-a),
a = sqrt(7 theta) |h|. The product over the inputs is taken with one exponential per pair. `scale` is theta
for kind 1 and sqrt(3 theta), sqrt(5 theta), sqrt(7 theta) for kinds 2 to 4. The Gaussian correlation needs
no kernel (see `correlation`); the numpy twins stand in the tests.
"""

import math

import numpy as np

from .._kernel_cache import kernel

__all__ = ["cross", "derivatives", "gram"]


@kernel(inline="always")
def _pair(a, b, scale, kind, eta):
    exponent = 0.0
    product = 1.0
    if kind == 1:
        for k in range(len(scale)):
            h = abs(a[k] - b[k])
            if h > 0.0:
                exponent += scale[k] * h**eta
    elif kind == 2:
        for k in range(len(scale)):
            t = scale[k] * abs(a[k] - b[k])
            exponent += t
            product *= 1.0 + t
    elif kind == 3:
        for k in range(len(scale)):
            t = scale[k] * abs(a[k] - b[k])
            exponent += t
            product *= 1.0 + t + t * t / 3.0
    else:
        for k in range(len(scale)):
            t = scale[k] * abs(a[k] - b[k])
            exponent += t
            product *= 1.0 + t + t * t * (6.0 + t) / 15.0
    if exponent > 700.0:  # exp underflows while the polynomial may overflow
        return 0.0
    return product * math.exp(-exponent)


@kernel()
def gram(x, scale, kind, eta):
    n = x.shape[0]
    r = np.empty((n, n))
    for i in range(n):
        r[i, i] = 1.0
        for j in range(i):
            value = _pair(x[i], x[j], scale, kind, eta)
            r[i, j] = value
            r[j, i] = value
    return r


@kernel()
def cross(a, b, scale, kind, eta):
    m, n = a.shape[0], b.shape[0]
    r = np.empty((m, n))
    for i in range(m):
        for j in range(n):
            r[i, j] = _pair(a[i], b[j], scale, kind, eta)
    return r


@kernel()
def derivatives(x, r, w, v, scale, kind, eta):
    """sum_ij W_ij dR_ij/dphi_k and (dR/dphi_k) v for phi = (log theta_1 .. log theta_d, eta)."""
    n, d = x.shape
    columns = d + 1 if kind == 1 else d
    total = np.zeros(columns)
    action = np.zeros((n, columns))
    t = np.zeros(columns)
    for i in range(n):
        for j in range(i):
            if kind == 1:
                by_eta = 0.0
                for k in range(d):
                    h = abs(x[i, k] - x[j, k])
                    t[k] = 0.0
                    if h > 0.0:
                        t[k] = -scale[k] * h**eta
                        by_eta += t[k] * math.log(h)
                t[d] = by_eta
            elif kind == 2:
                for k in range(d):
                    a = scale[k] * abs(x[i, k] - x[j, k])
                    t[k] = -a * a / (2.0 + 2.0 * a)
            elif kind == 3:
                for k in range(d):
                    a = scale[k] * abs(x[i, k] - x[j, k])
                    t[k] = -a * a * (1.0 + a) / (6.0 + 6.0 * a + 2.0 * a * a)
            else:
                for k in range(d):
                    a = scale[k] * abs(x[i, k] - x[j, k])
                    t[k] = -a * a * (3.0 + 3.0 * a + a * a) / (30.0 + 30.0 * a + a * a * (12.0 + 2.0 * a))
            c = (w[i, j] + w[j, i]) * r[i, j]
            vi = v[i] * r[i, j]
            vj = v[j] * r[i, j]
            for k in range(columns):
                total[k] += c * t[k]
                action[i, k] += vj * t[k]
                action[j, k] += vi * t[k]
    return total, action
