"""One search of the min-max master: trust-region steps on rows for every peak of every scenario.

One step minimises the largest of the second-order rows (Gauss-Newton factors where the objective has them,
else what rows of histories missed at designs visited before, `secant_rows.py`)
within the trust region and the budgets (`quadratic.py`), simulates, and compares what it got with what the
model promised. Rows are the local peaks and nodes around them (`peaks.py`); rows that the step would raise
above the bound are added and the step is solved again, so that no peak appears unannounced. Where the caller
allows runs without gradients, they correct the steps.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import local_peaks, neighbours, rows_with_neighbours
from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import Recorder
from ..outcome.optimality import linear_promise
from .limited import LimitPenalty, limited_bound
from .probing import values_alone
from .quadratic import quadratic_bound
from .secant_rows import VisitedDesigns

__all__ = ["CORRECTIONS", "RADIUS", "TrustRegionRun", "on_bounds"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

RADIUS = 0.3  # of the trust region at first, in units of the bounds' width
CORRECTIONS = 6  # of one step, by runs without gradients
_LARGEST, _SMALLEST = 1.0, 1e-5  # of the trust region
_LOW_PEAK = 0.5  # peaks below this share of the largest get no row until a step would raise them
_MODELS = 12  # solved for one step while rows are added or the penalty is raised
_REPAIR_RADIUS = 0.05  # at least, of a step back inside the limits
_KEPT = 0.9  # share of the promise that needs no correction
_WORTH = 0.1  # share of the promise that another correction must bring
_ROUNDING = 1e-7  # of the bounds' width: what an interior step leaves of a member that it does not want


@dataclass(slots=True, kw_only=True)
class TrustRegionRun:
    """One local search; `step` goes on where it stopped.

    most_probes: of the recorder, up to which steps may be corrected by runs without gradients.
    Read: density, value, radius, promise (improvement promised by the last model), finished, weights and
    prices (multipliers of the last step).
    """

    problem: LayoutProblem
    recorder: Recorder
    density: Array
    evaluation: Evaluation
    tolerance: float
    radius: float = RADIUS
    index: int = 0
    steps: int = 0
    promise: float = np.inf
    finished: bool = False
    values_seen: list[float] = field(default_factory=list)
    most_probes: int = 0
    penalty: LimitPenalty = field(default_factory=LimitPenalty)
    visited: VisitedDesigns = field(default_factory=VisitedDesigns)
    _slopes: tuple[Evaluation | None, Rows, Array] = (None, np.zeros(0, dtype=np.intp), np.zeros((0, 0)))

    def __post_init__(self) -> None:
        self.visited.add(self.density, np.atleast_2d(self.evaluation.values))

    @property
    def value(self) -> float:
        """The largest row at the present density, with the penalty of limits that are not met."""
        return self.penalty.merit(self.evaluation)

    @property
    def limited(self) -> bool:
        """Whether there are limits beside the rows."""
        return self.evaluation.constraints.size > 0

    def step(self) -> None:
        """One model step and one evaluation."""
        problem, values = self.problem, np.atleast_2d(self.evaluation.values)
        found = self._model_step(values)
        top = self.value
        self.promise = top - found.predicted
        if self.promise <= self.tolerance * abs(float(values.max())):
            if self.limited and self.penalty.tightened():
                self.steps += 1
                return
            self.finished = True
            return
        trial = on_bounds(problem, self.density + self._corrected(values, found).move)
        evaluation = problem.tried(trial)
        if evaluation is None:
            self.recorder.start_index = self.index
            self.recorder.fail(trial, radius=self.radius)
            self.steps += 1
            self.radius *= 0.2
            self.finished = self.radius < _SMALLEST
            return
        self.visited.add(trial, np.atleast_2d(evaluation.values))
        ratio = (top - self.penalty.merit(evaluation)) / self.promise
        if self.limited:
            self.penalty.learn(trial - self.density, self.evaluation, evaluation)
        self.recorder.start_index = self.index
        accepted = ratio > 1e-4
        self.recorder.add(trial, evaluation, kkt=found.kkt, radius=self.radius, accepted=accepted)
        self.steps += 1
        if accepted:
            self.density, self.evaluation = trial, evaluation
            self.penalty.keep_inside(evaluation, self.radius)
        if ratio > 0.75:
            self.radius = min(2 * self.radius, _LARGEST)
        elif ratio < 0.25:
            self.radius *= 0.4 if ratio > -2 else 0.2
        self.values_seen.append(self.value)
        self.finished = self.radius < _SMALLEST

    def come_inside(self) -> None:
        """One step that aims well inside the limits which the present design breaks."""
        self.penalty.margin = 3.0 * self.penalty.violation(self.evaluation)
        self.radius = max(self.radius, _REPAIR_RADIUS)
        self.step()

    def _corrected(self, values: Array, found: "_ModelStep") -> "_ModelStep":
        """Of this step and of steps by corrected models the one whose run is the best.

        A run without gradients shows by how much the history after a step differs from the model's. With
        the difference added to all rows the model is solved again: the gradients stay those of the present
        design, the curvature that they lack is in the values. Steps along a bent valley become longer.
        """
        best, least, before = found, np.inf, np.inf
        top = float(values.max())
        promise = top - found.predicted
        for _ in range(CORRECTIONS):
            if self.limited or found.history is None or self.recorder.probes >= self.most_probes:
                break
            trial = on_bounds(self.problem, self.density + found.move)
            seen = values_alone(self.problem, trial)
            self.recorder.probes += 1
            if seen is None:
                break
            value = float(seen.max())
            if value < least:
                best, least = found, value
            if top - value > _KEPT * promise or before - value < _WORTH * promise:
                break
            before = value
            found = self._model_step(values, found.shift + seen - found.history)
            if least - found.predicted < _WORTH * promise:
                break
        return best

    def _gradients(self, rows: Rows) -> Array:
        """Gradients of rows at the present design, none of them made twice.

        A step that was refused is followed by another model of the same rows, whose slopes take sweeps
        backwards through every run.
        """
        known, there, table = self._slopes
        if known is not self.evaluation:
            there, table = there[:0], np.zeros((0, self.problem.members))
        new = np.setdiff1d(rows, there)
        if new.size:
            table = np.vstack([table, self.problem.checked_gradients(self.evaluation, new)])
            there = np.r_[there, new]
            order = np.argsort(there)
            there, table = there[order], table[order]
        self._slopes = self.evaluation, there, table
        return np.asarray(table[np.searchsorted(there, rows)])

    def _model_step(self, values: Array, shift: Array | float = 0.0) -> "_ModelStep":
        """The step that the model at the present design promises most of; shift (scenarios, nodes): added."""
        problem, density, values = self.problem, self.density, values + shift
        width = self.radius * (problem.upper - problem.lower)
        lo = np.minimum(np.maximum(problem.lower - density, -width), 0.0)
        hi = np.maximum(np.minimum(problem.upper - density, width), 0.0)
        room = np.maximum(problem.limits - problem.costs @ density, 0.0)
        top = float(values.max())
        unit = max(abs(top), 1e-300)
        peaks = local_peaks(values, above=top - _LOW_PEAK * unit)
        rows = rows_with_neighbours(values, peaks, neighbours(values.shape[1]))
        history = values.shape[1] > 1 and not self.limited
        straight = history and self.evaluation.factors(rows[:1]) is None
        near = self.visited.near(density, width) if straight else []
        rows = np.union1d(rows, self.visited.peaks(near, above=top))
        for _ in range(_MODELS):
            gradients = self._gradients(rows)
            factors = self.evaluation.factors(rows)
            if near:
                factors = self.visited.factors(near, density, values, rows, gradients)
            flat = values.ravel()[rows]
            arrays = (
                flat / unit, gradients / unit, None if factors is None else factors / np.sqrt(unit),
                problem.costs, room, lo, hi,
            )  # fmt: skip
            slack, prices = 0.0, np.zeros(0)
            if self.limited:
                self.penalty.begin(unit)
                found = limited_bound(
                    *arrays, penalty=self.penalty, limits=self.evaluation.constraints,
                    limit_gradients=self.evaluation.constraint_gradients, unit=unit,
                    tolerance=min(1e-8, 0.01 * self.tolerance),
                )  # fmt: skip
                solved, slack, prices = found.solved, found.slack, found.prices
                if self.penalty.follow(prices, slack, unit):
                    continue
            else:
                solved = quadratic_bound(*arrays, tolerance=min(1e-8, 0.01 * self.tolerance))
            change = gradients @ solved.step
            if factors is not None:
                change = change + 0.5 * ((factors @ solved.step) ** 2).sum(axis=1)
            predicted = float((flat + change).max())
            beside = self.penalty.curved(solved.step) + self.penalty.rho * slack
            model = self.evaluation.model(solved.step)
            if model is None:
                break
            model = model + shift
            raised = np.setdiff1d(local_peaks(model, above=predicted + 1e-5 * unit), rows)
            predicted = float(model.max())
            if raised.size == 0:
                break
            rows = np.union1d(rows, raised)
        weights = solved.row_multipliers / solved.row_multipliers.sum()
        promise = linear_promise(
            problem,
            density,
            weights @ gradients + (prices @ self.evaluation.constraint_gradients if self.limited else 0.0),
            solved.budget_multipliers * unit,
            top - float(weights @ flat) - float(prices @ np.minimum(self.evaluation.constraints, 0.0)),
        )
        return _ModelStep(
            move=solved.step, predicted=predicted + beside, kkt=promise / unit, history=model, shift=shift
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _ModelStep:
    """A step (members,), what its model predicts for the largest row, the improvement that is left to first
    order, the history after the step (scenarios, nodes) or None, and what was added to the model of it."""

    move: Array
    predicted: float
    kkt: float
    history: Array | None
    shift: Array | float


def on_bounds(problem: LayoutProblem, density: Array) -> Array:
    """A design within its budgets, densities that lie on their lower bounds but for rounding exactly there.

    A member of no density at all costs no time in a run.
    """
    found = problem.into_budgets(density)
    low = found - problem.lower <= _ROUNDING * (problem.upper - problem.lower)
    return np.where(low, problem.lower, found)
