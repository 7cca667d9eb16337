"""Limits on what happens along the runs: peaks over time and scenarios of any quantity, injury, clearance.

    c = (G - b)/|b| <= 0   for "at most b",      c = (b - G)/|b| <= 0   for "at least b"

A limit on the maximum (or minimum) of a quantity has a row for every local peak near the limit, as the
objective has: its peaks compete and move in time as much as those of the objective.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...integration.kinds import AnyTrajectory
from ...objectives.reductions import Maximum, Minimum, Objective
from .problem import InvalidLayout, LimitRow

__all__ = ["Limit", "LimitedRow", "limited_rows"]

Array = NDArray[np.float64]

_NEAR = 0.5  # rows of local peaks that lie this far below the highest one, in the unit of the limit
_MOST = 12  # rows of a limit in a scenario


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """A bound on an objective of every scenario's run.

    name: for messages and prices.  objective: `Maximum(quantity=...)`, `Minimum`, `HeadInjury`, `ClipLevel`.
    at_most, at_least: one of them, in `unit`.  scale: what a violation is measured in, |bound| if None.

    Raises InvalidLayout unless there is one bound, finite, and a scale above zero.

    >>> from workbench.engine import Maximum, MemberForce
    >>> pull = Maximum(quantity=MemberForce(member=0))
    >>> Limit(name="belt force", objective=pull, at_most=6e3, unit="N").bound
    6000.0
    """

    name: str
    objective: Objective
    at_most: float | None = None
    at_least: float | None = None
    unit: str = "1"
    scale: float | None = None

    def __post_init__(self) -> None:
        if (self.at_most is None) == (self.at_least is None):
            raise InvalidLayout(f"limit '{self.name}' needs either at_most or at_least")
        if not np.isfinite(self.bound):
            raise InvalidLayout(f"limit '{self.name}' needs a finite bound, got {self.bound}")
        if not self.size > 0.0:
            raise InvalidLayout(f"limit '{self.name}' needs scale > 0 where its bound is 0, got {self.scale}")

    @property
    def bound(self) -> float:
        """The number that is not to be passed."""
        found = self.at_least if self.at_most is None else self.at_most
        assert found is not None
        return float(found)

    @property
    def size(self) -> float:
        """What a violation is measured in."""
        return abs(self.bound) if self.scale is None else float(self.scale)

    @property
    def sign(self) -> float:
        """+1 for an upper, -1 for a lower bound."""
        return 1.0 if self.at_least is None else -1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitedRow:
    """One row of a limit in a run: c, what it is differentiated by, and where it stands."""

    value: float
    objective: Any  # an `Objective`, a single peak of one for maxima and minima
    slope: float  # dc/dG
    row: LimitRow


def limited_rows(limits: Sequence[Limit], trajectory: AnyTrajectory, scenario: int) -> list[LimitedRow]:
    """The rows of all limits in one run, at least one of each; those of a limit in the order of time."""
    rows = []
    for number, limit in enumerate(limits):
        slope = limit.sign / limit.size
        found: list[tuple[float, float, Any]]
        if isinstance(limit.objective, Maximum | Minimum):
            peaks = limit.objective.peaks(trajectory)
            found = [(peak.height, peak.time, peak) for peak in peaks]
        else:
            found = [(float(limit.objective.value(trajectory)), np.nan, limit.objective)]
        scaled = [(slope * (height - limit.bound), height, time, what) for height, time, what in found]
        scaled.sort(key=lambda one: -one[0])
        near = [one for one in scaled[:_MOST] if one[0] >= scaled[0][0] - _NEAR]
        for value, height, time, what in sorted(near, key=lambda one: one[2]):
            row = LimitRow(
                limit=number, name=limit.name, scenario=scenario, time=time, height=height, bound=limit.bound,
                size=limit.size, unit=limit.unit, upper=limit.sign > 0,
            )  # fmt: skip
            rows.append(LimitedRow(value=value, objective=what, slope=slope, row=row))
    return rows
