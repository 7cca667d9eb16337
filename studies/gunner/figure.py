"""The gunner's figure: 17 bodies on 34 joint coordinates, held up in its posture by constant torques.

All bodies' frames are parallel to the vehicle's in the posture, and lie at the joint to the parent (lower
torso: midway between the hips). TX turns about the axis to the left, positive where a hanging segment swings
back: shoulder and elbow stretch, hip stretches, knee bends, the toe goes down. TZ turns about the axis that
points forward on a hanging limb, positive outwards. A joint of spine or neck is three turns in a row, about
the left, the forward and the long axis, on a carrier without mass.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from math import cos, pi, sin
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from workbench.engine import CoordinateSpring, Floating, Revolute, SpatialBody, Universal

from .figure_numbers import JOINTS, Joints, Numbers, Posture, Segment
from .parts import GRAVITY, Parts, Triple, triple

__all__ = ["CARRIERS", "FIGURE", "Start", "centre_of_mass", "figure", "supports"]

Array = np.ndarray[Any, Any]
Start = Literal["balanced", "torque-free", "settled"]
STARTS = ("balanced", "torque-free", "settled")

LEFT, FORWARD, UP = np.eye(3)[1], np.eye(3)[0], np.eye(3)[2]
SIDES = MappingProxyType({"left": 1.0, "right": -1.0})
LIMBS = ("upper arm", "forearm", "hand", "thigh", "shank", "foot")
FIGURE = (
    "lower torso", "central torso", "upper torso", "neck", "head",
    *(f"{side} {limb}" for side in SIDES for limb in LIMBS),
)  # fmt: skip
CARRIERS = ("lumbar", "thoracic", "cervical", "atlas")  # the joints below the bodies 1 to 4


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A body of the figure where it stands; places from the hip, m."""

    parent: str
    at: Array
    mass: float
    centre: Array  # from `at`
    inertia: Array  # (3, 3) about the centre, the vehicle's axes


@dataclass(frozen=True, slots=True, kw_only=True)
class Turn:
    """A coordinate of a joint: its axis, and what acts in it."""

    body: str
    coordinate: int
    carries: str
    axis: Array
    k: float
    c: float
    stops: tuple[float, float]  # back, forth


def hanging(degrees: float) -> Array:
    """Direction of a segment that points so far forward of down."""
    a = degrees * pi / 180.0
    return np.array([sin(a), 0.0, -cos(a)])


def limb(parent: str, at: Array, segment: Segment, along: Array) -> Piece:
    """A segment that points along a direction in the fore-aft plane."""
    axes = np.column_stack([np.cross(LEFT, -along), LEFT, -along])
    return Piece(
        parent=parent, at=at, mass=segment.mass, centre=segment.centre * segment.length * along,
        inertia=axes @ np.diag(segment.inertia) @ axes.T,
    )  # fmt: skip


def trunk(parent: str, at: Array, segment: Segment) -> Piece:
    """An upright segment whose centre counts from its upper end."""
    return Piece(
        parent=parent, at=at, mass=segment.mass, centre=(1.0 - segment.centre) * segment.length * UP,
        inertia=np.diag(segment.inertia),
    )  # fmt: skip


@lru_cache(maxsize=64)
def pieces(numbers: Numbers) -> Mapping[str, Piece]:
    """The 17 bodies in the posture, parents first; the same objects for the same numbers."""
    f = numbers.figure
    xiphoid = f.lower_torso.length + f.central_torso.length
    found = {
        "lower torso": trunk("", np.zeros(3), f.lower_torso),
        "central torso": trunk("lower torso", f.lower_torso.length * UP, f.central_torso),
        "upper torso": trunk("central torso", xiphoid * UP, f.upper_torso),
        **head_and_neck(numbers, (xiphoid + f.upper_torso.length) * UP),
    }
    for side, sign in SIDES.items():
        found |= {f"{side} {name}": piece for name, piece in limbs(numbers, side, sign).items()}
    for piece in found.values():
        for shared in (piece.at, piece.centre, piece.inertia):
            shared.setflags(write=False)
    return MappingProxyType(found)


