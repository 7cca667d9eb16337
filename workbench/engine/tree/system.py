"""Trees of rigid bodies in joint coordinates, and the forces on them; checked once.

Every body hangs by one joint on its parent, another body or the ground, so a system is one or several trees
without loops. Bodies may be declared in any order. Global axes are those of the ground; gravity is a vector.
SI units.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.laws import Law, UserLaw
from ..errors import InvalidSystem, NotSupported
from ..integration.kinds import MemberEnds
from .joints import (
    FREEDOM,
    ZERO,
    Cylindrical,
    Floating,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Triple,
    Universal,
)
from .start import start_frames

__all__ = [
    "GROUND",
    "CoordinateSpring",
    "Coupling",
    "SpatialBody",
    "SpatialBushing",
    "SpatialLoad",
    "SpatialMember",
    "SphericalSpring",
    "TreeSystem",
]  # fmt: skip

Array = np.ndarray[Any, Any]
GROUND = "ground"
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpatialBody:
    """A rigid body on a joint.

    parent: another body's name, or "ground".  at: place of the joint in the parent's frame, m.  axes: (3, 3)
    axes of the joint frame as columns, in the parent's frame.  mass: kg; 0 for a body that only carries
    others.
    centre: of mass, in the body's frame.  inertia: (3, 3) or three principal ones about the centre, in the
    body's axes, kg m^2.

    >>> SpatialBody(name="arm", joint=Revolute(axis=(0, 1, 0)), mass=2.0, centre=(0.2, 0, 0)).parent
    'ground'
    """

    name: str
    joint: Joint
    parent: str = GROUND
    at: Triple = ZERO
    axes: Any = UNIT
    mass: float = 0.0
    centre: Triple = ZERO
    inertia: Any = ZERO


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialMember:
    """A force element between a point of body `a` and a point of body `b`; its law and density as for a
    planar `Member`.

    natural_length: m, None for the length at the start.  power: SIMP exponent.
    """

    a: str
    b: str = GROUND
    point_a: Triple = ZERO
    point_b: Triple = ZERO
    law: Law
    natural_length: float | None = None
    power: float = 1.0
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialBushing:
    """Three-axis bushing of a point of `a` to a point of `b`, in b's axes, that saturates and may let go for
    good.

        force on a = -hold (1 - D) w(|r|) [g k r + h c r' - preload],   g = cap tanh(e/cap)/e,  h =
        sech^2(e/cap) e = sqrt(|k r|^2 + (mean(k) eps)^2),   dD/dt = (1 - D) logistic((|r| -
        release)/width)/tau,   D(0) = 0

    k, c: one number, or one per axis of b.  w falls from 1 at |r| = slip to 0 at release (C2). Without `slip`
    and `release` it never breaks; without `cap` it is linear. preload: force on `a` (N, b's axes) at no
    separation.  opens, push_cap: as in the planar `Bushing`; `cap` then limits the force on the opening side.
    """

    a: str
    b: str = GROUND
    point_a: Triple = ZERO
    point_b: Triple = ZERO
    k: float | Triple
    c: float | Triple = 0.0
    cap: float | None = None
    slip: float | None = None
    release: float | None = None
    tau: float = 0.02
    width: float = 0.005
    eps: float = 5e-4
    hold: float = 1.0
    preload: Triple = ZERO
    opens: Triple | None = None
    push_cap: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        where = f"bushing '{self.a}'-'{self.b}'"
        if (self.slip is None) != (self.release is None):
            raise InvalidSystem(f"{where} needs both slip and release, or neither")
        if self.slip is not None and self.release is not None and not 0.0 <= self.slip < self.release:
            raise InvalidSystem(f"{where} needs 0 <= slip < release in m, got {self.slip} and {self.release}")
        if self.cap is not None and self.cap <= 0.0:
            raise InvalidSystem(f"{where} needs cap > 0 N, got cap={self.cap}")
        if (self.opens is None) != (self.push_cap is None) or (self.opens and self.cap is None):
            raise InvalidSystem(f"{where} needs opens, push_cap and cap together")
        if min(self.tau, self.width, self.eps) <= 0.0:
            raise InvalidSystem(f"{where} needs tau, width and eps > 0")

    @property
    def breakable(self) -> bool:
        """Whether it has a release distance."""
        return self.release is not None

    def column(self) -> tuple[float, ...]:
        """Parameters in the order of the kernel; points in the bodies' frames."""
        k, c = (x if isinstance(x, tuple) else (x, x, x) for x in (self.k, self.c))
        opens = np.zeros(3) if self.opens is None else np.asarray(self.opens) / np.linalg.norm(self.opens)
        return (
            *k, *c, 1e30 if self.cap is None else self.cap,
            0.0 if self.slip is None else self.slip, 1.0 if self.release is None else self.release,
            self.tau if self.breakable else 0.0, self.eps, self.hold, *self.preload,
            *self.point_a, *self.point_b, self.width, *(float(x) for x in opens),
            0.0 if self.push_cap is None else self.push_cap,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CoordinateSpring:
    """Spring, damper, smooth stops and constant torque on one coordinate of a body's joint.

        T = torque - k phi - c phi' - k_stop [softplus(phi - upper) - softplus(-phi - lower)],  phi = q - rest

    coordinate: which of the joint's coordinates (in the order of the joint's description).  rest: None for
    the value at the start.  Units N m/rad for turns, N/m for slides; `width` of the stops in rad or m.
    """

    body: str
    coordinate: int = 0
    k: float = 0.0
    c: float = 0.0
    rest: float | None = None
    k_stop: float = 0.0
    upper: float = 0.0
    lower: float = 0.0
    width: float = 0.02
    torque: float = 0.0

    def __post_init__(self) -> None:
        if self.width <= 0.0 or min(self.k_stop, self.upper, self.lower) < 0.0:
            raise InvalidSystem(
                f"spring of '{self.body}' needs width > 0 and k_stop, upper, lower >= 0 (distances on either "
                f"side of rest), got width={self.width}, k_stop={self.k_stop}, upper={self.upper}, "
                f"lower={self.lower}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class SphericalSpring:
    """Equal stiffness and damping about all axes of a spherical or floating joint's rotation.

    Torque -k x - c w in the body's frame, x the rotation vector from the orientation at the start, shorter
    than pi.
    """

    body: str
    k: float = 0.0
    c: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """A spring and damper between two joint coordinates (an anti-roll bar): T = -k (q_a - q_b - rest) - c
    ()'.

    rest: None for the difference at the start.
    """

    a: str
    b: str
    coordinate_a: int = 0
    coordinate_b: int = 0
    k: float = 0.0
    c: float = 0.0
    rest: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialLoad:
    """A force at a point of a body, or a torque on it, constant or over time; in global axes, or in the
    body's where `follows`.
    """

    body: str
    point: Triple = ZERO
    force: Triple | Callable[[float], Any] | None = None
    torque: Triple | Callable[[float], Any] | None = None
    follows: bool = False

    def __post_init__(self) -> None:
        if (self.force is None) == (self.torque is None):
            raise InvalidSystem(f"load on '{self.body}' needs either force or torque")


# coordinates that a spring or coupling may act on, per joint
SCALARS: dict[type, tuple[int, int]] = {
    Floating: (0, 3), Spherical: (0, 0), Universal: (0, 2), Revolute: (0, 1), Prismatic: (0, 1),
    Cylindrical: (0, 2), Planar: (0, 3),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class TreeSystem:
    """Bodies on joints, members, bushings, springs on coordinates, loads and gravity (m/s^2).

    >>> pendulum = TreeSystem(
    ...     bodies=(SpatialBody(name="bob", joint=Spherical(), mass=1.0, centre=(1.0, 0.0, 0.0)),)
    ... )
    >>> pendulum.gravity
    (0.0, 0.0, -9.81)
    """

    bodies: tuple[SpatialBody, ...]
    members: tuple[SpatialMember, ...] = ()
    bushings: tuple[SpatialBushing, ...] = ()
    springs: tuple[CoordinateSpring, ...] = ()
    spherical_springs: tuple[SphericalSpring, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    loads: tuple[SpatialLoad, ...] = ()
    gravity: Triple = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        for name in (
            "bodies", "members", "bushings", "springs", "spherical_springs", "couplings", "loads",
        ):  # fmt: skip
            object.__setattr__(self, name, tuple(getattr(self, name)))
        names = [body.name for body in self.bodies]
        if len(set(names)) < len(names) or GROUND in names:
            twice = next(name for name in names if names.count(name) > 1 or name == GROUND)
            raise InvalidSystem(
                f"two bodies are called '{twice}'; names must differ, and 'ground' is the world"
            )
        by_name = {body.name: body for body in self.bodies}
        for body in self.bodies:
            _check_body(body, by_name)
        for i, member in enumerate(self.members):
            _known(f"members[{i}]", (member.a, member.b), by_name)
            if member.a == member.b:
                raise InvalidSystem(f"members[{i}] joins body '{member.a}' to itself")
            if isinstance(member.law, UserLaw):
                raise NotSupported(
                    f"members[{i}] has a UserLaw, which trees do not take; use the engine's own laws, or a "
                    "NaturalSystem or planar System"
                )
        for i, bushing in enumerate(self.bushings):
            _known(f"bushings[{i}]", (bushing.a, bushing.b), by_name)
            if bushing.a == bushing.b:
                raise InvalidSystem(f"bushings[{i}] joins body '{bushing.a}' to itself")
        for i, spring in enumerate(self.springs):
            _coordinate(f"springs[{i}]", spring.body, spring.coordinate, by_name)
        for i, ball in enumerate(self.spherical_springs):
            _known(f"spherical_springs[{i}]", (ball.body,), by_name, ground=False)
            if not isinstance(by_name[ball.body].joint, Floating | Spherical):
                raise InvalidSystem(
                    f"spherical_springs[{i}] needs a spherical or floating joint on '{ball.body}'"
                )
        for i, coupling in enumerate(self.couplings):
            _coordinate(f"couplings[{i}]", coupling.a, coupling.coordinate_a, by_name)
            _coordinate(f"couplings[{i}]", coupling.b, coupling.coordinate_b, by_name)
        for i, load in enumerate(self.loads):
            _known(f"loads[{i}]", (load.body,), by_name, ground=False)

    @property
    def size(self) -> int:
        """Number of velocities."""
        return sum(FREEDOM[type(body.joint)] for body in self.bodies)

    @property
    def in_python(self) -> bool:
        """No law written in Python is called during a run."""
        return False

    def member_ends(self) -> MemberEnds:
        """The ends of all members at the start; bodies numbered as given, the ground last."""
        frames = start_frames(self.bodies)
        number = {name: i for i, name in enumerate([*(body.name for body in self.bodies), GROUND])}
        ends = []
        for end in "ab":
            names = [getattr(member, end) for member in self.members]
            points = [getattr(member, f"point_{end}") for member in self.members]
            ends.append(np.array([number[name] for name in names], np.int64))
            ends.append(
                np.array(
                    [
                        frames[n][1] + frames[n][0] @ np.asarray(x, float)
                        for n, x in zip(names, points, strict=True)
                    ]
                ).reshape(-1, 3)
            )
        return MemberEnds(body_a=ends[0], point_a=ends[1], body_b=ends[2], point_b=ends[3])


def _check_body(body: SpatialBody, by_name: dict[str, SpatialBody]) -> None:
    _known(f"body '{body.name}'", (body.parent,), by_name)
    above, seen = body, {body.name}
    while above.parent != GROUND:
        if above.parent in seen:
            raise InvalidSystem(f"body '{body.name}' hangs on itself: {' -> '.join([*seen, above.parent])}")
        seen.add(above.parent)
        above = by_name[above.parent]
        if above.parent != GROUND and above.parent not in by_name:
            return  # that body's own check names its parent
    if body.mass < 0.0:
        raise InvalidSystem(f"body '{body.name}' needs mass >= 0 kg, got mass={body.mass}")
    inertia = full_inertia(body.inertia)
    if (
        inertia.shape != (3, 3)
        or not np.allclose(inertia, inertia.T)
        or (np.linalg.eigvalsh(inertia) < 0).any()
    ):
        raise InvalidSystem(
            f"body '{body.name}' needs a symmetric inertia without negative principal values, (3, 3) or "
            f"(3,), got {np.asarray(body.inertia).tolist()}"
        )
    axes = np.asarray(body.axes, float)
    if axes.shape != (3, 3) or np.abs(axes.T @ axes - np.eye(3)).max() > 1e-9 or np.linalg.det(axes) < 0.0:
        raise InvalidSystem(f"body '{body.name}' needs right-handed unit axes (3, 3), got {axes.tolist()}")
    for name in ("axis", "axes"):
        if hasattr(body.joint, name):
            rows = np.atleast_2d(np.asarray(getattr(body.joint, name), float))
            if (np.linalg.norm(rows, axis=1) == 0.0).any():
                raise InvalidSystem(f"joint of '{body.name}' needs an axis, got {rows.tolist()}")
    if isinstance(body.joint, Planar) and abs(np.dot(*np.asarray(body.joint.axes, float))) > 1e-9:
        raise InvalidSystem(f"joint of '{body.name}' needs perpendicular axes, got {body.joint.axes}")


def full_inertia(inertia: Any) -> Array:
    """(3, 3) from a matrix or principal values."""
    given = np.asarray(inertia, float)
    return np.diag(given) if given.shape == (3,) else given


def _known(
    where: str, names: tuple[str, ...], by_name: dict[str, SpatialBody], *, ground: bool = True
) -> None:
    for name in names:
        if name not in by_name and not (ground and name == GROUND):
            raise InvalidSystem(
                f"{where} refers to body '{name}'; bodies are {', '.join(sorted(by_name))}"
                + (" and ground" if ground else "")
            )


def _coordinate(where: str, body: str, coordinate: int, by_name: dict[str, SpatialBody]) -> None:
    _known(where, (body,), by_name, ground=False)
    first, last = SCALARS.get(type(by_name[body].joint), (0, 0))
    if not first <= coordinate < last:
        raise InvalidSystem(
            f"{where} needs a coordinate of the joint of '{body}' ({type(by_name[body].joint).__name__}: "
            f"{last} of them), got coordinate={coordinate}"
        )
