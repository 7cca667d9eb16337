"""Which corners of the space a search runs before it ends, and when.

Responses of engineering models are worst in a corner more often than not, and a Kriging of runs that crowd
around another peak may hold a corner for settled that nobody ran. Where all corners together are at most a
quarter of the budget beyond the start, that many runs are kept back for those that the search did not visit;
they are made just before its last, refining runs. Three quarters of the budget is what all but a few searches
need (`docs/explanation/worst-case-gallery.md`: 3 of 170 reached the worst case later). A search that ends
early runs all corners when they fit into what is left, else none: a few of a thousand corners prove little.
"""

from dataclasses import dataclass

import numpy as np

from workbench.search.runs.ledger import Ledger, distinct

__all__ = ["CornerPlan"]

KEPT_BACK = 0.25  # of the budget beyond the start: the most that may be kept back for corners
FINISHING_RUNS = 3  # of the budget, which refine the worst run: they come after the corners


@dataclass(frozen=True, slots=True, kw_only=True)
class CornerPlan:
    """`corners` (m, d) that the constraints allow; `reserved` when runs are kept back for all of them."""

    corners: np.ndarray
    reserved: bool

    @classmethod
    def of(cls, ledger: Ledger, *, budget: int) -> "CornerPlan":
        """The plan of a search with `budget` runs beyond its start."""
        corners = ledger.where.corners()
        if corners is None:
            corners = np.empty((0, ledger.where.dimension))
        corners = corners[ledger.where.allowed(corners)]
        return cls(corners=corners, reserved=0 < len(corners) <= KEPT_BACK * budget)

    def left(self, ledger: Ledger) -> np.ndarray:
        """Corners (k, d) that no run was made at, failed ones included."""
        return distinct(self.corners, ledger.u)

    def room(self, ledger: Ledger, *, runs: int) -> int:
        """How many of the `runs` left a search may spend before it must turn to the corners kept back."""
        kept = len(self.left(ledger)) if self.reserved else 0
        return runs - kept - FINISHING_RUNS if kept else runs

    def due(self, ledger: Ledger, *, most: int) -> np.ndarray:
        """The corners to run with `most` runs to spare: all that are left, or none where they do not fit."""
        left = self.left(ledger)
        return left if len(left) <= most else left[:0]
