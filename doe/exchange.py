"""Exchange algorithms: the best n rows of a list of candidates for a regression model.

Fedorov's exchange with rank-one updates (Fedorov 1972; Cook & Nachtsheim 1980; Atkinson, Donev & Tobias 2007,
chapter 12). Everything works on log|X'X|: the determinant itself is 1e-41 for 45 terms, where a test on raw
determinants stops improving.
"""

import numpy as np
from numpy.typing import NDArray

from doe import _kernels_exchange as kernels
from doe.models import Floats, Integers

__all__ = ["padded"]

# share of the first runs drawn at random; the rest follows by largest variance
RANDOM_SHARE = 0.3
# ridge, relative to the mean squared model row, while fewer runs than terms are chosen
RIDGE = 1e-7
MAX_PASSES = 100


def padded(x: Floats) -> Floats:
    """The columns of `x` followed by zeros up to a multiple of four: whole registers in the kernels."""
    n, p = x.shape
    f = np.zeros((n, -(-p // 4) * 4))
    f[:, :p] = x
    return f


def inverse_information(rows: Floats, p: int, ridge: float = 0.0) -> tuple[Floats, float]:
    """(X'X + ridge)^-1 padded with zeros, and log|X'X + ridge|; minus infinity when it is singular."""
    information = rows[:, :p].T @ rows[:, :p] + ridge * np.eye(p)
    inverse = np.zeros((rows.shape[1], rows.shape[1]))
    sign, log_determinant = np.linalg.slogdet(information)
    if sign <= 0:
        return inverse, -np.inf
    inverse[:p, :p] = np.linalg.inv(information)
    return inverse, float(log_determinant)


def fedorov(f: Floats, p: int, n: int, *, rng: np.random.Generator) -> tuple[NDArray[np.int64], float]:
    """One start: some random rows, the rest by largest variance, then exchanges until none gains."""
    used = np.zeros(len(f), dtype=np.int64)
    design: Integers = np.zeros(n, dtype=np.int64)
    kept = int(RANDOM_SHARE * n)
    design[:kept] = rng.choice(len(f), kept, replace=False)
    used[design[:kept]] = 1
    ridge = RIDGE * float(np.mean(np.sum(f**2, axis=1)))
    inverse, _ = inverse_information(f[design[:kept]], p, ridge)
    variance, g, h = np.empty(len(f)), np.empty(f.shape[1]), np.empty(f.shape[1])
    kernels.variances(f, inverse, variance, g)
    kernels.add_greedily(f, design, used, kept, n, inverse, variance, g, False)
    inverse, log_determinant = inverse_information(f[design], p)
    if np.isfinite(log_determinant):
        kernels.variances(f, inverse, variance, g)
        kernels.fedorov_d(f, design, used, 0, n, inverse, variance, g, h, False, MAX_PASSES)
        _, log_determinant = inverse_information(f[design], p)
    return design, log_determinant
