"""The second look of a search whose gap has closed: runs where its own Kriging did not send them.

    second look    half inside the space, half near its corners, those combinations of words first that have
                   the fewest runs

A search ends where its Krigings hold nothing more for possible. They know no jump that no run has crossed and
nothing of what exists at one word only; a gap that rests on runs of their own choice held in four of five
such cases. Before it is over, a part of the runs left in the budget is made at random. A run that is worse
than all before, or that opens the gap again since the Krigings had missed it, begins the search anew, and
with it the look.

Points are drawn once, from a stream of their own: which of them are run depends on nothing but the seed, the
workers and the answers of the model.
"""

from dataclasses import dataclass, field

import numpy as np

from workbench.search.evidence.attack.strata import Strata
from workbench.search.proposals.known import Known
from workbench.search.runs.ledger import distinct
from workbench.space.streams import stream

__all__ = ["LOOK", "SecondLook"]

LOOK = "second look"  # what its runs are recorded as
MOST = 16  # silent runs in a row: with 95 % what they would have met holds less than a sixth of the space
SHARE = 0.5  # of the runs that were left when it began: as many stay to follow what was met
PORTION = 4  # runs between which the Kriging is asked whether it still holds, in whole batches
DRAWN = 20 * MOST  # points in store


@dataclass(slots=True, kw_only=True)
class SecondLook:
    """`silent`: runs in a row that told nothing new; `strata` and `points` (m, d) are those in store."""

    seed: int
    silent: int = 0
    strata: Strata | None = field(default=None, repr=False)
    points: np.ndarray | None = field(default=None, repr=False)

    def due(self, known: Known, *, left: int, workers: int = 1) -> np.ndarray:
        """The points (k, d) to run next with `left` runs to go; none when the look is over.

        Where runs fail, points that are likely to fail are left out.
        """
        most = min(MOST, int(SHARE * (left + self.silent)))
        size = min(most - self.silent, workers * max(round(PORTION / workers), 1))
        if size <= 0:
            return np.empty((0, known.where.dimension))
        if self.strata is None or self.points is None:
            rng = stream(self.seed, "second look")
            self.strata = Strata.of(known.where, rng=rng)
            self.points = self.strata.anywhere(DRAWN, rng)
        new = distinct(self.points, known.u)
        new = new[known.success.probability(known.where.features(new)) >= known.least_chance]
        return new[_by_fewest(self.strata.index(known.u), self.strata.index(new), size)]

    def made(self, runs: int, *, is_worse: bool) -> None:
        """So many of its runs were made; one that is worse than all before begins the look anew."""
        self.silent = 0 if is_worse else self.silent + runs

    def begin_anew(self) -> None:
        """The gap has opened again: what was counted says nothing of the Kriging that comes."""
        self.silent = 0


def _by_fewest(run: np.ndarray, new: np.ndarray, size: int) -> list[int]:
    """Places of up to `size` of the points in the strata `new` (m,), each the first of the stratum that has
    the fewest runs by then; `run` (n,) are the strata of those made, -1 of those in none.

    >>> _by_fewest(np.array([0, 0, 0, 1, -1]), np.array([0, 1, 2, 0, 1, 2]), 4)
    [2, 1, 5, 4]
    """
    counts = {int(s): int((run == s).sum()) for s in np.unique(new)}
    left = list(range(len(new)))
    chosen: list[int] = []
    while left and len(chosen) < size:
        best = min(left, key=lambda i: (counts[int(new[i])], i))
        counts[int(new[best])] += 1
        left.remove(best)
        chosen.append(best)
    return chosen
