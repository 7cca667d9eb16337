"""A space as a search sees it: unit coordinates that snap to what can be set, and features for the Kriging.

Continuous, integer, grid-stepped, discrete and binary parameters are one coordinate and one feature. A
categorical parameter with m > 2 levels is one coordinate and m features (an indicator per level), so that
any two levels are equally far apart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from workbench.space.box import Space, need_space

__all__ = ["SearchSpace"]

MAX_COMBINATIONS = 64  # discrete combinations that are enumerated one by one
MAX_CORNERS = 2**12
MAX_POINTS = 2**14  # of a finite space that is enumerated


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSpace:
    """`levels[j]` holds the admissible unit values of coordinate j, or None when it is continuous."""

    space: Space
    levels: tuple[np.ndarray | None, ...]
    categorical: tuple[bool, ...]

    @classmethod
    def of(cls, space: Space) -> "SearchSpace":
        """The search's view of `space`; anything else is refused."""
        need_space(space, name="space")
        levels = tuple(space.unit_levels)
        categorical = tuple(
            parameter.kind == "categorical" and grid is not None and len(grid) > 2
            for parameter, grid in zip(space.parameters, levels, strict=True)
        )
        return cls(space=space, levels=levels, categorical=categorical)

    @property
    def dimension(self) -> int:
        """Number of coordinates d."""
        return len(self.levels)

    @property
    def n_features(self) -> int:
        """Number of features p."""
        return sum(
            len(g) if c and g is not None else 1 for g, c in zip(self.levels, self.categorical, strict=True)
        )

    @property
    def discrete(self) -> tuple[int, ...]:
        """Coordinates with a finite number of levels."""
        return tuple(j for j, grid in enumerate(self.levels) if grid is not None)

    @property
    def is_finite(self) -> bool:
        """Whether every coordinate has levels, so that the space can be enumerated."""
        return len(self.discrete) == self.dimension

    @property
    def size(self) -> float:
        """Number of points of a finite space, infinity otherwise."""
        return float(np.prod([float(len(g)) if g is not None else np.inf for g in self.levels]))

    def snap(self, u: np.ndarray) -> np.ndarray:
        """The nearest admissible points to u (n, d)."""
        out = np.clip(np.array(u, dtype=float, ndmin=2), 0.0, 1.0)
        for j, grid in enumerate(self.levels):
            if grid is not None:
                out[:, j] = grid[np.abs(out[:, j, None] - grid).argmin(axis=1)]
        return out

    def features(self, u: np.ndarray) -> np.ndarray:
        """Kriging features (n, p) of unit points (n, d)."""
        columns: list[np.ndarray] = []
        for j, (grid, is_category) in enumerate(zip(self.levels, self.categorical, strict=True)):
            if is_category and grid is not None:
                columns += [(np.abs(u[:, j] - value) < 1e-9).astype(float) for value in grid]
            else:
                columns.append(u[:, j])
        return np.column_stack(columns)

    def rows(self, u: np.ndarray) -> list[dict[str, Any]]:
        """Named physical parameters of unit points (n, d)."""
        return self.space.rows(u)

    def unit(self, rows: Sequence[Mapping[str, Any]]) -> np.ndarray:
        """Unit points (n, d) of named physical parameters."""
        return self.space.unit(rows)

    def allowed(self, u: np.ndarray) -> np.ndarray:
        """Which of the points (n, d) meet the space's constraints."""
        return self.space.feasible(u)

    def corners(self) -> np.ndarray | None:
        """All corners (2^k, d) of the numeric coordinates crossed with all categories; None when too many."""
        ends = [
            np.array([0.0, 1.0]) if grid is None else (grid if c else grid[[0, -1]])
            for grid, c in zip(self.levels, self.categorical, strict=True)
        ]
        count = float(np.prod([float(len(end)) for end in ends]))
        if count > MAX_CORNERS:
            return None
        return np.array(list(product(*ends)))

    def points(self) -> np.ndarray | None:
        """All points (n, d) of a finite space that meet its constraints; None when there are too many."""
        if not self.is_finite or self.size > MAX_POINTS:
            return None
        table = np.array(list(product(*(grid for grid in self.levels if grid is not None))))
        allowed: np.ndarray = table[self.allowed(table)]
        return allowed

    def combinations(self) -> np.ndarray | None:
        """All combinations (m, k) of the k discrete coordinates; None when there are none or too many."""
        grids = [self.levels[j] for j in self.discrete]
        count = float(np.prod([float(len(g)) for g in grids if g is not None]))
        if not grids or count > MAX_COMBINATIONS:
            return None
        return np.array(list(product(*(g for g in grids if g is not None))))
