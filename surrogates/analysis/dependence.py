"""HSIC: how far the joint law of an input and the response is from independence, by kernels.

    HSIC(x_k, y) = E[k(x, x') l(y, y')] + E[k] E[l] - 2 E[E[k | x] E[l | y]]
                 ~ tr(K H L H)/n^2,   H = I - 11'/n
    R2-HSIC      = HSIC(x_k, y)/sqrt(HSIC(x_k, x_k) HSIC(y, y)),   between 0 and 1

Gretton, Bousquet, Smola and Schoelkopf (2005), ALT, 63-77; Da Veiga (2015), Journal of Statistical
Computation and Simulation 85, 1283-1305, for R2-HSIC as a sensitivity index. Kernels are Gaussian with the
standard deviation of the column as their length, and equality for labels; with many runs they see every
dependence.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import TooFewRuns
from ..kriging.diagnosis import varying

__all__ = ["HsicIndices", "hsic_indices"]

Array = NDArray[np.float64]

FEWEST_RUNS = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class HsicIndices:
    """Result of `hsic_indices`.

    Attributes:
        hsic: (d,) biased estimate.   r2: (d,) R2-HSIC; 0 for an input that never changes.
        p_value: (d,) share of the permutations of y, the given one among them, with an HSIC as large.
        ranking: (d,) inputs by r2, largest first.
    """

    hsic: Array
    r2: Array
    p_value: Array
    ranking: NDArray[np.intp]


def hsic_indices(
    X: ArrayLike,
    y: ArrayLike,
    *,
    categorical: Sequence[int] = (),
    permutations: int = 500,
    rng: np.random.Generator,
) -> HsicIndices:
    """HSIC of each input of runs X (n, d) with y (n,), and a test of independence by permutations.

    >>> x = np.random.default_rng(0).random((60, 3))
    >>> found = hsic_indices(x, np.cos(6 * x[:, 1]), rng=np.random.default_rng(1))
    >>> print(found.ranking[0], found.p_value[1] < 0.01, found.p_value[0] > 0.01)
    1 True True

    Raises:
        ValueError: runs that are not finite, a response that does not vary, columns beyond d.
        TooFewRuns: fewer than five runs.
    """
    x, target = np.asarray(X, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.ndim != 2 or target.shape != x.shape[:1]:
        raise ValueError(f"HSIC needs X (n, d) and y (n,), got shapes {x.shape} and {target.shape}")
    if not (np.isfinite(x).all() and np.isfinite(target).all()):
        raise ValueError("HSIC needs finite runs: leave out those with nan or infinity")
    n, d = x.shape
    if n < FEWEST_RUNS:
        raise TooFewRuns(f"HSIC needs at least {FEWEST_RUNS} runs, got {n}: add runs")
    beyond = [k for k in categorical if not -d <= k < d]
    if beyond:
        raise ValueError(f"categorical needs columns below {d}, got {beyond[0]}")
    if not varying(target[:, None])[0]:
        raise ValueError("HSIC needs a response that varies, got a constant one")
    labels = {k % d for k in categorical}
    gram_y = _centred(_kernel(target, label=False))
    own_y = float((gram_y**2).sum())
    orders = [rng.permutation(n) for _ in range(permutations)]
    hsic, r2, p_value = np.zeros(d), np.zeros(d), np.ones(d)
    for k in np.flatnonzero(varying(x)):
        gram = _centred(_kernel(x[:, k], label=int(k) in labels))
        value = float((gram * gram_y).sum())
        hsic[k] = value / n**2
        r2[k] = value / np.sqrt(float((gram**2).sum()) * own_y)
        as_large = sum(float((gram * gram_y[np.ix_(order, order)]).sum()) >= value for order in orders)
        p_value[k] = (1 + as_large) / (1 + permutations)
    return HsicIndices(
        hsic=hsic, r2=r2, p_value=p_value, ranking=np.argsort(-r2, kind="stable").astype(np.intp)
    )


def _kernel(column: Array, *, label: bool) -> Array:
    difference = column[:, None] - column[None, :]
    if label:
        return np.asarray(difference == 0.0, dtype=np.float64)
    return np.asarray(np.exp(-0.5 * (difference / column.std()) ** 2))


def _centred(gram: Array) -> Array:
    return np.asarray(gram - gram.mean(axis=0) - gram.mean(axis=1)[:, None] + gram.mean())
