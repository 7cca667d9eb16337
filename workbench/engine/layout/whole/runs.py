"""What simulated designs tell a prediction: histories, their slopes, slopes of the largest values.

Choices of whole members and designs with fractions count alike, since both are densities.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import FAILURES, Evaluation, LayoutProblem

__all__ = ["Runs"]

Array = NDArray[np.float64]

_ROWS = 256  # of histories, at most, whose slopes are kept
_NUMBERS = 2e7  # that the slopes of all designs may take together


@dataclass(slots=True, kw_only=True)
class Runs:
    """Designs that were simulated.

    limit: how many there may be    shares: (members,) of each, 0 at the lower bound, 1 at the upper one
    histories: (cases, nodes)    peak_slopes: (cases, members), of the largest value of each case by shares
    rows: numbers of the rows (case x node) whose slopes are kept; none where a sweep back would be needed for
    each    row_slopes: (rows, members)
    """

    problem: LayoutProblem
    limit: int
    shares: list[Array] = field(default_factory=list)
    histories: list[Array] = field(default_factory=list)
    peak_slopes: list[Array] = field(default_factory=list)
    rows: NDArray[np.intp] | None = None
    row_slopes: list[Array] = field(default_factory=list)

    def add(self, density: Array, evaluation: Evaluation) -> tuple[Array, Array]:
        """Keep a design; the largest value of each case and its slopes (cases, members) by shares."""
        problem = self.problem
        width = problem.upper - problem.lower
        values = np.atleast_2d(np.asarray(evaluation.values, dtype=float))
        peaks = values.argmax(axis=1)
        cases = np.arange(len(values))
        if self.rows is None:
            self.rows = self._rows(values, evaluation)
        slopes = problem.checked_gradients(evaluation, cases * values.shape[1] + peaks) * width
        along = problem.checked_gradients(evaluation, self.rows) * width if len(self.rows) else slopes[:0]
        self.shares.append((density - problem.lower) / np.where(width > 0, width, 1.0))
        self.histories.append(values)
        self.peak_slopes.append(slopes)
        self.row_slopes.append(along)
        return values[cases, peaks], slopes

    def noting(self) -> "_Noting":
        """The problem's objective, which keeps what is asked of it here."""
        return _Noting(self)

    def _rows(self, values: Array, evaluation: Evaluation) -> NDArray[np.intp]:
        """Evenly over time, where slopes come with the run: a history carried forward, or no history."""
        cases, nodes = values.shape
        if nodes > 1 and evaluation.factors(np.array([0], dtype=np.intp)) is None:
            return np.zeros(0, dtype=np.intp)
        most = min(_ROWS, int(_NUMBERS / (self.problem.members * max(1, self.limit))))
        each = max(1, min(nodes, most // cases))
        places = np.unique(np.linspace(0, nodes - 1, each).round().astype(np.intp))
        return np.asarray((np.arange(cases)[:, None] * nodes + places).ravel())


class _Noting:
    def __init__(self, runs: Runs) -> None:
        self._runs, self._evaluate = runs, runs.problem.evaluate

    def __call__(self, density: Array) -> Evaluation:
        evaluation = self._evaluate(density)
        if np.isfinite(evaluation.values).all() and len(self._runs.shares) < self._runs.limit:
            try:
                self._runs.add(density, evaluation)
            except FAILURES:
                pass  # a design without slopes tells the prediction nothing
        return evaluation