def head_and_neck(numbers: Numbers, at: Array) -> dict[str, Piece]:
    """Both parted: the neck is a cylinder, the head what remains of mass, centre and inertia."""
    whole, neck = trunk("upper torso", at, numbers.figure.head_and_neck), numbers.figure.neck
    mass = neck.share * whole.mass
    low = 0.5 * neck.length * UP
    high = (whole.mass * whole.centre - mass * low) / (whole.mass - mass)
    across = mass * (3.0 * neck.radius**2 + neck.length**2) / 12.0
    own = np.diag([across, across, 0.5 * mass * neck.radius**2])
    apart = mass * (whole.mass - mass) / whole.mass * float((high - low) @ (high - low))
    rest = whole.inertia - own - apart * np.diag([1.0, 1.0, 0.0])
    if np.diag(rest).min() <= 0.0:
        raise ValueError(f"the neck leaves the head no inertia: share {neck.share}, length {neck.length} m")
    joint = at + neck.length * UP
    return {
        "neck": Piece(parent="upper torso", at=at, mass=mass, centre=low, inertia=own),
        "head": Piece(
            parent="neck", at=joint, mass=whole.mass - mass, centre=high - neck.length * UP, inertia=rest,
        ),
    }  # fmt: skip


def limbs(numbers: Numbers, side: str, sign: float) -> dict[str, Piece]:
    """An arm and a leg."""
    f, p = numbers.figure, numbers.posture
    shoulder = p.shoulder_height * UP + sign * p.shoulder_half_width * LEFT
    hip = sign * p.hip_half_width * LEFT
    upper, fore = hanging(p.upper_arm), hanging(p.upper_arm + p.elbow)
    thigh, shank = hanging(p.thigh), hanging(p.thigh - p.knee)
    elbow = shoulder + f.upper_arm.length * upper
    knee = hip + f.thigh.length * thigh
    return {
        "upper arm": limb("upper torso", shoulder, f.upper_arm, upper),
        "forearm": limb(f"{side} upper arm", elbow, f.forearm, fore),
        "hand": limb(f"{side} forearm", elbow + f.forearm.length * fore, f.hand, fore),
        "thigh": limb("lower torso", hip, f.thigh, thigh),
        "shank": limb(f"{side} thigh", knee, f.shank, shank),
        "foot": limb(f"{side} shank", knee + f.shank.length * shank, f.foot, FORWARD),
    }


def turns(numbers: Numbers, factors: dict[str, float], unit: str) -> list[Turn]:
    """The 28 coordinates of the joints."""
    spine, joints, p = numbers.spine, numbers.joints, numbers.posture
    now, seated = p.turns(), numbers.seated.turns()
    further = {joint: now[joint] - seated[joint] for joint in now}
    found = []
    for carrier, body in zip(CARRIERS, FIGURE[1:5], strict=True):
        torso = carrier in CARRIERS[:2]
        k = spine.torso_stiffness if torso else spine.neck_stiffness
        c = spine.torso_damping if torso else spine.neck_damping
        for i, (name, axis) in enumerate(((carrier, LEFT), (carrier, FORWARD), (body, UP))):
            found.append(Turn(
                body=name, coordinate=i % 2, carries=body, axis=axis, k=k, c=c,
                stops=spine.flexion_stops if i == 0 else spine.other_stops,
            ))  # fmt: skip
    for side, sign in SIDES.items():
        for name, of, coordinate, axis in (
            ("shoulder_tx", "upper arm", 0, LEFT),
            ("shoulder_tz", "upper arm", 1, sign * outward(p.upper_arm)),
            ("elbow", "forearm", 0, LEFT),
            ("wrist_tx", "hand", 0, LEFT),
            ("hip_tx", "thigh", 0, LEFT),
            ("hip_tz", "thigh", 1, sign * outward(p.thigh)),
            ("knee", "shank", 0, LEFT),
            ("ankle", "foot", 0, LEFT),
        ):
            body = f"{side} {of}"
            found.append(Turn(
                body=body, coordinate=coordinate, carries=body, axis=axis,
                k=joints.rate(name, unit) * factors.get(name, 1.0), c=joints.damping,
                stops=joints.stop(name, further.get(name, 0.0)),
            ))  # fmt: skip
    return found


def outward(degrees: float) -> Array:
    """The axis TZ of the left side for a limb so far forward of hanging."""
    return np.cross(LEFT, -hanging(degrees))


