"""What a robot file gave: a tree, the ranges of its joints as they were understood, and what was left out."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from ..elements import CoordinateSpring
from ..joints import Joint, Prismatic, Revolute
from ..system import TreeSystem

__all__ = ["RobotFile", "range_stops"]

Range = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotFile:
    """Result of `read_urdf` and `read_mjcf`; printed, it shows each range in the file's two usual units.

    system: the tree, at zero coordinates.
    ranges: (lower, upper) of the joint of a body, rad or m from its zero, where the file limits it.
    left_out: what the file holds and the tree does not, one line each, what would change the motion first.
    """

    system: TreeSystem
    ranges: Mapping[str, Range] = field(default_factory=dict)
    left_out: tuple[str, ...] = ()

    def __str__(self) -> str:
        joints = {body.name: body.joint for body in self.system.bodies}
        lines = [f"{len(joints)} bodies, {self.system.size} velocities"]
        lines += [_range_line(name, joints[name], low, high) for name, (low, high) in self.ranges.items()]
        lines += [f"left out: {text}" for text in self.left_out]
        return "\n".join(lines)


def _range_line(name: str, joint: Joint, low: float, high: float) -> str:
    if isinstance(joint, Prismatic):
        return f"{name}: {low:g} to {high:g} m"
    return f"{name}: {low:.4g} to {high:.4g} rad ({math.degrees(low):.4g} to {math.degrees(high):.4g} deg)"


def range_stops(
    ranges: Mapping[str, Range], joints: Iterable[tuple[str, Joint]], stiffness: float
) -> list[CoordinateSpring]:
    """Soft stops (N m/rad or N/m) at the ends of the ranges of revolute and prismatic joints."""
    stops = []
    for name, joint in joints:
        if name in ranges and isinstance(joint, Revolute | Prismatic):
            low, high = ranges[name]
            rest = min(max(0.0, low), high)
            stops.append(
                CoordinateSpring(body=name, rest=rest, k_stop=stiffness, upper=high - rest, lower=rest - low)
            )
    return stops
