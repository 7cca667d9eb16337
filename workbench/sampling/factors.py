"""Designs over real factors: balanced levels, distributions and constraints, arranged together.

A sampler of `doe` spreads points q over the unit cube; here q is a probability where a parameter has a
distribution and the unit coordinate elsewhere. A column with N levels takes level floor((r + 1/2) N / n)
for the point of rank r, so every level comes up floor(n/N) or ceil(n/N) times. Constraints are met by swaps
inside the columns, which keep this balance and the strata; only where the constraints contradict the strata
themselves (as a + b <= 1 does) are points chosen from the feasible part of the cube instead, and balance
holds as far as it can.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist

import doe
from workbench.errors import StudyError
from workbench.space.box import Space

__all__ = ["Factors"]

# points tried for a feasible part, in batches; and feasible points wanted per run
MOST_TRIED = 65_536
BATCH = 4096
PER_RUN = 20
# swaps tried to make a Latin arrangement feasible, in batches; batches without progress before giving up
SWAPS = 256
PATIENCE = 40
# candidates from which an optimal selection is made at most
POOL = 20_000


@dataclass(frozen=True)
class Factors:
    """A space as a sampler sees it; `follow` says whether points follow the parameters' distributions."""

    space: Space
    follow: bool = True

    @cached_property
    def levels(self) -> list[np.ndarray | None]:
        """Per parameter its admissible unit coordinates, None for a continuum."""
        return self.space.unit_levels

    def unit(self, q: np.ndarray) -> np.ndarray:
        """Unit points (n, d) of sampler points q (n, d)."""
        u = np.array(q, dtype=float)
        if self.follow:
            for j, p in enumerate(self.space.parameters):
                if p.distribution is not None:
                    u[:, j] = p.unit_of(p.quantile(u[:, j]).tolist())
        return u

    def feasible(self, q: np.ndarray) -> np.ndarray:
        """Which sampler points meet all constraints, (n,) of bool."""
        return self.space.feasible(self.unit(q))

    def balanced(self, q: np.ndarray) -> np.ndarray:
        """q with levelled columns moved to levels that come up equally often, as far as n allows."""
        out = np.array(q, dtype=float)
        n = len(out)
        for j, levels in enumerate(self.levels):
            if levels is not None:
                rank = np.argsort(np.argsort(out[:, j], kind="stable"), kind="stable")
                out[:, j] = levels[((2 * rank + 1) * len(levels)) // (2 * n)]
        return out

    def start(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray:
        """A feasible arrangement near q (n, d): levels balanced, constraints met."""
        arranged = self.balanced(q)
        if not self.space.constraints:
            return arranged
        swapped = self._swapped(arranged, rng)
        return self._selected(len(q), rng) if swapped is None else swapped

    def pool(self, size: int, rng: np.random.Generator) -> np.ndarray:
        """At least one and at most `size` different feasible points, levels and strata as even as can be."""
        kept: list[np.ndarray] = []
        tried = found = 0
        met = np.zeros(len(self.space.constraints), dtype=int)
        while tried < MOST_TRIED and found < size:
            batch = min(max(size - found, BATCH), MOST_TRIED - tried) if self.space.constraints else size
            q = self.balanced(doe.lhs(batch, self.space.dimension, rng=rng))
            good = self.feasible(q)
            if self.space.constraints:
                rows = self.space.rows(self.unit(q))
                met += [sum(c.holds(row) for row in rows) for c in self.space.conditions]
            tried += batch
            found += int(good.sum())
            kept.append(q[good])
            if not self.space.constraints:
                break
        if found == 0:
            texts = self.space.constraints
            shares = [f"{text!r} holds in {k / tried:.2%}" for text, k in zip(texts, met, strict=True)]
            worst = texts[int(np.argmin(met))]
            raise StudyError(
                f"the constraints leave no feasible point of {tried} tried: {'; '.join(shares)}; all at once"
                f" in none. The tightest is {worst!r}: loosen it, or the bounds of its parameters"
            )
        points = np.unique(np.vstack(kept), axis=0) if self._has_levels() else np.vstack(kept)
        return np.ascontiguousarray(rng.permutation(points)[:size])

    def _has_levels(self) -> bool:
        return any(levels is not None for levels in self.levels)

    def _swapped(self, q: np.ndarray, rng: np.random.Generator) -> np.ndarray | None:
        """q made feasible by swaps inside its columns, or None where that does not work out."""
        n, d = q.shape
        good = self.feasible(q)
        idle = 0
        while not good.all():
            if idle >= PATIENCE or n < 2:
                return None
            bad = np.flatnonzero(~good)
            first = rng.choice(bad, SWAPS)
            second = rng.integers(0, n, SWAPS)
            column = rng.integers(0, d, SWAPS)
            a, b = q[first], q[second]
            rows = np.arange(SWAPS)
            a[rows, column], b[rows, column] = q[second, column], q[first, column]
            both = self.feasible(np.vstack([a, b])).reshape(2, SWAPS)
            gain = both[0].astype(int) + both[1] - good[first] - good[second]
            touched: set[int] = set()
            progress = False
            for k in np.argsort(-gain, kind="stable").tolist():
                i, j = int(first[k]), int(second[k])
                if gain[k] < 0 or i == j or touched & {i, j}:
                    continue
                if gain[k] == 0 and len(touched) > n // 4:  # a few sideways moves, not a reshuffle
                    break
                q[[i, j], column[k]] = q[[j, i], column[k]]
                good[i], good[j] = both[0, k], both[1, k]
                touched |= {i, j}
                progress = progress or gain[k] > 0
            idle = 0 if progress else idle + 1
        return q

    def _selected(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """n feasible points, each the farthest from those before (Kennard & Stone 1969)."""
        pool = self.pool(max(PER_RUN * n, 200), rng)
        if len(pool) < n:
            raise StudyError(
                f"the constraints leave {len(pool)} different feasible points of {MOST_TRIED} tried"
                f" ({len(pool) / MOST_TRIED:.2%}), {n} runs are asked for; loosen them or ask for fewer runs"
            )
        chosen = [int(rng.integers(len(pool)))]
        nearest = cdist(pool, pool[chosen])[:, 0]
        while len(chosen) < n:
            chosen.append(int(np.argmax(nearest)))
            nearest = np.minimum(nearest, cdist(pool, pool[chosen[-1:]])[:, 0])
        return pool[chosen]

    def model(self, name: str) -> Any:
        """A named model for these factors: words as contrasts, no square of a two-level factor."""
        if name not in ("linear", "interactions", "quadratic"):
            raise StudyError(f"model is one of linear, interactions, quadratic, got {name!r}")
        words = [
            j
            for j, (p, levels) in enumerate(zip(self.space.parameters, self.levels, strict=True))
            if not p.is_numeric and levels is not None and len(levels) > 2
        ]
        if not words:
            terms = doe.model_terms(name, self.space.dimension)
            two = np.array([levels is not None and len(levels) == 2 for levels in self.levels])
            return terms[~np.any((terms == 2) & two, axis=1)]
        counts = {j: len(self.space.parameters[j].levels) for j in words}
        squares = [
            levels is None or (j not in words and len(levels) > 2) for j, levels in enumerate(self.levels)
        ]

        def columns(coded: np.ndarray) -> np.ndarray:
            blocks = []
            for j in range(coded.shape[1]):
                if j in counts:
                    code = np.rint((coded[:, j] + 1.0) / 2.0 * (counts[j] - 1)).astype(int)
                    contrasts = np.eye(counts[j])[:, :-1] - np.eye(counts[j])[:, -1:]
                    blocks.append(contrasts[code])
                else:
                    blocks.append(coded[:, [j]])
            parts = [np.ones((len(coded), 1)), *blocks]
            if name != "linear":
                for a in range(len(blocks)):
                    for b in range(a + 1, len(blocks)):
                        parts.append((blocks[a][:, :, None] * blocks[b][:, None, :]).reshape(len(coded), -1))
            if name == "quadratic":
                parts += [blocks[j] ** 2 for j, own in enumerate(squares) if own]
            return np.hstack(parts)

        return columns
