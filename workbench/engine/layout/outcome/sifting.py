"""Linear programmes of many variables under few rows, by sifting.

At given prices of the rows a variable of the programme belongs on the bound that its reduced cost points to,
and only those whose reduced cost is nearly zero are in doubt. So prices are guessed from a sample of the
variables, all that are in no doubt are laid on their bounds, a small programme of the rest gives better
prices, and those that lie on the wrong bound by them join, until none does or what the prices prove is the
value reached (sifting, Bixby and others 1992). The answer solves the whole programme: its prices prove it.
A hundred thousand variables under four rows take a fifth of a second, where a general solver takes ten.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

__all__ = ["sifted"]

Array = NDArray[np.float64]
Columns = NDArray[np.intp]
Solve = Callable[[Array, Array, Array, Array, Array], "tuple[Array, Array] | None"]

_SAMPLE = 3000  # variables
_DOUBTFUL = 3000  # variables nearest to a reduced cost of zero that a small programme begins with
_HEAVY = 1e-3  # share of a row's reach from which a variable is in every programme
_ROUNDS = 25
_SCALINGS = 4  # of rows and columns in turn
_PART = 0.3  # of the way to prices that prove less
_JOINING = 8000  # variables in a round, those that are worth most first
_GAP, _NEARLY = 1e-9, 1e-7  # between a design and what prices prove, in units of all terms: the optimum
_LEVEL = 1e-3  # reduced cost, in units of its terms, of a variable that may stay where it is
_WRONG = 1e-9  # reduced cost, in units of the terms that it is the sum of


def sifted(
    cost: Array, rows: Array, right: Array, lower: Array, upper: Array, solve: Solve,
    near: Array | None = None,
) -> tuple[Array, Array] | None:  # fmt: skip
    """x (n,) and prices (q,) that minimise cost x under rows x <= or = right; None where this does not end.

    solve: of such a programme of some columns, (cost, rows, right, lower, upper) -> x and prices.
    near (n,): meets the rows and may be nearly the optimum, which is then found to `_NEARLY`.
    """
    by_row, by_column, unit = _scales(cost, rows, np.isfinite(upper - lower))
    low, high = lower / by_column, upper / by_column
    found = _sifted(
        cost * by_column / unit, rows * by_column * by_row[:, None], right * by_row, low, high, solve,
        None if near is None else near / by_column,
    )  # fmt: skip
    if found is None:
        return None
    x, prices = found
    whole = np.where(x <= low, lower, np.where(x >= high, upper, np.clip(x * by_column, lower, upper)))
    return whole, prices * unit * by_row


def _scales(cost: Array, rows: Array, bounded: NDArray[np.bool_]) -> tuple[Array, Array, float]:
    """Factors of rows and columns that bring the largest entry of each near 1 (Ruiz 2001), and a unit of
    cost: the tolerances of a solver are absolute."""
    by_row, by_column, size = np.ones(len(rows)), np.ones(len(cost)), np.abs(rows)
    for _ in range(_SCALINGS):
        for axis, factor in ((1, by_row), (0, by_column)):
            largest = (by_row[:, None] * size * by_column).max(axis=axis, initial=0.0)
            factor /= np.sqrt(np.where(largest > 0, largest, 1.0))
    largest = (by_row[:, None] * size * by_column).max(axis=0, initial=0.0)
    by_column /= np.where(largest > 0, largest, 1.0)
    unit = float(np.abs(cost * by_column)[bounded].max(initial=0.0)) or float(np.abs(cost * by_column).max())
    return by_row, by_column, unit or 1.0


def _sifted(
    cost: Array, rows: Array, right: Array, lower: Array, upper: Array, solve: Solve, near: Array | None
) -> tuple[Array, Array] | None:
    n = len(cost)
    width = upper - lower
    with np.errstate(invalid="ignore"):
        reach = np.where(rows != 0, np.abs(rows) * width, 0.0)
    bounded = np.isfinite(width)
    total = np.maximum(reach[:, bounded].sum(axis=1, keepdims=True), 1e-300)
    always = ~bounded | (reach > _HEAVY * total).any(axis=0)
    light = np.flatnonzero(~always)
    if len(light) <= 2 * _SAMPLE:
        return None
    prices = _from_a_sample(cost, rows, right, lower, upper, np.flatnonzero(always), light, solve)
    if prices is None:
        return None
    terms, sizes = np.abs(cost), np.abs(rows)

    def reduced_at(prices: Array) -> tuple[Array, float]:
        """Reduced costs, and the least value of the whole programme that these prices prove."""
        reduced = cost + prices @ rows
        moves = np.minimum(reduced[bounded] * lower[bounded], reduced[bounded] * upper[bounded])
        return reduced, float(moves.sum() - prices @ right)

    gap = _GAP if near is None else _NEARLY

    def enough(prices: Array) -> float:
        return gap * float(((terms + np.abs(prices) @ sizes)[bounded] * width[bounded]).sum())

    inside, count, stay = always.copy(), _DOUBTFUL, False
    reduced, bound = reduced_at(prices)
    if near is not None and float(cost @ near) - bound <= enough(prices):
        return near, prices
    for _ in range(_ROUNDS):
        unsure = np.abs(reduced) / np.maximum(terms + np.abs(prices) @ sizes, 1e-300)
        doubt = unsure[light]
        inside[light[np.argpartition(doubt, min(count, len(light) - 1))[:count]]] = True
        if inside.sum() > n // 2:
            return None
        outside = ~inside
        x = np.where(reduced >= 0, lower, upper)
        if stay and near is not None:
            x = np.where(unsure < _LEVEL, near, x)
        spent = rows[:, outside] @ x[outside]
        found = solve(cost[inside], rows[:, inside], right - spent, lower[inside], upper[inside])
        if found is None:  # what is laid on bounds leaves the rest no room
            count *= 2 if near is not None and not stay else 4
            stay = True
            continue
        x[inside], new = found
        there, proved = reduced_at(new)
        size = terms + np.abs(new) @ sizes
        wrong = ((x > lower) & (there > _WRONG * size)) | ((x < upper) & (there < -_WRONG * size))
        wrong &= outside
        if not wrong.any() or float(cost @ x) - proved <= enough(new):
            return x, new
        if proved < bound:  # the prices went too far: a part of the way
            new = prices + _PART * (new - prices)
            there, proved = reduced_at(new)
            count *= 2
        turned = np.flatnonzero(wrong if proved >= bound else outside & (there * reduced < 0))
        if len(turned) > _JOINING:
            worth = np.abs(there[turned]) * width[turned]
            turned = turned[np.argpartition(-worth, _JOINING)[:_JOINING]]
        inside[turned] = True
        if proved >= bound:
            prices, reduced, bound = new, there, proved
    return None


def _from_a_sample(
    cost: Array, rows: Array, right: Array, lower: Array, upper: Array, always: Columns, light: Columns,
    solve: Solve,
) -> Array | None:  # fmt: skip
    """Prices of a programme in which every so many variables stand for all."""
    chosen = np.random.default_rng(0).choice(light, _SAMPLE, replace=False)
    share = len(light) / _SAMPLE
    columns = np.r_[always, chosen]
    weight = np.r_[np.ones(len(always)), np.full(_SAMPLE, share)]
    found = solve(weight * cost[columns], weight * rows[:, columns], right, lower[columns], upper[columns])
    return None if found is None else found[1]
