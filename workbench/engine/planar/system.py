"""A multibody system: bodies, joints, members and loads, frozen and checked once.

Planar bodies have the coordinates (x, y, theta) of their mass centre in the global frame (2.12); SI units,
radians.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..elements.bushing import Bushing
from ..elements.element import Element
from ..elements.joint_spring import JointSpring
from ..elements.laws import UserLaw
from ..elements.prescribed_motion import Motion
from ..errors import InvalidSystem
from ..integration.kinds import MemberEnds
from .joints import Joint
from .members import Member

__all__ = ["Body", "Load", "System"]

Array = np.ndarray[Any, Any]
Triple = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """A rigid planar body.

    mass: kg.  inertia: kg m^2 about the mass centre.  position: (x, y, theta) at the start.  velocity: its
    rate.  motion: prescribes the body's motion; then mass, inertia, position and velocity are ignored.
    gravity: whether gravity acts on it.

    >>> Body(name="1", mass=60.0, inertia=10.0).position
    (0.0, 0.0, 0.0)
    """

    name: str
    mass: float = 1.0
    inertia: float = 1.0
    position: Triple = (0.0, 0.0, 0.0)
    velocity: Triple = (0.0, 0.0, 0.0)
    motion: Motion | None = None
    gravity: bool = True


@dataclass(frozen=True, slots=True, kw_only=True)
class Load:
    """A force (N) at a point of a body and a torque (N m), constant or functions of time.

    force: (fx, fy) or t -> (fx, fy); in the global frame, or in the body's when `follower`.
    """

    body: str
    force: Any = (0.0, 0.0)
    torque: Any = 0.0
    point: tuple[float, float] = (0.0, 0.0)
    follower: bool = False

    def sample(self, t: float) -> Triple:
        """(fx, fy, torque) at time t."""
        f = self.force(t) if callable(self.force) else self.force
        m = self.torque(t) if callable(self.torque) else self.torque
        return float(f[0]), float(f[1]), float(m)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class System:
    """Bodies joined by joints, loaded, and tied by members whose densities are the design.

    Two systems are equal only when they are the same object, so compiled arrays are kept with it.
    The order of `members` is the order of densities and gradients. `elements`: force elements of any
    kind, beside the joint springs and bushings that have a field of their own. `gravity` is an acceleration,
    m/s^2.

    >>> from workbench.engine import Body, Member, Spring, System
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0))
    >>> System(bodies=(mass,), members=(spring,)).size
    3
    """

    bodies: tuple[Body, ...]
    members: tuple[Member, ...] = ()
    joints: tuple[Joint, ...] = ()
    loads: tuple[Load, ...] = ()
    springs: tuple[JointSpring, ...] = ()
    bushings: tuple[Bushing, ...] = ()
    elements: tuple[Element, ...] = ()
    gravity: tuple[float, float] = (0.0, -9.8)
    free: tuple[Body, ...] = field(init=False, repr=False)
    """Bodies without a prescribed motion, in order: body i has the coordinates 3 i .. 3 i + 2."""
    prescribed: tuple[Body, ...] = field(init=False, repr=False)
    """Bodies with a prescribed motion, in order."""

    def __post_init__(self) -> None:
        for name in ("bodies", "members", "joints", "loads", "springs", "bushings", "elements"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        object.__setattr__(self, "free", tuple(body for body in self.bodies if body.motion is None))
        object.__setattr__(self, "prescribed", tuple(b for b in self.bodies if b.motion is not None))
        names = [body.name for body in self.bodies]
        known = {*names, "ground"}
        if "ground" in names:
            raise InvalidSystem("a body may not be called 'ground': that name is the world's")
        if len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise InvalidSystem(f"two bodies are called '{twice}'; names must differ")
        if not any(body.motion is None for body in self.bodies):
            raise InvalidSystem("system needs at least one body that moves freely, got none")
        for body in self.bodies:
            if body.motion is None and not (body.mass > 0.0 and body.inertia > 0.0):
                raise InvalidSystem(
                    f"body '{body.name}' needs mass > 0 kg and inertia > 0 kg m^2, "
                    f"got mass={body.mass} and inertia={body.inertia}"
                )
        for kind in ("members", "joints", "springs", "bushings", "elements"):
            for index, part in enumerate(getattr(self, kind)):
                for end in (part.a, part.b):
                    if end not in known:
                        raise InvalidSystem(
                            f"{kind}[{index}] refers to body '{end}', which the system does not have; "
                            f"bodies are {', '.join(sorted(known))}"
                        )
                if part.a == part.b:
                    raise InvalidSystem(f"{kind}[{index}] joins body '{part.a}' to itself")
        for index, load in enumerate(self.loads):
            if load.body not in names:
                raise InvalidSystem(
                    f"loads[{index}] acts on body '{load.body}', which the system does not have; "
                    f"bodies are {', '.join(sorted(names))}"
                )

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return 3 * len(self.free)

    @property
    def smooth(self) -> bool:
        """Whether every force is smooth (C-infinity): no contact, belt, airbag or breakable bushing."""
        smooth = all(member.law.smooth for member in self.members)
        return smooth and all(element.smooth for element in self.force_elements)

    @property
    def force_elements(self) -> tuple[Element, ...]:
        """Joint springs, bushings and other elements, as the kernels number them."""
        return (*self.springs, *self.bushings, *self.elements)

    @property
    def has_states(self) -> bool:
        """Whether a force element has a state that can change, as the damage of a breakable bushing."""
        return any(element.has_state for element in self.force_elements)

    @property
    def in_python(self) -> bool:
        """Whether a law written in Python is called during a run."""
        return any(isinstance(member.law, UserLaw) for member in self.members)

    def member_ends(self) -> MemberEnds:
        """The ends of all members at the start; bodies: free, prescribed, then the ground."""
        bodies = (*self.free, *self.prescribed)
        names = [*(body.name for body in bodies), "ground"]
        places = [np.asarray(b.position if b.motion is None else b.motion.place(0.0), float) for b in bodies]
        places.append(np.zeros(3))

        def point(body: str, local: tuple[float, float]) -> list[float]:
            x, y, angle = places[names.index(body)]
            c, s = np.cos(angle), np.sin(angle)
            return [x + c * local[0] - s * local[1], y + s * local[0] + c * local[1]]

        return MemberEnds(
            body_a=np.array([names.index(m.a) for m in self.members]),
            point_a=np.array([point(m.a, m.point_a) for m in self.members]),
            body_b=np.array([names.index(m.b) for m in self.members]),
            point_b=np.array([point(m.b, m.point_b) for m in self.members]),
        )

    def coordinate(self, body: str) -> slice:
        """Where the coordinates of a free body stand in q.

        Raises ValueError when there is no free body of that name.
        """
        for index, part in enumerate(self.free):
            if part.name == body:
                return slice(3 * index, 3 * index + 3)
        raise ValueError(
            f"system has no free body '{body}'; free bodies are {', '.join(part.name for part in self.free)}"
        )

    def density(self, value: float) -> Array:
        """(N,) the same density for every member."""
        return np.full(len(self.members), float(value))
