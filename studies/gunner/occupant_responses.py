"""What a run says of the gunner: objectives with exact slopes, and the numbers read off them.

Places are those of the whole-body mass centre in the vehicle's frame, as (8.33) to (8.37) take it: g1 is the
squared distance from its start, g2 its height above the vehicle's mass centre at rest, 0.77 m. A smooth
response stands in for each maximum: it has no corner where another peak becomes the highest, so a Kriging
follows it.
"""

from dataclasses import dataclass
from math import sqrt
from typing import Any

import numpy as np

from workbench.engine import (
    ChannelFilter,
    ClipLevel,
    Coordinate,
    Deviation,
    Filtered,
    FirstCrossing,
    HeadInjury,
    LogSumExp,
    Maximum,
    Minimum,
    PNorm,
    PointAcceleration,
    RelativeSpeed,
    RideComfort,
    State,
    TreeSystem,
    TreeTrajectory,
)

from .cabin.contacts import SHELF
from .cabin.facing import HATCH
from .figure import FIGURE

__all__ = ["REFERENCE_HEIGHT", "RING_HEIGHT", "Ejection", "objectives", "responses_of"]

Array = np.ndarray[Any, Any]

REFERENCE_HEIGHT = 0.77  # m: mass centre of the vehicle, from which g2 counts
RING_HEIGHT = 1.959  # m: the top layer of Table C.1
FREE_RADIUS = 0.40  # m: of the hatch
CLEAR = 0.25  # m above the ring: out, wherever
LOST = 0.5  # of the damage of a grip or the seat
SHARPNESS = 200.0  # 1/m: a peak of a rise that stands for a tenth of a run is understated by 11 mm
POWER = 20.0  # of the p-norms
HEAD_AFTER = 1.0  # s: the head's rms counts from here, where the run lasts longer
STANDARD_GRAVITY = 9.80665  # m/s^2


@dataclass(frozen=True, slots=True, kw_only=True)
class Ejection:
    """How far the mass centre is out of the hatch, m: > 0 above the ring and beside it, or well above it.

    max(min(z - ring, radius - free radius), z - ring - 0.25 m); slopes are those of the branch that counts.
    """

    bodies: tuple[str, ...]
    shares: tuple[float, ...]
    reference: str = "vehicle"
    has_rates: bool = False

    def _view(self, trajectory: Any) -> Any:
        return trajectory.view(bodies=self.bodies, reference=self.reference, shares=self.shares)

    def _branches(self, place: Array) -> tuple[Array, Array, Array]:
        """Above the ring, beside the hatch, well above the ring; m > 0 where it is. place: (..., 3)."""
        above = place[..., 2] - RING_HEIGHT
        beside = np.hypot(place[..., 0] - HATCH[0], place[..., 1] - HATCH[1]) - FREE_RADIUS
        return above, beside, above - CLEAR

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,) at every node."""
        above, beside, over = self._branches(self._view(trajectory).series())
        return np.asarray(np.maximum(np.minimum(above, beside), over))

    def slopes(self, trajectory: Any, node: int) -> Any:
        """Partial derivatives at a node."""
        place = np.array(self._view(trajectory).seen(node).place)
        above, beside, over = self._branches(place)
        direction = (0.0, 0.0, 1.0)
        if beside < above and over < beside:
            outward = place[:2] - HATCH
            direction = (*(outward / np.linalg.norm(outward)).tolist(), 0.0)
        return Coordinate(
            bodies=self.bodies, shares=self.shares, reference=self.reference, direction=direction
        ).slopes(trajectory, node)

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """Raises ValueError: it has corners."""
        raise ValueError("the distance out of the hatch has no rates; its crossings are linear between nodes")

    def rate_slopes(self, trajectory: Any, node: int) -> Any:
        """Raises ValueError, as `rates`."""
        raise ValueError("the distance out of the hatch has no rates; its crossings are linear between nodes")


def shares_of(system: TreeSystem) -> tuple[float, ...]:
    """Masses of the figure's bodies."""
    mass = {body.name: body.mass for body in system.bodies}
    return tuple(mass[name] for name in FIGURE)


