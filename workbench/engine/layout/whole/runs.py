"""What simulated designs tell a prediction: histories, their slopes, slopes of the largest values.

Choices of whole members and designs with fractions count alike, since both are densities.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import FAILURES, Evaluation, LayoutProblem

__all__ = ["Runs"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_ROWS = 256  # of all histories of a design, at most
_NUMBERS = 2e7  # that the slopes of all designs may take together


@dataclass(slots=True, kw_only=True)
class Runs:
    """Designs that were simulated.

    limit: how many there may be    shares: (members,) of each, 0 at the lower bound, 1 at the upper one
    histories: (cases, blocks), the largest value in each block of time, a node where there are few enough
    peak_slopes: (cases, members), of the largest value of each case by shares
    slopes: (cases x blocks, members) of the histories; none where a sweep back would be needed for each
    """

    problem: LayoutProblem
    limit: int
    shares: list[Array] = field(default_factory=list)
    histories: list[Array] = field(default_factory=list)
    peak_slopes: list[Array] = field(default_factory=list)
    slopes: list[Array] | None = None
    _blocks: Rows | None = None  # the first node of each

    def add(self, density: Array, evaluation: Evaluation) -> tuple[Array, Array]:
        """Keep a design; the largest value of each case and its slopes (cases, members) by shares."""
        problem = self.problem
        width = problem.upper - problem.lower
        values = np.atleast_2d(np.asarray(evaluation.values, dtype=float))
        first = np.arange(len(values)) * values.shape[1]
        peaks = first + values.argmax(axis=1)
        if self._blocks is None:
            self._prepare(values, evaluation)
        blocks = self._blocks
        assert blocks is not None
        by_peak = problem.checked_gradients(evaluation, peaks) * width
        if self.slopes is not None:
            ends = np.append(blocks[1:], values.shape[1])
            places = [values[:, i:j].argmax(axis=1) + i for i, j in zip(blocks, ends, strict=True)]
            rows = (first[:, None] + np.array(places).T).ravel()
            self.slopes.append(problem.checked_gradients(evaluation, rows) * width)
        self.shares.append((density - problem.lower) / np.where(width > 0, width, 1.0))
        self.histories.append(np.maximum.reduceat(values, blocks, axis=1))
        self.peak_slopes.append(by_peak)
        return values.ravel()[peaks], by_peak

    def _prepare(self, values: Array, evaluation: Evaluation) -> None:
        """Slopes are kept where they come with the run: a history carried forward, or no history."""
        cases, nodes = values.shape
        carried = nodes == 1 or evaluation.factors(np.array([0], dtype=np.intp)) is not None
        most = int(_NUMBERS / (self.problem.members * max(1, self.limit))) if carried else _ROWS
        each = max(1, min(nodes, min(_ROWS, most) // cases))
        self._blocks = np.linspace(0, nodes, each, endpoint=False).astype(np.intp)
        self.slopes = [] if carried else None

    def noting(self) -> "_Noting":
        """The problem's objective, which keeps what is asked of it here."""
        return _Noting(self)


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
