"""Regression and partial correlation coefficients of given runs, of the values or of their ranks.

    src     b_k sd(x_k)/sd(y) of the linear regression y = b_0 + sum b_k x_k
    srrc    the same for the ranks of all columns and of y
    pcc     correlation of y and x_k after each was freed of a linear regression on the other inputs
    prcc    the same for the ranks

Saltelli, Chan and Scott (2000), Sensitivity Analysis, chapters 2 and 6. Where inputs are uncorrelated,
src_k^2 is the share of the variance that x_k explains linearly, and R^2 what all explain; 1 - R^2 is what
these coefficients cannot see. Ranks see every monotone effect, and no other.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.stats import rankdata

from ..errors import TooFewRuns
from ..kriging.diagnosis import varying

__all__ = ["REGRESSION_KINDS", "RegressionCoefficients", "regression_coefficients"]

Array = NDArray[np.float64]

REGRESSION_KINDS = ("src", "srrc", "pcc", "prcc")
SPARE_RUNS = 3  # beyond the d + 1 coefficients, below which a coefficient means nothing
SINGULAR = 1e-10  # smallest eigenvalue of the correlations of the inputs


@dataclass(frozen=True, slots=True, kw_only=True)
class RegressionCoefficients:
    """Result of `regression_coefficients`.

    Attributes:
        kind: one of REGRESSION_KINDS.   value: (d,); 0 for an input that never changes.
        lower, upper: (d,) 95 % band by bootstrap over the runs.
        r2: share of the variance of y (of its ranks) that the linear regression explains.
        ranking: (d,) inputs by absolute value, largest first.
    """

    kind: str
    value: Array
    lower: Array
    upper: Array
    r2: float
    ranking: NDArray[np.intp]


def regression_coefficients(
    X: ArrayLike, y: ArrayLike, *, kind: str = "src", resamples: int = 400, rng: np.random.Generator
) -> RegressionCoefficients:
    """Coefficients of runs X (n, d), y (n,), with bands from `resamples` bootstrap samples of the runs.

    >>> x = np.random.default_rng(0).random((200, 3))
    >>> found = regression_coefficients(x, 4 * x[:, 0] - 3 * x[:, 1], rng=np.random.default_rng(1))
    >>> print(found.value.round(1) + 0.0, round(found.r2, 3))
    [ 0.8 -0.6  0. ] 1.0

    Raises:
        ValueError: an unknown kind, runs that are not finite or do not vary, columns that repeat others.
        TooFewRuns: fewer than d + 4 runs.
    """
    if kind not in REGRESSION_KINDS:
        raise ValueError(f"kind needs one of {', '.join(REGRESSION_KINDS)}, got {kind!r}")
    x, target = np.asarray(X, dtype=np.float64), np.asarray(y, dtype=np.float64)
    if x.ndim != 2 or target.shape != x.shape[:1]:
        raise ValueError(f"coefficients need X (n, d) and y (n,), got shapes {x.shape} and {target.shape}")
    if not (np.isfinite(x).all() and np.isfinite(target).all()):
        raise ValueError("coefficients need finite runs: leave out those with nan or infinity")
    n, d = x.shape
    if n < d + 1 + SPARE_RUNS:
        raise TooFewRuns(f"{d} coefficients need at least {d + 1 + SPARE_RUNS} runs, got {n}: add runs")
    live = np.flatnonzero(varying(x))
    if not len(live) or not varying(target[:, None])[0]:
        raise ValueError("coefficients need an input and a response that vary, got constant ones")
    columns = np.column_stack([x[:, live], target])
    if kind in ("srrc", "prcc"):
        columns = np.asarray(rankdata(columns, axis=0), dtype=np.float64)
    whole = _coefficients(columns, partial=kind in ("pcc", "prcc"))
    if whole is None:
        raise ValueError(
            "two inputs, or a sum of some, repeat another in all runs, so their coefficients cannot be told "
            "apart: leave one out"
        )
    drawn = []
    for _ in range(resamples):
        found = _coefficients(columns[rng.integers(0, n, n)], partial=kind in ("pcc", "prcc"))
        if found is not None:
            drawn.append(found[0])
    value, lower, upper = np.zeros(d), np.zeros(d), np.zeros(d)
    value[live] = whole[0]
    if drawn:
        lower[live], upper[live] = np.quantile(drawn, [0.025, 0.975], axis=0)
    else:
        lower[live], upper[live] = -1.0, 1.0
    ranking = np.argsort(-np.abs(value), kind="stable").astype(np.intp)
    return RegressionCoefficients(
        kind=kind, value=value, lower=lower, upper=upper, r2=whole[1], ranking=ranking
    )


def _coefficients(columns: Array, *, partial: bool) -> tuple[Array, float] | None:
    """Coefficients and R^2 from the inputs and the response in the last column; None where singular.

    With C the correlations of the inputs, c theirs with y and b = C^-1 c: src = b, R^2 = c'b, and the partial
    correlations are b_k / sqrt(b_k^2 + (1 - R^2) (C^-1)_kk).
    """
    if not varying(columns).all():
        return None
    correlation = np.asarray(np.corrcoef(columns, rowvar=False)).reshape(2 * columns.shape[1:])
    inputs, with_y = correlation[:-1, :-1], correlation[:-1, -1]
    if np.linalg.eigvalsh(inputs)[0] < SINGULAR:
        return None
    inverse = np.linalg.inv(inputs)
    b = inverse @ with_y
    r2 = float(np.clip(with_y @ b, 0.0, 1.0))
    if not partial:
        return b, r2
    size = np.sqrt(b**2 + (1.0 - r2) * np.diagonal(inverse))
    return np.divide(b, size, out=np.zeros_like(b), where=size > 0.0), r2
