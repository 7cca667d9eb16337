"""What a minimax search found: its cycles with their bounds, the design, its worst scenario."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

__all__ = ["Cycle", "Minimax", "MinimaxStatus"]


class MinimaxStatus(Enum):
    """Why the search stopped."""

    CONVERGED = "lower and upper bound met within the tolerance"
    BUDGET = "the budget of runs was spent"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One cycle: bounds after `evaluations` runs. `lower` is the master's value on the Kriging (model-based),
    `upper` the worst true run at this cycle's design, `best` the lowest upper bound so far."""

    number: int
    evaluations: int
    lower: float
    upper: float
    best: float
    box: float
    design: Mapping[str, Any]
    scenario: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Minimax:
    """The design with the lowest confirmed worst case, its worst scenario, and all cycles."""

    design: Mapping[str, Any]
    scenario: Mapping[str, Any]
    value: float
    lower: float
    status: MinimaxStatus
    cycles: tuple[Cycle, ...]
    scenarios: tuple[Mapping[str, Any], ...]
    evaluations: int
    budget: int
    seed: int
    failures: int

    @property
    def gap(self) -> float:
        """Upper minus lower bound at the end; the lower bound is model-based."""
        return max(self.value - self.lower, 0.0)

    def to_dict(self) -> dict[str, Any]:
        """For a JSON document: bounds of every cycle and the scenarios, to begin another search with."""
        return {
            **asdict(self),
            "status": self.status.value,
            "gap": self.gap,
            "cycles": [asdict(cycle) for cycle in self.cycles],
            "scenarios": [dict(scenario) for scenario in self.scenarios],
        }
