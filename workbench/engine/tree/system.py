"""Trees of rigid bodies in joint coordinates, and the forces on them; checked once.

Every body hangs by one joint on its parent, another body or the ground, so a system is one or several trees;
cut joints close loops. Bodies may be declared in any order. Global axes are those of the ground; gravity is a
vector. SI units.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.laws import UserLaw
from ..errors import InvalidSystem, NotSupported
from ..integration.kinds import MemberEnds
from .elements import (
    CoordinateDamper,
    CoordinateSpring,
    Coupling,
    SpatialBushing,
    SpatialLoad,
    SpatialMember,
    SpatialStrut,
    SphericalSpring,
)
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
from .loops.cuts import CutJoint
from .start import Place, start_frames
from .surfaces import SpatialContact, Tyre

__all__ = ["GROUND", "SpatialBody", "TreeSystem"]

Array = np.ndarray[Any, Any]
GROUND = "ground"
UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SpatialBody:
    """A rigid body on a joint.

    parent: another body's name, or "ground".
    at: place of the joint in the parent's frame, m.
    axes: (3, 3) axes of the joint frame as columns, in the parent's frame.
    mass: kg; 0 for a body that only carries others.
    centre: of mass, in the body's frame.
    inertia: (3, 3) or three principal ones about the centre, in the body's axes, kg m^2.

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


