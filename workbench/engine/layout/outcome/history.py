"""Keeping the books of an optimisation: history, best feasible design, budget of evaluations, progress."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import count_active
from ..formulation.problem import Evaluation, LayoutProblem
from .result import HistoryEntry

__all__ = ["FEASIBLE", "Recorder"]

Array = NDArray[np.float64]

FEASIBLE = 1e-9  # relative violation of a budget that rounding may cause


class Recorder:
    """Collects every evaluation; the best feasible design never gets worse.

    progress: called with the history entry and the density after each evaluation (to print or to save).
    keep: also keep every iterate.
    """

    def __init__(
        self,
        problem: LayoutProblem,
        *,
        progress: Callable[[HistoryEntry, Array], None] | None = None,
        keep: bool = False,
    ) -> None:
        self.problem, self.progress, self.keep = problem, progress, keep
        self.history: list[HistoryEntry] = []
        self.iterates: list[Array] = []
        self.optima: list[float] = []
        self.best = np.inf
        self.best_density: Array | None = None
        self.best_evaluation: Evaluation | None = None
        self.start_value = np.nan
        self.start_index = 0

    @property
    def evaluations(self) -> int:
        """Evaluations so far."""
        return len(self.history)

    def infeasibility(self, density: Array, evaluation: Evaluation) -> float:
        """Largest violation of a budget (relative) or of a further constraint."""
        return max(self.problem.excess(density), float(np.max(evaluation.constraints, initial=0.0)))

    def add(
        self,
        density: Array,
        evaluation: Evaluation,
        *,
        kkt: float = np.nan,
        radius: float = np.nan,
        accepted: bool = True,
    ) -> bool:
        """Record an evaluation; True when it is the best feasible one so far."""
        values = np.atleast_2d(evaluation.values)
        value = float(values.max())
        if not self.history:
            self.start_value = value
        better = value < self.best and self.infeasibility(density, evaluation) <= FEASIBLE
        if better:
            self.best, self.best_density, self.best_evaluation = value, density.copy(), evaluation
        entry = HistoryEntry(
            evaluation=self.evaluations + 1,
            value=value,
            best=self.best,
            active=count_active(values),
            budget=float(self.problem.usage(density).max(initial=0.0)),
            kkt=float(kkt),
            radius=float(radius),
            start=self.start_index,
            accepted=accepted,
        )
        self.history.append(entry)
        if self.keep:
            self.iterates.append(density.copy())
        if self.progress is not None:
            self.progress(entry, density)
        return better
