"""The exact interval of a share that was counted in independent draws.

    k of n:    low = quantile of Beta(k, n - k + 1) at 0.025,    high = that of Beta(k + 1, n - k) at 0.975
    0 of n:    high = 1 - 0.05^(1/n) < 3/n, one-sided, since there is nothing below none

Clopper and Pearson 1934. Its coverage is at least 95 % for every n and every share.
"""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from math import ceil, floor, log10

from scipy.stats import beta

__all__ = ["Share", "at_least", "at_most", "counted_share"]

LEVEL = 0.95
ROUNDING = 1e-9  # of the last digit: what binary fractions add


@dataclass(frozen=True, slots=True, kw_only=True)
class Share:
    """`hits` of `draws` independent cases, and the 95 % interval of the share of all cases."""

    hits: int
    draws: int
    low: float
    high: float

    def to_dict(self) -> dict[str, float | int]:
        """For a JSON document."""
        return asdict(self)


def counted_share(hits: int, draws: int) -> Share:
    """The share of which `hits` of `draws` independent cases are a sample; all of [0, 1] without a draw.

    Raises:
        ValueError: more hits than draws, or less than none.

    >>> counted_share(0, 300).high < 3 / 300
    True
    >>> share = counted_share(9, 10)
    >>> round(share.low, 3), round(share.high, 3)
    (0.555, 0.997)
    """
    if not 0 <= hits <= draws:
        raise ValueError(f"hits needs a number between 0 and draws={draws}, got {hits}")
    tail = (1 - LEVEL) if hits in (0, draws) else (1 - LEVEL) / 2
    low = float(beta.ppf(tail, hits, draws - hits + 1)) if hits else 0.0
    high = float(beta.ppf(1 - tail, hits + 1, draws - hits)) if hits < draws else 1.0
    return Share(hits=int(hits), draws=int(draws), low=low, high=high)  # counts of numpy's are no JSON


def at_most(share: float, *, digits: int = 2) -> str:
    """An upper end in per cent, to so many digits and never below it.

    >>> at_most(0.010277), at_most(0.00994), at_most(1.0), at_most(0.0)
    ('1.1 %', '1 %', '100 %', '0 %')
    """
    return _percent(share, ceil, -ROUNDING, digits)


def at_least(share: float, *, digits: int = 2) -> str:
    """A lower end in per cent, to so many digits and never above it.

    >>> at_least(0.010277), at_least(0.0199)
    ('1 %', '1.9 %')
    """
    return _percent(share, floor, ROUNDING, digits)


def _percent(share: float, rounded: Callable[[float], int], slack: float, digits: int) -> str:
    if share <= 0.0:
        return "0 %"
    last = 10.0 ** (floor(log10(100 * share)) + 1 - digits)
    return f"{rounded(100 * share / last + slack) * last:.{max(digits, 3)}g} %"  # 100 has three
