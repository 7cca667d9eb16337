"""New runs in the strata that old ones leave empty, as near to a design drawn at once as they come.

The new runs are arranged by swaps from several starts. Where phi_p, CD2 or the largest correlation of the
whole then lies beyond REACH times that of a design of as many runs drawn at once, other weights are tried,
and new runs that are drawn in towards the middle by some per cent: in many dimensions CD2 asks for more runs
in the middle than empty strata have, and so does the mean error of a Kriging (decision 0208).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import doe
from doe.latin.swaps import SwapResult
from workbench.sampling.factors import Factors

__all__ = ["CRITERIA", "place", "spread_beside"]

# what new runs are spread by, beside the old ones, with weights; distances alone leave correlations
CRITERIA, WEIGHTS = ("phi_p", "cd2", "correlation"), (2.0, 1.0, 2.0)
# arrangements that are searched, each from a start of its own; the one of least excess is taken:
#     max over phi_p and CD2 of (value / best value seen - 1) + CORRELATION * largest correlation
STARTS, CORRELATION = 24, 1.0
# swaps of each: half a second of work together, but never fewer than the second
MOST_SWAPS, FEWEST_SWAPS = 100_000, 20_000
WORK = 6_000_000  # swaps times runs, of each start
# share of the swaps that put new runs on levels, before they are arranged there
PLACING = 5
# beyond so many runs, whose arrangements differ little, one long search is made
FEW, LONG = 200, 30_000_000

REACH = 1.05  # times the value of a design drawn at once
OTHER_WEIGHTS = ((1.0, 1.0, 1.0), (1.0, 2.0, 2.0))  # CD2 gains by them what correlations can spare
DRAWN_IN = (1.0, 0.95, 0.92, 0.89)  # distance of new runs from the middle; phi_p pays 0.4 % for each per cent
# what drawing in must gain where it does not bring phi_p and CD2 within reach: strata are given up for it
PRICE = 0.02
OFF_MIDDLE = 0.1  # new runs whose mean lies farther from the middle fill a side: they are not drawn in
EXACT = 9  # digits by which arrangements are compared: the last bits differ between processors


@dataclass(frozen=True, slots=True, kw_only=True)
class _Search:
    """What every search of new runs has in common: `runs` of them beside `unit`, by `swaps` trials."""

    unit: np.ndarray
    runs: int
    swaps: int
    starts: int
    rng: np.random.Generator

    def arranged(self, new: np.ndarray, weights: Sequence[float]) -> SwapResult:
        """The new runs (runs, d) after swaps inside their columns."""
        whole = np.vstack([self.unit, new])
        return doe.search_rearrangement(
            whole, self.runs, criterion=CRITERIA, weights=weights, swaps=self.swaps, rng=self.rng
        )


def spread_beside(
    factors: Factors,
    unit: np.ndarray,
    runs: int,
    fresh: Mapping[str, float] | None,
    *,
    rng: np.random.Generator,
) -> np.ndarray:
    """New points (runs, d) in the empty strata beside `unit` (n, d).

    fresh: the criteria of a design of n + runs drawn at once; None where the first arrangement will do
    """
    n = len(unit) + runs
    starts = STARTS if n <= FEW else 1
    swaps = max(FEWEST_SWAPS, min(MOST_SWAPS, (WORK if starts > 1 else LONG) // n))
    search = _Search(unit=unit, runs=runs, swaps=swaps, starts=starts, rng=rng)
    found = _in_strata(factors, search)
    best = found[int(np.argmin(_excess([result.values for result in found])))]
    # with levels other weights bring back correlations (decision 0127): 0.067 where the usual ones have 0.025
    if fresh is not None and all(levels is None for levels in factors.levels):
        best = _within_reach(search, found, best, fresh)
    return on_levels(factors, best.points[len(unit) :])


def _in_strata(factors: Factors, search: _Search) -> list[SwapResult]:
    """Arrangements in the empty strata; a level is an interval, on which its old runs are spread evenly."""
    unit, runs = search.unit, search.runs
    old = unit.copy()
    for j, levels in enumerate(factors.levels):
        if levels is not None:
            code = place(unit[:, j], levels)
            for level in np.unique(code):
                on = np.flatnonzero(code == level)
                old[on, j] = (level + (np.arange(len(on)) + 0.5) / len(on)) / len(levels)
    free = all(levels is None for levels in factors.levels)
    found = []
    for _ in range(search.starts):
        # strata say how many new runs come on each level; how they are arranged is judged on the levels
        placed = doe.search_augmentation(
            old,
            runs,
            criterion=CRITERIA,
            weights=WEIGHTS,
            swaps=search.swaps if free else search.swaps // PLACING,
            rng=search.rng,
        )
        new = placed.points[len(unit) :]
        found.append(placed if free else search.arranged(on_levels(factors, new), WEIGHTS))
    return found


def _within_reach(
    search: _Search,
    found: Sequence[SwapResult],
    usual: SwapResult,
    fresh: Mapping[str, float],
) -> SwapResult:
    """The arrangement that lies least beyond REACH of `fresh`, the least drawn in of those that lie within.

    phi_p and the correlation are not given for CD2: they stay within reach, or as in the `usual` arrangement.
    """
    most = {name: max(REACH * fresh[name], usual.values[name]) for name in ("phi_p", "correlation")}
    best, least = usual, _shortfall(usual.values, fresh)
    for share in DRAWN_IN:
        if least == 0.0 or (share < 1.0 and _shortfall(best.values, fresh, CRITERIA[:2]) == 0.0):
            break
        before = least
        for weights in OTHER_WEIGHTS if share == 1.0 else (WEIGHTS, *OTHER_WEIGHTS):
            for k in range(max(1, search.starts // (1 + len(OTHER_WEIGHTS)))):
                new = _drawn_in(found[k % len(found)].points[len(search.unit) :], share)
                result = search.arranged(new, weights)
                short = _shortfall(result.values, fresh)
                if share < 1.0 and _shortfall(result.values, fresh, CRITERIA[:2]) > 0.0:
                    short += PRICE
                if short < least and all(result.values[name] <= most[name] for name in most):
                    best, least = result, short
        if share < 1.0 and least == before:
            break
    return best


def _drawn_in(new: np.ndarray, share: float) -> np.ndarray:
    """The new runs (m, d), `share` as far from the middle in every column whose range they fill."""
    drawn = new.copy()
    for j, column in enumerate(new.T):
        if abs(column.mean() - 0.5) < OFF_MIDDLE:
            drawn[:, j] = 0.5 + share * (column - 0.5)
    return drawn


def _shortfall(
    values: Mapping[str, float], fresh: Mapping[str, float], names: Sequence[str] = CRITERIA
) -> float:
    """How far the criteria lie beyond REACH of those of a design drawn at once: 0 where all are within.

    One per cent of phi_p or CD2 and a correlation of 0.01 weigh the same.
    """
    total = 0.0
    for name in names:
        if name == "correlation":
            total += CORRELATION * max(0.0, values[name] - REACH * fresh[name])
        else:
            total += max(0.0, values[name] / fresh[name] - REACH)
    return round(total, EXACT)


def _excess(values: Sequence[Mapping[str, float]]) -> np.ndarray:
    """How far arrangements lie above the best values seen of phi_p and CD2, the larger share, with the
    correlation: (k,) of k results."""
    spread = np.array([[value[name] for name in CRITERIA[:2]] for value in values])
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.nan_to_num(spread / spread.min(axis=0) - 1.0, nan=0.0, posinf=0.0)  # runs that coincide
    worst: np.ndarray = share.max(axis=1) + CORRELATION * np.array(
        [v.get("correlation", 0.0) for v in values]
    )
    return worst


def on_levels(factors: Factors, points: np.ndarray) -> np.ndarray:
    """The points with every levelled coordinate on the level in whose interval it lies."""
    placed = points.copy()
    for j, levels in enumerate(factors.levels):
        if levels is not None:
            placed[:, j] = levels[np.minimum((points[:, j] * len(levels)).astype(int), len(levels) - 1)]
    return placed


def place(values: np.ndarray, levels: np.ndarray) -> np.ndarray:
    """Number of the level of each value."""
    return np.abs(values[:, None] - levels).argmin(axis=1)