# coordinates that a spring or coupling may act on, per joint
SCALARS: dict[type, tuple[int, int]] = {
    Floating: (0, 3), Spherical: (0, 0), Universal: (0, 2), Revolute: (0, 1), Prismatic: (0, 1),
    Cylindrical: (0, 2), Planar: (0, 3),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class TreeSystem:
    """Bodies on joints, cut joints, members, bushings, springs and dampers on coordinates, loads and gravity
    (m/s^2).

    >>> pendulum = TreeSystem(
    ...     bodies=(SpatialBody(name="bob", joint=Spherical(), mass=1.0, centre=(1.0, 0.0, 0.0)),)
    ... )
    >>> pendulum.gravity
    (0.0, 0.0, -9.81)
    """

    bodies: tuple[SpatialBody, ...]
    members: tuple[SpatialMember, ...] = ()
    bushings: tuple[SpatialBushing, ...] = ()
    contacts: tuple[SpatialContact, ...] = ()
    tyres: tuple[Tyre, ...] = ()
    struts: tuple[SpatialStrut, ...] = ()
    springs: tuple[CoordinateSpring, ...] = ()
    dampers: tuple[CoordinateDamper, ...] = ()
    spherical_springs: tuple[SphericalSpring, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    cuts: tuple[CutJoint, ...] = ()
    loads: tuple[SpatialLoad, ...] = ()
    gravity: Triple = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        for name in (
            "bodies", "members", "bushings", "contacts", "tyres", "struts", "springs", "dampers",
            "spherical_springs", "couplings", "cuts", "loads",
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
            _check_parents(body, by_name)
        _check_numbers(self.bodies)
        for i, member in enumerate(self.members):
            _known(f"members[{i}]", (member.a, member.b), by_name)
            if member.a == member.b:
                raise InvalidSystem(f"members[{i}] joins body '{member.a}' to itself")
            if isinstance(member.law, UserLaw):
                raise NotSupported(
                    f"members[{i}] has a UserLaw, which trees do not take; use CompiledLaw for a function of "
                    "your own, Curve for points of a test, or a planar System"
                )
        for i, bushing in enumerate(self.bushings):
            _known(f"bushings[{i}]", (bushing.a, bushing.b), by_name)
            if bushing.a == bushing.b:
                raise InvalidSystem(f"bushings[{i}] joins body '{bushing.a}' to itself")
        for i, strut in enumerate(self.struts):
            _known(f"struts[{i}]", (strut.a, strut.b), by_name)
            if strut.a == strut.b:
                raise InvalidSystem(f"struts[{i}] joins body '{strut.a}' to itself")
            first = [other.called for other in self.struts].index(strut.called)
            if first < i:
                raise InvalidSystem(
                    f"struts[{i}] is called '{strut.called}' as struts[{first}] is; give them "
                    "names, by which their states are told apart"
                )
        for i, contact in enumerate(self.contacts):
            _known(f"contacts[{i}]", (contact.a, contact.b), by_name)
        for i, tyre in enumerate(self.tyres):
            _known(f"tyres[{i}]", (tyre.body,), by_name, ground=False)
        for i, spring in enumerate(self.springs):
            _coordinate(f"springs[{i}]", spring.body, spring.coordinate, by_name)
        for i, damper in enumerate(self.dampers):
            _coordinate(f"dampers[{i}]", damper.body, damper.coordinate, by_name)
        for i, ball in enumerate(self.spherical_springs):
            _known(f"spherical_springs[{i}]", (ball.body,), by_name, ground=False)
            if not isinstance(by_name[ball.body].joint, Floating | Spherical):
                raise InvalidSystem(
                    f"spherical_springs[{i}] needs a spherical or floating joint on '{ball.body}'"
                )
        for i, coupling in enumerate(self.couplings):
            _coordinate(f"couplings[{i}]", coupling.a, coupling.coordinate_a, by_name)
            _coordinate(f"couplings[{i}]", coupling.b, coupling.coordinate_b, by_name)
        labels = [cut.label for cut in self.cuts]
        for cut in self.cuts:
            if labels.count(cut.label) > 1:
                raise InvalidSystem(f"two cut joints are called '{cut.label}'; give them names that differ")
            _known(f"cut joint '{cut.label}'", (cut.a, cut.b), by_name)
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


def _check_parents(body: SpatialBody, by_name: dict[str, SpatialBody]) -> None:
    _known(f"body '{body.name}'", (body.parent,), by_name)
    above, seen = body, {body.name}
    while above.parent != GROUND:
        if above.parent in seen:
            raise InvalidSystem(f"body '{body.name}' hangs on itself: {' -> '.join([*seen, above.parent])}")
        seen.add(above.parent)
        above = by_name[above.parent]
        if above.parent != GROUND and above.parent not in by_name:
            return  # that body's own check names its parent


def _check_numbers(bodies: tuple[SpatialBody, ...]) -> None:
    """Masses, joints, inertias, axes; of all bodies at once where numpy can: every case makes a system."""
    for body in bodies:
        if body.mass < 0.0:
            raise InvalidSystem(f"body '{body.name}' needs mass >= 0 kg, got mass={body.mass}")
        _check_joint(body)
    inertia = _stacked([full_inertia(body.inertia) for body in bodies])
    is_inertia = np.all(np.isclose(inertia, inertia.transpose(0, 2, 1)), axis=(1, 2))
    is_inertia[is_inertia] = (np.linalg.eigvalsh(inertia[is_inertia]) >= 0.0).all(axis=1)
    if not is_inertia.all():
        body = bodies[int(is_inertia.argmin())]
        raise InvalidSystem(
            f"body '{body.name}' needs a symmetric inertia without negative principal values, (3, 3) or "
            f"(3,), got {np.asarray(body.inertia).tolist()}"
        )
    axes = _stacked([np.asarray(body.axes, float) for body in bodies])
    are_turns = np.abs(axes.transpose(0, 2, 1) @ axes - np.eye(3)).max(axis=(1, 2)) <= 1e-9
    are_turns[are_turns] = np.linalg.det(axes[are_turns]) >= 0.0
    if not are_turns.all():
        body = bodies[int(are_turns.argmin())]
        raise InvalidSystem(
            f"body '{body.name}' needs right-handed unit axes (3, 3), got {np.asarray(body.axes).tolist()}"
        )


def _stacked(matrices: list[Array]) -> Array:
    """(n, 3, 3); NaN in place of what has another shape."""
    nothing = np.full((3, 3), np.nan)
    return np.array([m if m.shape == (3, 3) else nothing for m in matrices]).reshape(-1, 3, 3)


def _check_joint(body: SpatialBody) -> None:
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


def link_inertia(body: SpatialBody, place: Place) -> Array:
    """(10,) m, m c, inertia about the link's origin, in the link's axes."""
    c = place.at + place.turn @ np.asarray(body.centre, float)
    about = place.turn @ full_inertia(body.inertia) @ place.turn.T
    about = about + body.mass * (c @ c * np.eye(3) - np.outer(c, c))
    return np.array(
        [body.mass, *(body.mass * c), *np.diag(about), about[0, 1], about[0, 2], about[1, 2]], float
    )


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