def objectives(system: TreeSystem, *, t_end: float) -> dict[str, Any]:
    """Objectives of the engine by name; what `responses_of` reads off them is in their units.

    g1 m2, g2 and rise m, head_speed m/s, hic15 1, chest_3ms and comfort m/s2, times s; smooth_ones beside
    them. The head's channels are those of the run's own steps; the chest is filtered with CFC 180.
    """
    shares = shares_of(system)
    centre = {body.name: body.centre for body in system.bodies}
    deviation = Deviation(bodies=FIGURE, shares=shares, reference="vehicle", weights=(1.0, 1.0, 1.0))
    up: Any = {"bodies": FIGURE, "shares": shares, "reference": "vehicle", "direction": (0.0, 0.0, 1.0)}
    height, rise = Coordinate(**up), Coordinate(**up, relative=True)
    head = RelativeSpeed(body="head", point=centre["head"], reference="vehicle")
    window = (HEAD_AFTER, t_end) if t_end > HEAD_AFTER else None
    seat = PointAcceleration(body="lower torso")
    chest = PointAcceleration(body="upper torso", point=centre["upper torso"])
    return {
        "g1": Maximum(quantity=deviation),
        "smooth_g1": PNorm(quantity=deviation, p=POWER),
        "highest": Maximum(quantity=height),
        "lowest": Minimum(quantity=height),
        "rise": Maximum(quantity=rise),
        "smooth_rise": LogSumExp(quantity=rise, sharpness=SHARPNESS),
        "ejected_at": FirstCrossing(quantity=Ejection(bodies=FIGURE, shares=shares)),
        **{
            f"{name}_lost_at": FirstCrossing(
                quantity=State(name=f"damage of bushing '{name.replace('_', ' ')}'"), level=LOST
            )
            for name in (bushing.name.replace(" ", "_") for bushing in system.bushings)
        },
        "head_speed": Maximum(quantity=head),
        "smooth_head_speed": PNorm(quantity=head, p=POWER),
        "head_speed_rms": PNorm(quantity=head, p=2.0, window=window),
        "hic15": HeadInjury(quantity=PointAcceleration(body="head", point=centre["head"])),
        "chest_3ms": Filtered(objective=ClipLevel(quantity=chest), filter=ChannelFilter(cfc=180.0)),
        "comfort": RideComfort(acceleration=seat),
        "health_x": RideComfort(acceleration=seat, factors=(1.4, 0.0, 0.0)),
        "health_y": RideComfort(acceleration=seat, factors=(0.0, 1.4, 0.0)),
        "health_z": RideComfort(acceleration=seat, factors=(0.0, 0.0, 1.0)),
    }


def responses_of(run: TreeTrajectory) -> dict[str, float]:
    """The responses of a run.

    Returns: deviation (root of g1, m), g1 (m2), smooth_deviation (m), g2 and min_g2 (m), rise, smooth_rise
        (m), rise_at, ejected_at, grip_lost_at, seat_lost_at (s, the end of the run where it does not happen),
        ejected, grip_lost, seat_lost (0 or 1; a hand that never held has lost nothing), head_speed,
        smooth_head_speed, head_speed_rms (m/s), hic15 (1), chest_3ms (g), comfort, health (m/s2), grip_force,
        seat_force, touch_force (N, the largest; the last that of ring and cabin, 0 at level L0). A seat is
        lost at either level where he has left his place; for a man who stands that is the place of a foot.
    """
    t_end = float(run.times[-1])
    ask = objectives(run.system, t_end=t_end)
    found = {name: float(objective.value(run)) for name, objective in ask.items()}
    held = [b for b in run.system.bushings if b.name.endswith("grip") and b.hold > 0.0]
    losses = [ask[f"{b.name.replace(' ', '_')}_lost_at"] for b in held]
    leaves = [
        ask[f"{b.name.replace(' ', '_')}_lost_at"] for b in run.system.bushings if not b.name.endswith("grip")
    ]
    top = ask["rise"].peaks(run)[0]
    shelf = _largest(run, inner=SHELF)
    forces = {
        b.name: float(np.linalg.norm(run.bushing_force(b.name), axis=1).max()) for b in run.system.bushings
    }
    return {
        "deviation": sqrt(found["g1"]),
        "g1": found["g1"],
        "smooth_deviation": sqrt(found["smooth_g1"]),
        "g2": found["highest"] - REFERENCE_HEIGHT,
        "min_g2": found["lowest"] - REFERENCE_HEIGHT,
        "rise": found["rise"],
        "smooth_rise": found["smooth_rise"],
        "rise_at": top.time,
        "ejected_at": found["ejected_at"],
        "ejected": float(ask["ejected_at"].happens(run)),
        "grip_lost_at": min((loss.value(run) for loss in losses), default=t_end),
        "grip_lost": float(any(loss.happens(run) for loss in losses)),
        "seat_lost_at": min(loss.value(run) for loss in leaves),
        "seat_lost": float(any(loss.happens(run) for loss in leaves)),
        "head_speed": found["head_speed"],
        "smooth_head_speed": found["smooth_head_speed"],
        "head_speed_rms": found["head_speed_rms"],
        "hic15": found["hic15"],
        "chest_3ms": found["chest_3ms"] / STANDARD_GRAVITY,
        "comfort": found["comfort"],
        "health": max(found[f"health_{axis}"] for axis in "xyz"),
        "grip_force": max(force for name, force in forces.items() if name.endswith("grip")),
        "seat_force": max(shelf, *(f for name, f in forces.items() if not name.endswith("grip"))),
        "touch_force": _largest(run, inner="vehicle"),
    }


def _largest(run: TreeTrajectory, *, inner: str) -> float:
    """Of the summed forces of all contacts of the gunner with a body, N; 0 without contacts."""
    own = [c.b == inner and c.a in FIGURE for c in run.system.contacts]
    if not any(own):
        return 0.0
    return float(np.linalg.norm(run.contact_forces().force[:, own].sum(axis=1), axis=1).max())
