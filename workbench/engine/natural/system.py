"""Mechanisms in natural (fully Cartesian) coordinates: points and unit vectors that elements share.

Garcia de Jalon and Bayo 1994, *Kinematic and Dynamic Simulation of Multibody Systems*, chapters 2 and 4: a
body is known by the points and unit vectors fixed to it, so the mass matrix is constant, constraints are
quadratic and there are no rotation parameters. A joint is what two elements share: a point (spherical), a
point and a vector (revolute), a vector and `PointOnLine` (cylindrical). SI units, global axes.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.laws import Law
from ..errors import InvalidSystem
from ..integration.kinds import MemberEnds

__all__ = [
    "Angle", "Distance", "NaturalPoint", "NaturalSystem", "PointMember", "PointOnLine3", "PointOnPlane",
    "RigidElement", "UnitVector",
]  # fmt: skip

Array = np.ndarray[Any, Any]
Triple = tuple[float, float, float]
ORIGIN: Triple = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class NaturalPoint:
    """A point at its start; shared by every element that names it. mass: kg concentrated there."""

    name: str
    position: Triple
    velocity: Triple = ORIGIN
    mass: float = 0.0
    fixed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class UnitVector:
    """A direction at its start, of length 1 when compiled, and its rate of change (1/s)."""

    name: str
    direction: Triple
    rate: Triple = ORIGIN
    fixed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidElement:
    """A rigid body known by the points and unit vectors fixed to it.

    mass: kg.  centre: of mass, global at the start; None: the mean of its points.
    inertia: (3, 3) about the centre, global axes at the start, kg m^2; a zero matrix for a point mass.
    Directions that the inertia needs beside the given points and vectors are added by the engine.

    >>> RigidElement(name="rod", points=("A", "B"), mass=1.0).vectors
    ()
    """

    name: str
    points: tuple[str, ...]
    vectors: tuple[str, ...] = ()
    mass: float = 0.0
    centre: Triple | None = None
    inertia: Any = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Distance:
    """Two points keep their distance (a massless rod), or follow length(t). length None: as at the start."""

    a: str
    b: str
    length: float | Callable[[float], float] | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Angle:
    """The cosine between two unit vectors is kept, or follows cosine(t). None: as at the start.

    Useless near 0 and pi, where the cosine does not move: share the vector instead.
    """

    a: str
    b: str
    cosine: float | Callable[[float], float] | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointOnLine3:
    """A point stays on the line through `origin` along `axis` (3 rows, one redundant: (p - o) x u = 0).

    With `axis` shared by both elements a cylindrical joint; with a second shared vector a prismatic one.
    """

    point: str
    origin: str
    axis: str
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PointOnPlane:
    """(p - o) . normal keeps its value, or follows height(t) (m). height None: as at the start."""

    point: str
    origin: str
    normal: str
    height: float | Callable[[float], float] | None = None
    name: str = ""


Condition = Distance | Angle | PointOnLine3 | PointOnPlane


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMember:
    """A force element between two points; its law and density as for a planar `Member`.

    natural_length None: the length at the start.
    """

    a: str
    b: str
    law: Law
    natural_length: float | None = None
    power: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class NaturalSystem:
    """Points, unit vectors, rigid elements, conditions, members and gravity (m/s^2), checked once.

    >>> pendulum = NaturalSystem(
    ...     points=(
    ...         NaturalPoint(name="O", position=(0, 0, 0), fixed=True),
    ...         NaturalPoint(name="P", position=(1, 0, 0), mass=1.0),
    ...     ),
    ...     conditions=(Distance(a="O", b="P"),),
    ... )
    >>> pendulum.gravity
    (0.0, 0.0, -9.81)
    """

    points: tuple[NaturalPoint, ...]
    vectors: tuple[UnitVector, ...] = ()
    elements: tuple[RigidElement, ...] = ()
    conditions: tuple[Condition, ...] = ()
    members: tuple[PointMember, ...] = ()
    gravity: Triple = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        for name in ("points", "vectors", "elements", "conditions", "members"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        parts: tuple[NaturalPoint | UnitVector, ...] = (*self.points, *self.vectors)
        names = [part.name for part in parts]
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InvalidSystem(f"two points or vectors are called '{twice}'; names must differ")
        points, vectors = {p.name for p in self.points}, {u.name for u in self.vectors}
        for i, element in enumerate(self.elements):
            where = f"elements[{i}] '{element.name}'"
            if not element.points:
                raise InvalidSystem(f"{where} needs at least one point")
            _known(where, element.points, points, "point")
            _known(where, element.vectors, vectors, "unit vector")
            if element.mass < 0.0:
                raise InvalidSystem(f"{where} needs mass >= 0 kg, got mass={element.mass}")
        for i, condition in enumerate(self.conditions):
            where = f"conditions[{i}] ({type(condition).__name__})"
            match condition:
                case Distance():
                    _known(where, (condition.a, condition.b), points, "point")
                case Angle():
                    _known(where, (condition.a, condition.b), vectors, "unit vector")
                case PointOnLine3():
                    _known(where, (condition.point, condition.origin), points, "point")
                    _known(where, (condition.axis,), vectors, "unit vector")
                case PointOnPlane():
                    _known(where, (condition.point, condition.origin), points, "point")
                    _known(where, (condition.normal,), vectors, "unit vector")
        for i, member in enumerate(self.members):
            _known(f"members[{i}]", (member.a, member.b), points, "point")
            if member.a == member.b:
                raise InvalidSystem(f"members[{i}] joins point '{member.a}' to itself")
        for vector in self.vectors:
            if not np.linalg.norm(vector.direction) > 0.0:
                raise InvalidSystem(f"unit vector '{vector.name}' needs a direction, got {vector.direction}")
        if all(part.fixed for part in parts):
            raise InvalidSystem("system needs at least one point or vector that moves, got none")

    @property
    def size(self) -> int:
        """Number of coordinates of the given free points and vectors."""
        points, vectors = (p.fixed for p in self.points), (u.fixed for u in self.vectors)
        return 3 * sum(not fixed for fixed in (*points, *vectors))

    @property
    def in_python(self) -> bool:
        """No: members take the engine's own laws."""
        return False

    def member_ends(self) -> MemberEnds:
        """The points that members join, numbered as given, at the start."""
        number = {point.name: i for i, point in enumerate(self.points)}
        place = np.array([point.position for point in self.points], float)
        a, b = (np.array([number[getattr(m, end)] for m in self.members], np.int64) for end in "ab")
        return MemberEnds(body_a=a, point_a=place[a], body_b=b, point_b=place[b])


def _known(where: str, names: tuple[str, ...], known: set[str], kind: str) -> None:
    for name in names:
        if name not in known:
            raise InvalidSystem(
                f"{where} refers to {kind} '{name}', which the system does not have; {kind}s are "
                f"{', '.join(sorted(known)) or 'none'}"
            )
