"""Can more be gained than a robust loop says is left? Long searches over all the cases that it found.

From the layout returned and from two random moves of it, each search over every case that was found for any
layout; the best of the three is held against the loop's own layout over the same cases. It shares the engine
with the loop, not the cases of a round, its few evaluations, nor where that began.

`python -m studies.loop_claims 8400 4 3000 250 --further 100` prints it beside the other claims of four loops.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from studies.loop_rivals import Runs
from workbench.engine.layout.optimise import optimise_layout
from workbench.robust_layout.model import LayoutModel
from workbench.robust_layout.record import RobustLayout

__all__ = ["Left", "left_to_gain"]

Array = NDArray[np.float64]

MOVES, MOVED = 2, 0.3  # other starts, and by how much of itself a density moves in them


@dataclass(frozen=True, slots=True, kw_only=True)
class Left:
    """What is said to be left, None if nothing is, and what was gained: shares of the worst of all cases."""

    said: float | None
    gained: float

    @property
    def holds(self) -> bool:
        """Whether no more was gained than is said to be left."""
        return self.said is not None and self.gained <= self.said


def left_to_gain(model: LayoutModel, found: RobustLayout, runs: Runs, *, evaluations: int, seed: int) -> Left:
    """Search on from the layout of a loop with so many evaluations from each start."""
    rng, problem = np.random.default_rng([seed, 17]), model.problem(found.cases)
    density = found.layouts[found.robust]
    starts = [density, *(density * np.exp(MOVED * rng.standard_normal(density.shape)) for _ in range(MOVES))]
    best = found.bound
    for start in starts:
        searched = optimise_layout(
            replace(problem, start=problem.into_budgets(start.copy())), max_evaluations=evaluations,
            compare=False, probes=0, multi_start=False, scenarios="binding",
        )  # fmt: skip
        best = min(best, float(runs.values(searched.density, found.cases).max()))
    said = found.document.get("kkt")
    return Left(said=None if said is None else float(said), gained=1.0 - best / found.bound)
