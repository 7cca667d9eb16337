"""The true runs of an adversary: every case once, in the order made, within its budget."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from workbench.models.evaluator import Evaluator, Outcome, Reading
from workbench.search.runs.slopes import unit_slope
from workbench.search.runs.unit_space import SearchSpace

__all__ = ["Trials"]


@dataclass(slots=True, kw_only=True)
class Trials:
    """Runs so far. `values` are signed, large is bad, minus infinity where a run gave none.

    `response`: the name of the searched one, for its gradients; None where there is one only, or where the
    reading combines several, which have no gradient.
    """

    evaluate: Evaluator
    where: SearchSpace
    read: Reading
    response: str | None
    sign: float
    budget: int
    outcomes: list[Outcome] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)
    kinds: list[str] = field(default_factory=list)
    values: list[float] = field(default_factory=list)
    _places: dict[bytes, int] = field(default_factory=dict)

    @property
    def left(self) -> int:
        """Runs that may still be made."""
        return self.budget - len(self.outcomes)

    def known(self, point: np.ndarray) -> float | None:
        """The signed value of a case that was run or that a constraint refuses; None when it may be run."""
        place = self._places.get(_address(point))
        if place is not None:
            return self.values[place]
        return None if self.where.allowed(point[None])[0] else -np.inf

    def run(self, points: Sequence[np.ndarray] | np.ndarray, kinds: Sequence[str]) -> list[float]:
        """The signed values of admissible cases, those of one batch; a case already run is not run again.

        The batch is cut where the budget ends: the values of the cases that fit come back.
        """
        values: list[float] = []
        fresh: dict[bytes, int] = {}
        for i, point in enumerate(points):
            address = _address(point)
            if address not in self._places and address not in fresh and len(fresh) < self.left:
                fresh[address] = i
        if fresh:
            chosen = list(fresh.values())
            rows = self.where.rows(np.array([points[i] for i in chosen]))
            for i, outcome in zip(chosen, self.evaluate(rows, purpose="attack"), strict=True):
                self._keep(points[i], kinds[i], outcome)
        for point in points:
            place = self._places.get(_address(point))
            if place is None:
                break
            values.append(self.values[place])
        return values

    def slope(self, point: np.ndarray) -> np.ndarray | None:
        """dv/du (d,) of the case, in the unit cube; None where the run brought none for every continuous
        coordinate."""
        place = self._places.get(_address(point))
        if place is None or not self.outcomes[place].gradients:
            return None
        outcome = self.outcomes[place]
        name = self.response if self.response is not None else next(iter(outcome.outputs), None)
        slope = unit_slope(self.where, point, outcome.gradients.get(name or "", {}))
        return None if slope is None else self.sign * slope

    def _keep(self, point: np.ndarray, kind: str, outcome: Outcome) -> None:
        value = self.sign * self.read(outcome.outputs) if outcome.status == "ok" else -np.inf
        self._places[_address(point)] = len(self.outcomes)
        self.outcomes.append(outcome)
        self.points.append(point)
        self.kinds.append(kind)
        self.values.append(value if np.isfinite(value) else -np.inf)


def _address(point: np.ndarray) -> bytes:
    return np.round(point, 12).tobytes()
