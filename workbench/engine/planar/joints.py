"""Joints: position-level constraints Phi(q, t) = 0 between two bodies, as rows of a few elementary kinds.

Every joint returns rows (kind, s_a, s_b, normal, target, drive) of the kinds in `_kernels/row_kinds`. Body
"ground" is the world.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot
from typing import NamedTuple

from ._kernels.row_kinds import ANGLE, COINCIDENT_X, COINCIDENT_Y, DISTANCE, LINE

__all__ = [
    "AngleJoint",
    "DistanceJoint",
    "DrivenJoint",
    "FixedJoint",
    "Joint",
    "PointOnLine",
    "PrismaticJoint",
    "RevoluteJoint",
    "Row",
]

Point = tuple[float, float]


class Row(NamedTuple):
    """One scalar constraint between bodies a and b. target None: its value at the start is kept."""

    kind: int
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    normal: Point = (0.0, 0.0)
    target: float | None = 0.0
    drive: Callable[[float], float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class RevoluteJoint:
    """A point of `a` and a point of `b` coincide (2 rows, in global axes, so lambda is the joint force)."""

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    name: str = ""

    def rows(self) -> tuple[Row, ...]:
        """p_a + A_a s_a - p_b - A_b s_b = 0."""
        return (Row(COINCIDENT_X, self.point_a, self.point_b), Row(COINCIDENT_Y, self.point_a, self.point_b))


@dataclass(frozen=True, slots=True, kw_only=True)
class FixedJoint:
    """`a` is welded to `b` at a common point; the angle between them is kept (3 rows)."""

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    angle: float | None = None
    name: str = ""

    def rows(self) -> tuple[Row, ...]:
        """Coincidence and constant angle."""
        return (
            Row(COINCIDENT_X, self.point_a, self.point_b),
            Row(COINCIDENT_Y, self.point_a, self.point_b),
            Row(ANGLE, target=self.angle),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class AngleJoint:
    """The angle between two bodies is kept (1 row)."""

    a: str
    b: str
    angle: float | None = None
    name: str = ""

    def rows(self) -> tuple[Row, ...]:
        """theta_a - theta_b = angle."""
        return (Row(ANGLE, target=self.angle),)


@dataclass(frozen=True, slots=True, kw_only=True)
class PointOnLine:
    """A pin of `a` slides on a line of `b` through `point_b` along `axis` (b's frame; 1 row)."""

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    axis: Point = (1.0, 0.0)
    name: str = ""

    def rows(self) -> tuple[Row, ...]:
        """The distance of the pin from the line is 0."""
        return (Row(LINE, self.point_a, self.point_b, _normal(self.axis)),)


@dataclass(frozen=True, slots=True, kw_only=True)
class PrismaticJoint:
    """`a` slides on `b` along `axis` (b's frame) without turning (2 rows)."""

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    axis: Point = (1.0, 0.0)
    angle: float | None = None
    name: str = ""

    def rows(self) -> tuple[Row, ...]:
        """Pin on the line, and constant angle."""
        return (Row(LINE, self.point_a, self.point_b, _normal(self.axis)), Row(ANGLE, target=self.angle))


@dataclass(frozen=True, slots=True, kw_only=True)
class DistanceJoint:
    """A massless rod: the distance of two points is kept (1 row). length None: the distance at the start."""

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    length: float | None = None
    name: str = ""

    def rows(self) -> tuple[Row, ...]:
        """(d.d/L - L)/2 = 0, of the scale of a length."""
        return (Row(DISTANCE, self.point_a, self.point_b, target=self.length),)


@dataclass(frozen=True, slots=True, kw_only=True)
class DrivenJoint:
    """One relative coordinate follows a function of time (1 row; combine it with other joints).

    coordinate: "angle" (theta_a - theta_b) or "along" (position of point_a from point_b along `axis`, b's
        frame)
    motion: a function of time, twice differentiable; added to the value at the start when `from_start`
    """

    a: str
    b: str
    motion: Callable[[float], float]
    coordinate: str = "angle"
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    axis: Point = (1.0, 0.0)
    from_start: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        if self.coordinate not in ("angle", "along"):
            raise ValueError(f"driven joint needs coordinate 'angle' or 'along', got '{self.coordinate}'")

    def rows(self) -> tuple[Row, ...]:
        """coordinate(q) - motion(t) = 0."""
        target = None if self.from_start else 0.0
        if self.coordinate == "angle":
            return (Row(ANGLE, target=target, drive=self.motion),)
        length = hypot(*self.axis)
        axis = (self.axis[0] / length, self.axis[1] / length)
        return (Row(LINE, self.point_a, self.point_b, axis, target, self.motion),)


Joint = RevoluteJoint | FixedJoint | AngleJoint | PointOnLine | PrismaticJoint | DistanceJoint | DrivenJoint


def _normal(axis: Point) -> Point:
    length = hypot(*axis)
    if length == 0.0:
        raise ValueError("a sliding axis needs a direction, got axis=(0, 0)")
    return (-axis[1] / length, axis[0] / length)
