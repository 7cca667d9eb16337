"""The trend of a minimax search's Kriging: the largest that the runs near the present design can carry.

Without categories it is one of the named trends over d coordinates. With categories the features hold an
indicator per level, which sum to one, so most terms of a named trend say nothing new and their number far
exceeds the runs. In its place stands

    1 + x + x x' + [level] + [level] x + [level][level of another category]

over the numeric features x and all levels of a category but its first: every pair of levels may differ by
a constant and by slopes, and curvature is common to all.
"""

from dataclasses import dataclass
from itertools import combinations, combinations_with_replacement

import numpy as np

from workbench.search.runs.unit_space import SearchSpace

__all__ = ["MixedTrend", "largest_trend"]

Array = np.ndarray

SPARE_RUNS = 3  # beyond the terms of a trend
RUNS_PER_TERM = 1.5  # of a trend with categories, whose levels share the runs among themselves


@dataclass(frozen=True, slots=True)
class MixedTrend:
    """Terms over `numeric` feature columns and `levels`, per category the columns of all levels but one."""

    numeric: tuple[int, ...]
    levels: tuple[tuple[int, ...], ...]
    curved: bool
    crossed: bool

    @property
    def products(self) -> list[tuple[int, int]]:
        """Pairs of feature columns that are multiplied."""
        found: list[tuple[int, int]] = []
        if self.curved:
            found += combinations_with_replacement(self.numeric, 2)
        if self.crossed:
            found += [(k, j) for group in self.levels for k in group for j in self.numeric]
            found += [(k, j) for a, b in combinations(self.levels, 2) for k in a for j in b]
        return found

    @property
    def n_terms(self) -> int:
        """Number of terms, the constant among them."""
        return 1 + len(self.numeric) + sum(map(len, self.levels)) + len(self.products)

    def __call__(self, features: Array) -> Array:
        """F, the terms at the rows of features (m, p): (m, terms)."""
        single = [*self.numeric, *(k for group in self.levels for k in group)]
        columns = [np.ones(len(features)), *features[:, single].T]
        columns += [features[:, i] * features[:, j] for i, j in self.products]
        return np.column_stack(columns)


def largest_trend(spaces: tuple[SearchSpace, ...], n: int) -> str | MixedTrend:
    """The largest trend that n runs carry, over the features of `spaces` side by side."""
    d = sum(space.dimension for space in spaces)
    if not any(flag for space in spaces for flag in space.categorical):
        quadratic = (d + 1) * (d + 2) // 2
        return "quadratic" if n >= quadratic + SPARE_RUNS else "linear" if n >= d + SPARE_RUNS else "constant"
    numeric, levels = _columns(spaces)
    for curved, crossed in ((True, True), (True, False), (False, False)):
        trend = MixedTrend(numeric, levels, curved, crossed)
        if n >= max(trend.n_terms + SPARE_RUNS, RUNS_PER_TERM * trend.n_terms):
            return trend
    return "constant"


def _columns(spaces: tuple[SearchSpace, ...]) -> tuple[tuple[int, ...], tuple[tuple[int, ...], ...]]:
    """Numeric feature columns, and per category those of all levels but the first."""
    numeric: list[int] = []
    levels: list[tuple[int, ...]] = []
    column = 0
    for space in spaces:
        for grid, is_category in zip(space.levels, space.categorical, strict=True):
            width = len(grid) if is_category and grid is not None else 1
            if width == 1:
                numeric.append(column)
            else:
                levels.append(tuple(range(column + 1, column + width)))
            column += width
    return tuple(numeric), tuple(levels)