def figure(
    numbers: Numbers, *, start: Start = "balanced", factors: dict[str, float] | None = None,
    joint_unit: str = "N.mm/rad", velocity: Triple = (0.0, 0.0, 0.0), origin: Triple = (0.0, 0.0, 0.0),
) -> Parts:  # fmt: skip
    """Bodies and joint springs of the gunner in his posture.

    start: "balanced", a constant torque in every joint against the weight of what it carries; "torque-free"
        and "settled", all springs at rest in the posture (`cases` then lets him sink onto seat and hands).
    factors: of the stiffness of the joints of Table 8.6, both sides.
    velocity: m/s. origin: of the vehicle's frame at the start, m.

    Raises ValueError for a start, a unit or a joint that there is not.
    """
    if start not in STARTS:
        raise ValueError(f"start needs one of {', '.join(STARTS)}, got '{start}'")
    factors = {} if factors is None else factors
    unknown = sorted(set(factors) - set(JOINTS))
    if unknown:
        raise ValueError(f"factors needs joints among {', '.join(JOINTS)}, got {', '.join(unknown)}")
    body = pieces(numbers)
    carrier = dict(zip(FIGURE[1:5], CARRIERS, strict=True))
    here = np.asarray(origin) + np.asarray(numbers.posture.hip)
    bodies: list[SpatialBody] = []
    for name, piece in body.items():
        at = piece.at - (body[piece.parent].at if piece.parent else piece.at)
        own: dict[str, Any] = {
            "name": name, "mass": piece.mass, "centre": triple(piece.centre), "inertia": piece.inertia,
        }  # fmt: skip
        if name in carrier:
            spread = Universal(axes=(triple(LEFT), triple(FORWARD)))
            bodies.append(SpatialBody(name=carrier[name], parent=piece.parent, at=triple(at), joint=spread))
            bodies.append(SpatialBody(parent=carrier[name], joint=Revolute(axis=triple(UP)), **own))
        elif not piece.parent:
            free = Floating(position=triple(here), velocity=velocity)
            bodies.append(SpatialBody(joint=free, **own))
        else:
            joint = joint_of(name, numbers.posture)
            bodies.append(SpatialBody(parent=piece.parent, at=triple(at), joint=joint, **own))
    borne = supports(numbers, start)
    return Parts(
        bodies=tuple(bodies),
        springs=tuple(spring(t, numbers, body, borne, start) for t in turns(numbers, factors, joint_unit)),
    )


def joint_of(name: str, posture: Posture) -> Universal | Revolute:
    """The joint of a limb's segment."""
    side, of = name.split(" ", 1)
    if of in ("upper arm", "thigh"):
        degrees = posture.upper_arm if of == "upper arm" else posture.thigh
        return Universal(axes=(triple(LEFT), triple(SIDES[side] * outward(degrees))))
    return Revolute(axis=triple(LEFT))


def spring(
    turn: Turn, numbers: Numbers, body: Mapping[str, Piece], borne: dict[str, Triple], start: Start
) -> CoordinateSpring:
    """Spring, damper, stops and the constant torque that leaves the posture in balance on what is borne."""
    at, joints = body[turn.carries].at, numbers.joints
    push = GRAVITY * numbers.figure.mass / len(borne)
    moment = np.zeros(3)
    for name in beyond(turn.carries, body):
        piece = body[name]
        moment += of_upward(-GRAVITY * piece.mass, piece.at + piece.centre - at)
        if name in borne:
            moment += of_upward(push, piece.at + np.asarray(borne[name]) - at)
    back, forth = turn.stops
    return CoordinateSpring(
        body=turn.body, coordinate=turn.coordinate, k=turn.k, c=turn.c, rest=0.0, k_stop=joints.stop_rate,
        lower=back, upper=forth, width=joints.stop_width,
        torque=pressed(joints, turn.stops) - (float(turn.axis @ moment) if start == "balanced" else 0.0),
    )  # fmt: skip


def of_upward(force: float, arm: Array) -> Array:
    """The moment of an upward force, N m."""
    return np.array([arm[1] * force, -arm[0] * force, 0.0])


def pressed(joints: Joints, stops: tuple[float, float]) -> float:
    """What holds against the soft stops in the posture, N m."""
    back, forth = (joints.stop_width * np.log1p(np.exp(-a / joints.stop_width)) for a in stops)
    return float(joints.stop_rate * (forth - back))


def beyond(name: str, body: Mapping[str, Piece]) -> list[str]:
    """A body and all that hang on it."""
    return [name, *(x for child, p in body.items() if p.parent == name for x in beyond(child, body))]


def centre_of_mass(numbers: Numbers) -> Array:
    """Of the whole figure in the posture, from the hip, m."""
    body = pieces(numbers).values()
    return np.asarray(sum(p.mass * (p.at + p.centre) for p in body) / sum(p.mass for p in body))


def supports(numbers: Numbers, start: Start) -> dict[str, Triple]:
    """Which bodies carry an equal share of the weight each, and where, in their frames.

    Seated: the lower torso, below the mass centre or, where no torques hold the joints, midway between the
    hips. Standing: both feet, below the mass centre.
    """
    middle = float(centre_of_mass(numbers)[0])
    if numbers.posture == numbers.seated:
        return {"lower torso": (middle if start == "balanced" else 0.0, 0.0, 0.0)}
    feet = [f"{side} foot" for side in SIDES]
    body = pieces(numbers)
    return {foot: (middle - float(body[foot].at[0]), 0.0, 0.0) for foot in feet}
