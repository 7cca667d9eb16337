"""Where runs over design and uncertainty fail: counts for every level of every unordered parameter.

A level is singled out where its failures are more than chance would put there: K of N runs failed, k of the n
at this level, and the chance of k or more is that of drawing n balls of which K in N are black (one-sided
exact test, Fisher 1922), below `CHANCE` shared among all levels. The runs are placed by a search and no
random sample, so the counts say where failures sit and are no estimate of how likely they are.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from scipy.stats import hypergeom

from workbench.space.box import Space

__all__ = ["LevelFailures", "failure_map", "failure_places"]

CHANCE = 0.01
UNORDERED = ("categorical", "binary")


@dataclass(frozen=True, slots=True, kw_only=True)
class LevelFailures:
    """`failed` of `runs` at one level of a parameter of the `side` design or uncertainty gave no value.

    `elsewhere` is (failed, runs) at its other levels. `is_singled_out`: it fails more often than they do,
    beyond chance.
    """

    side: str
    parameter: str
    level: Any
    runs: int
    failed: int
    elsewhere: tuple[int, int]
    is_singled_out: bool

    @property
    def words(self) -> str:
        """The level with its counts."""
        lost, others = self.elsewhere
        count = f"all {self.runs}" if self.failed == self.runs else f"{self.failed} of {self.runs}"
        return f"{self.parameter}={self.level} ({count} failed, {lost} of {others} elsewhere)"


def failure_map(
    rows: Sequence[Mapping[str, Any]], failed: Sequence[bool], *, design: Space, uncertainty: Space
) -> tuple[LevelFailures, ...]:
    """The failures of runs at `rows` by level, those of the design first; nothing where no run failed."""
    if not any(failed):
        return ()
    places = [
        (side, p.name, level)
        for side, space in (("design", design), ("uncertainty", uncertainty))
        for p in space.parameters
        if p.kind in UNORDERED
        for level in p.levels or (0, 1)
    ]
    lost, all_lost = [row for row, is_lost in zip(rows, failed, strict=True) if is_lost], sum(failed)
    found = []
    for side, name, level in places:
        n = sum(row[name] == level for row in rows)
        k = sum(row[name] == level for row in lost)
        chance = float(hypergeom.sf(k - 1, len(rows), all_lost, n))
        found.append(
            LevelFailures(
                side=side,
                parameter=name,
                level=level,
                runs=n,
                failed=k,
                elsewhere=(all_lost - k, len(rows) - n),
                is_singled_out=k > 0 and chance < CHANCE / len(places),
            )
        )
    return tuple(found)


def failure_places(levels: Sequence[LevelFailures]) -> str:
    """A sentence on the levels that are singled out, empty where none is."""
    named = [level.words for level in levels if level.is_singled_out]
    return f"Runs fail more often at {'; '.join(named)}." if named else ""
