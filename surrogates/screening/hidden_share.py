"""What the runs leave unexplained, and so the share of the variance that an input may hide in.

The leave-one-out errors e_i of the selected inputs' Kriging hold the variance that it does not explain. An
input that is missing leaves at least its total Sobol' index there, E[Var(y | all others)] / Var(y), so none
above

    x = U exp(1.645 s / sqrt(n)),    U = mean e_i^2 / mean (y_i - mean y)^2,

is missing, U's upper 95 % bound with s the coefficient of variation of e_i^2: by the delta method on log U,
whose law is nearer to the normal one than U's. Noise is part of it: what noise covers may hide as well.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["HiddenShare", "RoughSide", "hidden_share", "percent", "rough_side"]

Array = NDArray[np.float64]

NORMAL_95 = 1.6449
SHUFFLES = 400
RISK = 0.05  # that errors spread over the box are said to lie on one side of it
SMALLEST_SIDE = 0.2  # of the runs
LOWEST = 1e-6  # share of the variance below which nothing is told apart


@dataclass(frozen=True, slots=True, kw_only=True)
class HiddenShare:
    """Shares of the variance: `unexplained`, U above; `upper`, x: no input above it is missing."""

    unexplained: float
    upper: float


@dataclass(frozen=True, slots=True, kw_only=True)
class RoughSide:
    """Where the errors are large: above or below `bound`, a value of column `column`."""

    column: int
    above: bool
    bound: float
    share: float
    """Of the squared errors that lie there."""


def hidden_share(errors: Array, y: Array) -> HiddenShare:
    """U and x from leave-one-out errors (n,), nan where there is none, of responses y (n,).

    >>> rng = np.random.default_rng(0)
    >>> y = rng.standard_normal(50)
    >>> found = hidden_share(0.1 * rng.standard_normal(50), y)
    >>> print(f"{found.unexplained:.3f} {found.upper:.3f}")
    0.012 0.016
    """
    usable = np.isfinite(errors)
    away = y[usable] - y.mean()
    scale = float(np.abs(away).max()) if usable.any() else 0.0
    if scale <= 0.0:
        return HiddenShare(unexplained=1.0, upper=1.0)
    squares = (errors[usable] / scale) ** 2  # in units of y their own squares overflow where y is 1e80
    mean = float(squares.mean())
    u = mean / float(((away / scale) ** 2).mean())
    if u <= LOWEST:
        return HiddenShare(unexplained=u, upper=LOWEST)
    variation = float(squares.std(ddof=1)) / mean if len(squares) > 1 else 1.0
    upper = u * float(np.exp(NORMAL_95 * variation / np.sqrt(len(squares))))
    return HiddenShare(unexplained=min(u, 1.0), upper=min(upper, 1.0))


def rough_side(
    x: Array, errors: Array, columns: Sequence[int], *, rng: np.random.Generator
) -> RoughSide | None:
    """The half of the box where the model errs most, None when its errors are spread as by chance.

    Each of `columns` of x (n, d) is cut at its fifths; the side whose mean squared error stands out most
    is taken when no more than one in twenty shuffles of the errors stands out as much (Breiman et al.,
    Classification and Regression Trees, 1984: one split).

    >>> rng = np.random.default_rng(0)
    >>> x = rng.random((60, 3))
    >>> errors = rng.standard_normal(60) * np.where(x[:, 1] > 0.6, 5.0, 0.1)
    >>> side = rough_side(x, errors, [0, 1, 2], rng=rng)
    >>> side.column, side.above, bool(side.share > 0.7)
    (1, True, True)
    """
    usable = np.isfinite(errors)
    size = np.sqrt(np.abs(errors[usable]))  # one large error is no region
    n = len(size)
    if n < 10 or not len(columns) or float(np.ptp(size)) <= 0.0:
        return None
    sides: list[tuple[int, bool, float]] = []
    masks: list[NDArray[np.bool_]] = []
    for k in columns:
        column = x[usable, k]
        for bound in np.unique(np.quantile(column, [0.2, 0.4, 0.6, 0.8])):
            for above in (True, False):
                mask = column > bound if above else column < bound
                if SMALLEST_SIDE * n <= mask.sum() + 1 and mask.sum() < n:
                    sides.append((int(k), above, float(bound)))
                    masks.append(mask)
    if not sides:
        return None
    inside = np.array(masks, dtype=float)
    count = inside.sum(axis=1)
    centred = (size - size.mean()) / size.std()
    weight = 1.0 / np.sqrt(count * (n - count) / n)
    seen = weight * (inside @ centred)
    best = int(np.argmax(seen))
    shuffled = rng.permuted(np.tile(centred, (SHUFFLES, 1)), axis=1)
    chance = float((((shuffled @ inside.T) * weight).max(axis=1) >= seen[best]).mean())
    if chance > RISK:
        return None
    squares = errors[usable] ** 2
    column, above, bound = sides[best]
    return RoughSide(
        column=column,
        above=above,
        bound=bound,
        share=float(squares[masks[best]].sum() / squares.sum()),
    )


def percent(share: float) -> str:
    """A share as it is said: never below a tenth of a percent.

    >>> percent(0.034), percent(0.0042), percent(1e-5)
    ('3.4 %', '0.4 %', '0.1 %')
    """
    said = max(100.0 * share, 0.1)
    return f"{said:.0f} %" if said >= 9.95 else f"{said:.1f} %"
