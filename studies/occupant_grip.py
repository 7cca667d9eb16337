"""How the peak deviation depends on the grip strength: all 51 grid points, and an adaptive search.

The occupant holds on with one hand while the vehicle brakes hard; nothing else restrains him. Where the grip
strength decides lies inside its range: below it he leaves, above it he stays. With both hands it decides as
well, later: his arms fold until the elbows reach their stops, 0.8 s after the brakes, and the stiffened arms
push weak hands off the grips.

    python -m studies.occupant_grip
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from studies.occupant_braking import LEFT, NOMINAL, braking_occupant
from workbench.search.worst_case import WorstCase, worst_case
from workbench.space.box import Space
from workbench.space.parameter import Parameter

__all__ = ["GRIP", "GripProfile", "profile", "search"]

GRIP = Parameter("grip", lower=350, upper=700, step=7, unit="N")
CASE: Mapping[str, Any] = {**NOMINAL, "hands": "one", "deceleration": 8.0, "mass": 85.0}
FLAT = 0.01  # of the largest value: a profile that varies less has no worst point


@dataclass(frozen=True, slots=True, kw_only=True)
class GripProfile:
    """Peak deviation at every grid point, m, and what it says."""

    grip: np.ndarray
    deviation: np.ndarray

    @property
    def is_flat(self) -> bool:
        """Whether the grip strength hardly matters."""
        return bool(np.ptp(self.deviation) <= FLAT * self.deviation.max())

    @property
    def threshold(self) -> float | None:
        """The weakest grip that holds, N; None when all or none do."""
        held = self.deviation < LEFT
        return float(self.grip[held.argmax()]) if held.any() and not held.all() else None


def profile(case: Mapping[str, Any] = CASE) -> GripProfile:
    """The truth: a run at each of the 51 grid points."""
    levels = GRIP.unit_levels
    assert levels is not None
    grip = GRIP.physical(levels)
    values = [braking_occupant(**{**case, "grip": float(g)})["peak_deviation"] for g in grip]
    return GripProfile(grip=grip, deviation=np.array(values))


def search(case: Mapping[str, Any] = CASE, *, budget: int = 15, seed: int = 0) -> WorstCase:
    """The worst grip strength in a few runs."""
    return worst_case(
        lambda grip: braking_occupant(**{**case, "grip": grip})["peak_deviation"], Space((GRIP,)),
        budget=budget, seed=seed,
    )  # fmt: skip


if __name__ == "__main__":
    for hands, deceleration in (("both", 7.0), ("both", 9.0), ("one", 8.0), ("none", 8.0)):
        case = {**CASE, "hands": hands, "deceleration": deceleration}
        truth, found = profile(case), search(case)
        k = int(truth.deviation.argmax())
        held = "flat" if truth.is_flat else f"holds from {truth.threshold} N"
        print(
            f"{hands:5s} hands, {deceleration} m/s2: worst {truth.deviation[k]:.4f} m "
            f"at {truth.grip[k]:.0f} N, 51 runs ({held}); "
            f"search {found.value:.4f} m at {found.parameters['grip']:.0f} N in {found.evaluations} runs"
        )
