"""Choices that were evaluated: values, gradients by state, the best; nothing is simulated twice."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import FAILURES
from .choices import Choices, On
from .runs import Runs

__all__ = ["Evaluated"]

Array = NDArray[np.float64]


@dataclass(slots=True, kw_only=True)
class Evaluated:
    """limit: of evaluations    on: choices in their order    values: inf where the model failed or a further
    constraint is not met    slopes: per choice (cases, states), the change of each case's largest row for a
    state that is put on or taken off, to first order, or None    runs: what a prediction may learn from,
    designs with fractions included.
    """

    choices: Choices
    limit: int
    runs: Runs
    progress: Callable[[int, float, float], None] | None = None
    on: list[On] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    tops: list[Array] = field(default_factory=list)
    slopes: list[Array | None] = field(default_factory=list)
    _places: dict[bytes, int] = field(default_factory=dict)

    def __contains__(self, on: On) -> bool:
        return on.tobytes() in self._places

    @property
    def left(self) -> int:
        """Evaluations left."""
        return self.limit - len(self.values)

    @property
    def best(self) -> int:
        """The place of the smallest value."""
        return int(np.argmin(self.values))

    def look(self, on: On) -> float:
        """The value of a choice; simulated when it is new."""
        key = on.tobytes()
        if key not in self._places:
            self._places[key] = len(self.values)
            self._simulate(on)
        return self.values[self._places[key]]

    def _simulate(self, on: On) -> None:
        problem = self.choices.problem
        value, tops, slopes = np.inf, np.zeros(0), None
        try:
            density = self.choices.density(on)
            evaluation = problem.checked(density)
            if np.max(evaluation.constraints, initial=0.0) <= _MET:
                tops, by_share = self.runs.add(density, evaluation)
                slopes = by_share @ self.choices.table.T
                value = float(tops.max())
        except FAILURES:
            value, slopes = np.inf, None
        self.on.append(on.copy())
        self.values.append(value)
        self.tops.append(tops)
        self.slopes.append(slopes)
        if self.progress is not None:
            self.progress(len(self.values), value, min(self.values))


_MET = 1e-9
