"""What the default screening asks of a set of units, and how long it searches."""

from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from scipy.stats import chi2

from ..partitions.canonical import CanonicalRuns, replicate_variance

__all__ = [
    "Rules",
    "check_columns",
    "check_rules",
    "criterion_in_words",
    "nugget_bounds",
    "rule_in_words",
    "threshold_for",
    "threshold_of",
]

# chi^2 with one degree, 95 %: fits Tables 3.1 and 3.2, whose rule is "no large increment"
FORWARD_THRESHOLD = 1.92
DEFAULT_NUGGET = (1e-4, 10.0)  # the floor hides effects below a thousandth of the variance
FORWARD_NUGGET = 1e-8
LENIENT = 0.5  # of the threshold: sets that are best at that price are looked at, too


def threshold_for(n_units: int, risk: float = 0.05) -> float:
    """The gain in l that one more theta must bring: all inert units together enter with probability `risk`.

    An inert unit's theta lies on its bound 0, so twice its gain is 0 or chi^2 with one degree, each with
    probability 1/2 (Self & Liang, J. Am. Stat. Assoc. 82, 1987, 605-610). Never below 1.92, the 95 % point
    for a single unit.

    >>> print(round(threshold_for(20), 2), round(threshold_for(100), 2), round(threshold_for(4), 2))
    3.94 5.41 2.51
    """
    return max(1.92, 0.5 * float(chi2.isf(min(1.0, 2.0 * risk / n_units), 1)))


def threshold_of(given: Any, n_units: int) -> float:
    """The threshold of a screener with its method, or the one that it was given."""
    if given.threshold is not None:
        return float(given.threshold)
    return threshold_for(max(n_units, 1)) if given.method == "default" else FORWARD_THRESHOLD


def criterion_in_words(name: str) -> str:
    """What l is for the criterion "reml" or "ml"."""
    what = "restricted log-likelihood l of (3.13)" if name == "reml" else "log-likelihood l of (3.11)"
    return f"{what}, constant 0, larger is better"


def rule_in_words(method: str, price: float, n_features: int | None) -> str:
    """How a set is chosen."""
    if n_features is not None:
        return f"{n_features} inputs, as asked"
    if method == "default":
        return f"the set with the largest l - {price:.2f} x number of inputs, if 2 above none"
    return f"forward until the gain in l falls below {price:.2f}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rules:
    """What a screening asks of its sets, and how long it searches.

    Attributes:
        restricted: REML, else ML.   eta: power of the correlation.
        nugget: bounds, relative to sigma2.
        threshold: the gain in l that a unit must bring.
        size: number of selected units; None to choose it by the threshold.
        n_starts, enough: at most so many ascents, fewer once so many agree on the best maximum.
    """

    restricted: bool
    eta: float
    nugget: tuple[float, float]
    threshold: float
    size: int | None
    n_starts: int
    enough: int

    @property
    def lenient(self) -> float:
        """The price at which sets are looked at beside those of the full price."""
        return LENIENT * self.threshold


def nugget_bounds(
    method: str, given: float | tuple[float, float] | None, runs: CanonicalRuns
) -> tuple[float, float]:
    """Least and largest nugget relative to sigma2, by what was given and else by the method."""
    if isinstance(given, tuple):
        return float(given[0]), float(given[1])
    if given is not None:
        return float(given), float(given)
    if method == "default":
        return DEFAULT_NUGGET
    # equal inputs with unequal responses: their variance is the least noise there can be
    value = max(FORWARD_NUGGET, replicate_variance(runs))
    return value, value


def check_rules(given: Any) -> None:
    """Whether criterion, eta, threshold, n_features, n_starts, enough and nugget of a screener fit.

    Raises ValueError naming the one that does not.
    """
    if given.criterion not in ("reml", "ml"):
        raise ValueError(f"criterion needs 'reml' or 'ml', got {given.criterion!r}")
    if given.eta is not None and not (isinstance(given.eta, Real) and 1.0 <= float(given.eta) <= 2.0):
        raise ValueError(f"eta needs a number with 1 <= eta <= 2, or None, got {given.eta!r}")
    if given.threshold is not None and not (
        isinstance(given.threshold, Real) and float(given.threshold) >= 0.0
    ):
        raise ValueError(f"threshold needs a number >= 0, or None, got {given.threshold!r}")
    if given.n_features is not None and given.n_features < 1:
        raise ValueError(f"n_features needs at least 1, got {given.n_features}")
    if given.n_starts < 1 or given.enough < 1:
        raise ValueError(
            f"n_starts and enough need at least 1, got n_starts={given.n_starts} and enough={given.enough}"
        )
    if given.nugget is None:
        return
    pair = given.nugget if isinstance(given.nugget, tuple) else (given.nugget, given.nugget)
    numbers = len(pair) == 2 and all(isinstance(v, Real) for v in pair)
    if not (numbers and 0.0 < float(pair[0]) <= float(pair[1]) < np.inf):
        raise ValueError(
            "nugget needs a positive number or a pair (low, high) with 0 < low <= high, or None to have "
            f"it estimated, got {given.nugget!r}"
        )


def check_columns(groups: Sequence[Sequence[int]], d: int) -> None:
    """Whether groups of columns out of d are possible and apart.

    Raises ValueError naming the column that does not fit.
    """
    flat = [int(k) for group in groups for k in group]
    wrong = [k for k in flat if not 0 <= k < d]
    if wrong:
        raise ValueError(f"groups need columns 0 to {d - 1}, got {wrong[0]}")
    twice = [k for k in set(flat) if flat.count(k) > 1]
    if twice:
        raise ValueError(f"groups need each column at most once, got column {twice[0]} twice")
