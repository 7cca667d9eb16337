"""Keeping the books of an optimisation: history, best feasible design, budget of evaluations, progress."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import count_active
from ..formulation.problem import Evaluation, LayoutProblem
from .result import HistoryEntry

__all__ = ["FEASIBLE", "Cut", "Recorder"]

Array = NDArray[np.float64]

FEASIBLE = 1e-9  # relative violation of a budget that rounding may cause
_CUTS = 40  # linearised constraints remembered while no feasible design is known


@dataclass(frozen=True, slots=True, kw_only=True)
class Cut:
    """Further constraints (c,) and their gradients (c, members) at a design (members,)."""

    density: Array
    constraints: Array
    gradients: Array


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
        self.ends: list[float] = []  # best value of each of several searches, of the given start first
        self.best = np.inf
        self.best_density: Array | None = None
        self.best_evaluation: Evaluation | None = None
        self.nearest, self.nearest_density = np.inf, problem.start
        self.cuts: list[Cut] = []
        self.start_value = np.nan
        self.limited = False  # whether further constraints are limits of runs
        self.start_index = 0
        self.probes = 0  # runs without gradients that chose where to begin
        self.beside = 0.0  # evaluations' worth of runs of some scenarios, which have no place in the history

    @property
    def evaluations(self) -> int:
        """Evaluations so far, runs of some scenarios by their share."""
        return int(np.ceil(len(self.history) + self.beside))

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
            self.limited = bool(evaluation.limit_rows)
        off = self.infeasibility(density, evaluation)
        better = value < self.best and off <= FEASIBLE
        if off < self.nearest:
            self.nearest, self.nearest_density = off, density.copy()
        if evaluation.constraints.size and self.best_density is None:
            self.cuts.append(Cut(
                density=density.copy(), constraints=np.array(evaluation.constraints, dtype=float),
                gradients=np.array(evaluation.constraint_gradients, dtype=float),
            ))  # fmt: skip
            del self.cuts[:-_CUTS]
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
        self._keep(entry, density)
        return better

    def fail(self, density: Array, *, radius: float = np.nan) -> None:
        """Record a trial at which the model failed: an evaluation with the value inf, not accepted."""
        entry = HistoryEntry(
            evaluation=self.evaluations + 1, value=np.inf, best=self.best, active=0,
            budget=float(self.problem.usage(density).max(initial=0.0)), kkt=np.nan, radius=float(radius),
            start=self.start_index, accepted=False,
        )  # fmt: skip
        self._keep(entry, density)

    def _keep(self, entry: HistoryEntry, density: Array) -> None:
        self.history.append(entry)
        if self.keep:
            self.iterates.append(density.copy())
        if self.progress is not None:
            self.progress(entry, density)
