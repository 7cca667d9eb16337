"""Responses that switch: two regimes with nothing between, told from one law with a long tail.

Sorted values are cut at their gaps. With s the larger of the deviations inside the two parts,

    G = max gap / s     over the cuts that leave at least 4 runs, and 7 % of them, on both sides,

of the values and, where all are positive, of their logarithms. A long tail has wide gaps too, but its own
part spreads as widely. G is critical where less than 1 % of samples of one law reach it: normal, lognormal
(deviation 1 and 1.5 of the logarithm), uniform, exponential, Student's t with 3 degrees, the size of t with 2
and with 1 (Cauchy), gamma with shape 1/2; the largest of the nine, 4000 samples each.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["FEWEST_RUNS", "Regimes", "find_regimes"]

Array = NDArray[np.float64]

RUNS = (20, 25, 30, 40, 50, 60, 80, 100, 150, 200, 300)
CRITICAL = (3.18, 2.88, 2.76, 2.52, 2.52, 1.82, 1.54, 1.07, 0.74, 0.57, 0.37)
FEWEST_RUNS = RUNS[0]
FEWEST_INSIDE, SHARE_INSIDE = 4, 0.07
FEWEST_VALUES = 6  # of fewer the gaps are steps of a count
NOTHING = 1e-7  # of the gap: a part that does not vary


@dataclass(frozen=True, slots=True, kw_only=True)
class Regimes:
    """Two regimes of a response.

    Attributes:
        is_upper: (n,) which runs are in the upper one.
        lower, upper: (least, largest) value of each.
        threshold: the middle of the gap.
        gap: G.   critical: what one law reaches in 1 % of samples.
    """

    is_upper: NDArray[np.bool_]
    lower: tuple[float, float]
    upper: tuple[float, float]
    threshold: float
    gap: float
    critical: float


def find_regimes(y: ArrayLike) -> Regimes | None:
    """The two regimes of values y (n,), None where one law would do or fewer than 20 runs are there.

    >>> rng = np.random.default_rng(0)
    >>> held, gone = 0.02 + 0.38 * rng.random(42), 7.9 + 3.3 * rng.random(18)
    >>> found = find_regimes(np.concatenate([held, gone]))
    >>> int(found.is_upper.sum()), bool(0.4 < found.threshold < 7.9), find_regimes(gone.repeat(2)[:30])
    (18, True, None)

    Raises ValueError for values that are not finite.
    """
    values = np.asarray(y, dtype=np.float64)
    if values.ndim != 1 or not np.isfinite(values).all():
        raise ValueError(f"regimes need finite responses (n,), got shape {values.shape} with nan or infinity")
    n = len(values)
    if n < FEWEST_RUNS or len(np.unique(values)) < FEWEST_VALUES:
        return None
    ordered = np.sort(values)
    found = [_widest(ordered)]
    if ordered[0] > 0.0:
        found.append(_widest(np.log(ordered)))
    gap, cut = max(found)
    critical = float(np.exp(np.interp(np.log(n), np.log(RUNS), np.log(CRITICAL))))
    if gap < critical:
        return None
    low, high = float(ordered[cut - 1]), float(ordered[cut])
    return Regimes(
        is_upper=values >= high,
        lower=(float(ordered[0]), low),
        upper=(high, float(ordered[-1])),
        threshold=0.5 * (low + high),
        gap=gap,
        critical=critical,
    )


def _widest(ordered: Array) -> tuple[float, int]:
    """G of ascending values (n,), and the number of values below the cut."""
    n = len(ordered)
    least = max(FEWEST_INSIDE, int(np.ceil(SHARE_INSIDE * n)))
    below = np.arange(least, n - least + 1)
    gaps = ordered[below] - ordered[below - 1]
    z = ordered - ordered.mean()
    sums, squares = z.cumsum(), (z * z).cumsum()
    spread = [
        second / count - (first / count) ** 2
        for first, second, count in (
            (sums[below - 1], squares[below - 1], below),
            (sums[-1] - sums[below - 1], squares[-1] - squares[below - 1], n - below),
        )
    ]
    inside = np.maximum(np.sqrt(np.maximum(*spread).clip(0.0)), NOTHING * gaps)
    ratio = np.divide(gaps, inside, out=np.zeros(len(gaps)), where=gaps > 0.0)
    best = int(np.argmax(ratio))
    return float(ratio[best]), int(below[best])
