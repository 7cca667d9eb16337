"""What the robust loop is asked for, its rounds, and what it found."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import NotEnoughRuns
from workbench.robust_layout.oracle import Found

__all__ = ["LoopSettings", "RobustLayout", "Round", "largest", "loop_status"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """How much the loop may spend, and when it is closed.

    evaluations: of the optimiser per round.    rounds: at most.
    budget: runs of each search, one for every combination of words.    corners: random ones looked at before.
    tolerance: relative excess of the worst case over the bound that is accepted.
    """

    evaluations: int = 30
    budget: int = 60
    corners: int = 100
    rounds: int = 6
    tolerance: float = 0.02
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """bound: worst over the cases known at its start; worst: what the search found on the chosen layout."""

    number: int
    cases: int
    layout: str
    bound: float
    worst: float
    case: Case
    gap: float
    runs: int
    optimiser: str
    note: str = ""


@dataclass(slots=True, kw_only=True)
class RobustLayout:
    """What the loop found. `layouts`: name -> densities; `worst`: name -> the worst true run known."""

    robust: str
    certified: bool
    status: str
    layouts: dict[str, Array]
    worst: dict[str, Found]
    cases: list[dict[str, Any]]
    values: dict[str, list[float | None]]  # name -> value in every case
    rounds: list[Round]
    failures: list[str]
    document: Mapping[str, Any] = field(default_factory=dict)  # of the robust layout, as `layout.json`

    @property
    def bound(self) -> float:
        """The best layout's worst over all cases found."""
        return largest(self.values[self.robust])


def loop_status(last: Round, worst: float, *, certified: bool, held: bool) -> str:
    """Whether the loop is closed, in a sentence.

    Args:
        worst: of the best layout over all cases found.
        certified: the last round's search did not break its bound.    held: nor did a case of another layout.
    """
    if not certified:
        broken = _above(last.worst, last.bound, 3)
        return f"The rounds were spent with the worst case {broken} above the bound."
    if held:
        above = _above(last.worst, last.bound, 2)
        return f"The search found nothing more than {above} above the bound: the loop is closed."
    above = _above(worst, last.bound, 3)
    return f"The worst case of another layout lies {above} above the bound: the loop is not closed."


def _above(worst: float, bound: float, digits: int) -> str:
    """How far a worst case lies above a bound, as a share of the bound where it is not zero."""
    above = max(0.0, worst - bound)
    return f"{100 * above / abs(bound):.{digits}g} %" if bound else f"{above:.{digits}g}"


def largest(values: Sequence[float | None]) -> float:
    """The worst of the values there are; a layout that runs in no case is as bad as can be."""
    there = [value for value in values if value is not None]
    if not there:
        raise NotEnoughRuns("a layout gave a value in none of the cases; look at `holdfast failures`")
    return max(there)
