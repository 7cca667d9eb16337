"""Double wishbones from their hard points: what a swing arm has to reproduce.

A left corner is closed position by position: the lower arm turns by an angle, the upper arm follows at the
length of the upright, the upright turns about its two ball joints until the tie rod has its length. Points
are those of Project Chrono's HMMWV files (from Aardema 1988), in data/hard_points.csv: x, y to the left, z.
"""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import newton

__all__ = ["FREE_LENGTH", "SPRING", "Corner", "Wishbones", "wishbones"]

Array = np.ndarray[Any, Any]
DATA = Path(__file__).parent.with_name("data") / "hard_points.csv"
SPRING = {"front": 167062.0, "rear": 369149.0}  # N/m, 954 and 2108 lbf/in
FREE_LENGTH = {"front": 0.339, "rear": 0.382}  # m
RADIUS = 0.452  # m, from the wheel's centre down to the ground at design height
SMALL = 1e-4  # rad of the lower arm for slopes


@dataclass(frozen=True, slots=True, kw_only=True)
class Corner:
    """A position of a corner: wheel centre and contact (m), camber and steer (deg), spring length (m).

    camber is negative where the wheel's top leans inwards, steer positive to the left.
    """

    centre: Array
    contact: Array
    camber: float
    steer: float
    spring: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Wishbones:
    """A corner's hard points by their ids, m."""

    axle: str
    points: dict[str, Array]

    def at(self, angle: float) -> Corner:
        """The corner with its lower arm turned by an angle (rad, positive lifts the wheel)."""
        p = self.points
        lower = _turned(p["LU"], p["LF"], p["LB"], angle)
        spring = _turned(p["SA"], p["LF"], p["LB"], angle)

        def upright(turn: float) -> float:
            moved = _turned(p["UU"], p["UF"], p["UB"], turn)
            return float(np.linalg.norm(moved - lower) - np.linalg.norm(p["UU"] - p["LU"]))

        upper = _turned(p["UU"], p["UF"], p["UB"], newton(upright, 0.0, tol=1e-14))
        base = _swung(p["UU"] - p["LU"], upper - lower)

        def carried(point: Array, turn: float) -> Array:
            return _turned(lower + base @ (point - p["LU"]), lower, upper, turn)

        def tie_rod(turn: float) -> float:
            length = np.linalg.norm(carried(p["TU"], turn) - p["TC"])
            return float(length - np.linalg.norm(p["TU"] - p["TC"]))

        turn = newton(tie_rod, 0.0, tol=1e-14)
        centre = carried(p["SP"], turn)
        axis = carried(p["SP"] + np.array([0.0, 1.0, 0.0]), turn) - centre
        down = -np.array([0.0, 0.0, 1.0]) + axis[2] * axis
        return Corner(
            centre=centre, contact=centre + RADIUS * down / np.linalg.norm(down),
            camber=-float(np.degrees(np.arcsin(axis[2]))),
            steer=-float(np.degrees(np.arctan2(axis[0], axis[1]))),
            spring=float(np.linalg.norm(spring - p["SC"])),
        )  # fmt: skip

    def angle_at(self, travel: float) -> float:
        """Turn of the lower arm that lifts the wheel's centre by `travel`, m."""
        design = self.points["SP"][2]
        return float(newton(lambda a: self.at(a).centre[2] - design - travel, 2.0 * travel, tol=1e-13))

    def slopes(self, travel: float = 0.0) -> tuple[Array, float, float]:
        """By the wheel centre's travel: the contact's motion (3,), camber (deg/m), and the spring's ratio."""
        a = self.angle_at(travel)
        before, after = self.at(a - SMALL), self.at(a + SMALL)
        rise = after.centre[2] - before.centre[2]
        return (
            (after.contact - before.contact) / rise,
            (after.camber - before.camber) / rise,
            (before.spring - after.spring) / rise,
        )

    def wheel_force(self, travel: float) -> float:
        """Vertical force (N) at the wheel that balances the linear spring."""
        length = self.at(self.angle_at(travel)).spring
        ratio = self.slopes(travel)[2]
        return SPRING[self.axle] * (FREE_LENGTH[self.axle] - length) * ratio

    def wheel_rate(self, travel: float = 0.0) -> float:
        """Slope of the wheel force, N/m."""
        h = 1e-3
        return (self.wheel_force(travel + h) - self.wheel_force(travel - h)) / (2.0 * h)

    def swing_arm(self) -> tuple[float, float]:
        """Length (m) of the swing arm with the same camber gain, and height of the roll centre (m)."""
        move, camber, _ = self.slopes()
        roll_centre = move[1] / move[2] * self.points["SP"][1]
        return -float(np.degrees(1.0)) / camber, float(roll_centre)


def wishbones(axle: str, path: Path = DATA) -> Wishbones:
    """The corner of an axle ("front", "rear") in a file of hard points."""
    with path.open() as lines:
        rows = [row for row in csv.DictReader(lines) if row["axle"] == axle]
    return Wishbones(
        axle=axle,
        points={row["id"]: np.array([float(row[k]) for k in ("x_m", "y_m", "z_m")]) for row in rows},
    )


def _turned(point: Array, a: Array, b: Array, angle: float) -> Array:
    """A point turned about the line from a to b; inboard axes run so that a positive angle lifts."""
    axis = (b - a) / np.linalg.norm(b - a)
    if axis[0] < 0.0:
        axis = -axis
    r = point - a
    return np.asarray(
        a + r * np.cos(angle) + np.cross(axis, r) * np.sin(angle) + axis * (axis @ r) * (1.0 - np.cos(angle))
    )


def _swung(old: Array, new: Array) -> Array:
    """The shortest rotation that takes one direction into another."""
    u, v = old / np.linalg.norm(old), new / np.linalg.norm(new)
    w, c = np.cross(u, v), float(u @ v)
    cross = np.array([[0.0, -w[2], w[1]], [w[2], 0.0, -w[0]], [-w[1], w[0], 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1.0 + c))
