"""Where an adversary draws its cases: every combination of the unordered levels gets an equal share.

A stratum is one combination of the levels of the categorical and binary parameters. The worst of a response
often lies in one of them (hands on, belt off), and a draw that ignores them sends it one run in so many.
Where there are more strata than `MOST`, a subset of them is drawn in which every level of every parameter
takes its equal turn; the record of the attack says how many of how many were met.
"""

from dataclasses import dataclass
from itertools import product

import numpy as np

from workbench.search.runs.unit_space import SearchSpace

__all__ = ["Strata"]

MOST = 64
AT_END = 0.75  # chance that a coordinate of a near-corner stands at an end; inside, it is drawn evenly
MOST_CORNERS = 2**14
TRIES = 50  # redraws per case that a constraint refuses


@dataclass(frozen=True, slots=True, kw_only=True)
class Strata:
    """The combinations `levels` (s, c) of the unordered coordinates `columns` (c,), of `count` in all.

    Without an unordered coordinate there is one stratum, the whole space: `levels` is (1, 0).
    """

    where: SearchSpace
    columns: tuple[int, ...]
    levels: np.ndarray
    count: int

    @classmethod
    def of(cls, where: SearchSpace, *, most: int = MOST, rng: np.random.Generator) -> "Strata":
        """The strata of a space, at most `most` of them."""
        kinds = [parameter.kind for parameter in where.space.parameters]
        columns = tuple(j for j, kind in enumerate(kinds) if kind in ("categorical", "binary"))
        grids = [grid for j in columns if (grid := where.levels[j]) is not None]
        count = int(np.prod([len(grid) for grid in grids])) if grids else 1
        if count <= most:
            table = np.array(list(product(*grids))).reshape(count, len(columns))
            return cls(where=where, columns=columns, levels=table[rng.permutation(count)], count=count)
        turns = [rng.permutation(np.resize(rng.permutation(grid), most)) for grid in grids]
        return cls(
            where=where, columns=columns, levels=np.unique(np.column_stack(turns), axis=0), count=count
        )

    def __len__(self) -> int:
        return len(self.levels)

    def corners(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """`size` corners in equal shares; fewer, and all of them, where there are no more than `size`."""
        free = self.where.dimension - len(self.columns)
        if self.has_corners_within(size):
            ends = np.array(list(product((0.0, 1.0), repeat=free))).reshape(2**free, free)
            return self._allowed(np.vstack([self._placed(ends, levels) for levels in self.levels]))
        return self._drawn(size, lambda n: rng.integers(0, 2, (n, self.where.dimension)).astype(float))

    def has_corners_within(self, size: int) -> bool:
        """Whether there are no more than `size` corners in all."""
        free = self.where.dimension - len(self.columns)
        return len(self) == self.count and free < np.log2(MOST_CORNERS) and len(self) * 2**free <= size

    def near_corners(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """`size` cases in equal shares, every coordinate at one of its ends with a chance of `AT_END`."""

        def draw(n: int) -> np.ndarray:
            ends = rng.integers(0, 2, (n, self.where.dimension)).astype(float)
            inside = rng.random((n, self.where.dimension))
            return np.where(rng.random(ends.shape) < AT_END, ends, inside)

        return self._drawn(size, draw)

    def inside(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """`size` cases drawn evenly, in equal shares."""
        return self._drawn(size, lambda n: rng.random((n, self.where.dimension)))

    def anywhere(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """`size` cases in equal shares, each with even chances inside or near a corner."""

        def draw(n: int) -> np.ndarray:
            ends = rng.integers(0, 2, (n, self.where.dimension)).astype(float)
            inside = rng.random((n, self.where.dimension))
            is_end = (rng.random(ends.shape) < AT_END) & (rng.random((n, 1)) < 0.5)
            return np.where(is_end, ends, inside)

        return self._drawn(size, draw)

    def index(self, points: np.ndarray) -> np.ndarray:
        """The stratum (n,) of each point (n, d), -1 of those in none of the strata that were drawn."""
        own = points[:, None, list(self.columns)]
        same = np.all(np.abs(own - self.levels[None]) < 1e-9, axis=2)
        found: np.ndarray = np.where(same.any(axis=1), same.argmax(axis=1), -1)
        return found

    def _drawn(self, size: int, draw) -> np.ndarray:  # type: ignore[no-untyped-def]
        """Up to `size` different admissible cases of `draw`, the strata by turns."""
        turn = np.resize(np.arange(len(self)), size)
        points = np.empty((size, self.where.dimension))
        missing = np.ones(size, dtype=bool)
        for _ in range(TRIES):
            at = np.flatnonzero(missing)
            if not len(at):
                break
            drawn = draw(len(at))
            drawn[:, list(self.columns)] = self.levels[turn[at]]
            drawn = self.where.snap(drawn)
            points[at] = drawn
            missing[at] = ~self.where.allowed(drawn)
        kept = points[~missing]
        first = np.sort(np.unique(kept, axis=0, return_index=True)[1])
        different: np.ndarray = kept[first]
        return different

    def _placed(self, ends: np.ndarray, levels: np.ndarray) -> np.ndarray:
        points = np.empty((len(ends), self.where.dimension))
        numeric = [j for j in range(self.where.dimension) if j not in self.columns]
        points[:, numeric] = ends
        points[:, list(self.columns)] = levels
        return points

    def _allowed(self, points: np.ndarray) -> np.ndarray:
        kept: np.ndarray = points[self.where.allowed(points)]
        return kept
