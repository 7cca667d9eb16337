"""A planar occupant of ten segments, held by two grips, a seat and 180 candidate restraint members.

The sagittal plane of the dissertation's gunner (chapter VIII), which is the plane of braking. Frame: x
rearward, y up (the z of Table C.1), metres, origin in the vehicle; the occupant faces -x. Angles are
counter-clockwise and zero in the reference posture, so flexion of shoulder, elbow, wrist, hip and ankle is
negative and flexion of the knee is positive.

Posture and start: muscles hold the initial posture against gravity by a constant torque in every joint, and
the seat's resultant passes below the mass centre, as statics asks of a seat that carries him with the hands
off the grips. So the start is an equilibrium for any mass, stiffness and number of hands. The grips are held
from above: pulled up they open at the grip strength, pressed down they carry what an arm can push.

Sources: segments and joints as `studies/occupant_body.py` says; attachment points Tables C.1 to C.3 with
their corrected entries; the seat is assumed.
"""

import csv
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, lru_cache
from importlib.resources import files

from studies.occupant_body import CG, HIP, JOINTS, MASSES, OCCUPANT_MASS, SEGMENTS, SIDES
from workbench.engine import (
    Airbag,
    Belt,
    Body,
    Bushing,
    Impulse,
    JointSpring,
    Load,
    Member,
    Motion,
    Retractor,
    RevoluteJoint,
    System,
)

__all__ = [
    "CG",
    "JOINTS",
    "KINDS",
    "MASSES",
    "ONSET",
    "SEGMENTS",
    "Case",
    "Site",
    "braking",
    "member_sites",
    "system",
]

GRAVITY = 9.81
SPEED = 17.0  # m/s before braking
ONSET = 0.5  # s: run-in at constant speed, so that the posture settles
RAMP = 0.05  # s: smooth rise and fall of the deceleration
KINDS = ("belt", "airbag", "retractor")

GRIP = (-0.3379, 1.2901)
SEAT = (
    CG[0],
    HIP[1],
)  # where the seat's resultant acts: below the mass centre, or the occupant would tip over
ARM_PUSH = 3000.0  # N: what an arm carries when the palm is pressed on the grip (assumed)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One point of the uncertainty. Forces in N, rates in N/m, deceleration in m/s2, mass in kg.

    grip: breakaway strength of one hand. hands: hands on the grips, 0, 1 or 2. factors: multipliers of the
        joint stiffnesses by name; those of joints that act out of the plane (shoulder TZ, hip TZ) are
        accepted and without effect, since the model has no such motion. nm_joints: read Table 8.6 in N
        m/rad as printed.
    """

    grip: float = 500.0
    hands: int = 2
    factors: Mapping[str, float] = field(default_factory=dict)
    seat_rate: float = 10_000.0
    seat_cap: float = 1000.0
    deceleration: float = 7.0
    mass: float = OCCUPANT_MASS
    nm_joints: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """Where a candidate member may sit: row of Table C.3, segment and end points in the vehicle frame (m)."""

    number: int
    occupant_point: int  # of Table C.2
    vehicle_point: int  # of Table C.1
    segment: str
    on_occupant: tuple[float, float]
    on_vehicle: tuple[float, float]
    across: float  # m: lateral place of the occupant's end (y of Table C.1)
    offset: float  # m out of the plane, constant in the length
    layer: int  # 1 top .. 5 floor
    side: str


@cache
def member_sites() -> tuple[Site, ...]:
    """The 180 rows of Table C.3 on the sagittal plane, points 5 of C.1 and 1 to 3 of C.2 corrected.

    >>> sites = member_sites()
    >>> len(sites), sum(site.layer == 5 for site in sites)
    (180, 36)
    """
    vehicle = {row["point"]: row for row in _table("vehicle_points.csv")}
    occupant = {row["point"]: row for row in _table("occupant_points.csv")}
    sites = []
    for row in _table("members.csv"):
        v, o = vehicle[row["vehicle_point"]], occupant[row["gunner_point"]]
        # torso frame: x up, y forward, z left, its origin 0.268 m above the hip
        up, forward, left = (1e-3 * float(o[f"{axis}_use"]) for axis in "xyz")
        on_occupant = (HIP[0] - forward, HIP[1] + 0.268 + up)
        lateral = 0.041 - left
        sites.append(
            Site(
                number=int(row["member"]),
                occupant_point=int(row["gunner_point"]),
                vehicle_point=int(row["vehicle_point"]),
                segment=o["segment"],
                on_occupant=on_occupant,
                on_vehicle=(1e-3 * float(v["x_use"]), 1e-3 * float(v["z_use"])),
                across=lateral,
                offset=1e-3 * float(v["y_use"]) - lateral,
                layer=int(row["layer_from_top"]),
                side=o["side"],
            )
        )
    return tuple(sites)


@lru_cache(maxsize=256)  # one motion for all cases of a deceleration, which is sampled once
def braking(deceleration: float) -> Motion:
    """The vehicle: 17 m/s along -x, braked from 0.5 s with a smooth ramp until it stands."""
    hold = SPEED / deceleration - RAMP
    if hold < 0:
        raise ValueError(f"deceleration needs 0 < value <= {SPEED / RAMP:g} m/s2, got {deceleration}")
    rise, fall = ONSET, ONSET + RAMP + hold

    def ramp(t: float, order: int) -> float:
        """The smoothstep 3 s^2 - 2 s^3 over RAMP and its integrals, continued linearly."""
        if t <= 0.0:
            return 0.0  # most of the samples of a run: before the brakes, and before the vehicle stands
        s = min(t / RAMP, 1.0)
        late = max(t - RAMP, 0.0)
        if order == 0:
            return s * s * (3 - 2 * s)
        if order == 1:
            return RAMP * (s**3 - 0.5 * s**4) + late
        return RAMP**2 * (0.25 * s**4 - 0.1 * s**5) + 0.5 * RAMP * late + 0.5 * late**2

    def pulse(t: float, order: int) -> float:
        return deceleration * (ramp(t - rise, order) - ramp(t - fall, order))

    return Motion(
        position=lambda t: (-SPEED * t + pulse(t, 2), 0.0, 0.0),
        velocity=lambda t: (-SPEED + pulse(t, 1), 0.0, 0.0),
        acceleration=lambda t: (pulse(t, 0), 0.0, 0.0),
    )


def system(
    case: Case | None = None,
    *,
    kinds: tuple[str, ...] = ("belt",),
    belt: Belt | None = None,
    airbag: Airbag | None = None,
    retractor: Impulse | None = None,
    power: float = 1.0,
) -> System:
    """The occupant in the braking vehicle with 180 members of every kind in `kinds`, kind by kind.

    Densities come in the order of `kinds`: 180 for the first, 180 for the next.

    Raises:
        ValueError: an unknown kind or joint factor, hands other than 0, 1 or 2.

    >>> len(system(Case(), kinds=("belt", "airbag")).members)
    360
    """
    case = Case() if case is None else case
    if case.hands not in (0, 1, 2):
        raise ValueError(f"hands needs 0, 1 or 2, got {case.hands}")
    laws = {"belt": belt or Belt(), "airbag": airbag or Airbag(), "retractor": retractor or Retractor()}
    unknown = sorted(set(kinds) - set(laws))
    if unknown:
        raise ValueError(f"kinds needs names out of {', '.join(laws)}, got {unknown}")
    scale = case.mass / OCCUPANT_MASS
    bodies = [
        Body(
            name=name,
            mass=scale * mass,
            inertia=scale * inertia,
            position=(x, y, 0.0),
            velocity=(-SPEED, 0.0, 0.0),
        )
        for name, (mass, x, y, inertia) in SEGMENTS.items()
    ]
    bodies.append(Body(name="vehicle", motion=braking(case.deceleration)))
    return System(
        bodies=tuple(bodies),
        members=_members(tuple((kind, laws[kind]) for kind in kinds), power),
        joints=tuple(
            RevoluteJoint(a=j.a, b=j.b, point_a=_local(j.a, j.at), point_b=_local(j.b, j.at), name=name)
            for name, j in JOINTS.items()
        ),
        springs=_joint_springs(case),
        bushings=_bushings(case),
        loads=_posture(scale),
        gravity=(0.0, -GRAVITY),
    )


def _joint_springs(case: Case) -> tuple[JointSpring, ...]:
    known = {row["joint"] for row in _table("joint_stiffness.csv")}
    unknown = sorted(set(case.factors) - known)
    if unknown:
        raise ValueError(f"factors needs joints of Table 8.6 ({', '.join(sorted(known))}), got {unknown}")
    reading = 1000.0 if case.nm_joints else 1.0
    return tuple(
        JointSpring(
            a=j.a,
            b=j.b,
            k=j.stiffness * case.factors.get(name, 1.0) * (reading if name in known else 1.0),
            c=j.damping,
            rest=0.0,
            k_stop=j.stop,
            upper=j.up,
            lower=j.down,
            name=name,
        )
        for name, j in JOINTS.items()
    )


def _posture(scale: float) -> tuple[Load, ...]:
    """The muscles' torques: each joint carries the weight of all that hangs on its distal side."""
    loads = []
    for name, joint in JOINTS.items():
        torque = scale * GRAVITY * _hanging(name)
        loads += [Load(body=joint.a, torque=torque), Load(body=joint.b, torque=-torque)]
    return tuple(loads)


@cache
def _hanging(name: str) -> float:
    """First moment of what hangs on the distal side of a joint about it, kg m."""
    joint = JOINTS[name]
    return sum(SEGMENTS[part][0] * (SEGMENTS[part][1] - joint.at[0]) for part in _beyond(joint.a))


def _beyond(segment: str) -> list[str]:
    """A segment and all that hang on it, away from the lower torso."""
    return [segment, *(name for j in JOINTS.values() if j.b == segment for name in _beyond(j.a))]


def _bushings(case: Case) -> tuple[Bushing, ...]:
    """Both grips in one (2 hands), and the seat, preloaded with the weight."""
    grips = Bushing(
        a="hands",
        b="vehicle",
        point_a=_local("hands", GRIP),
        point_b=GRIP,
        k=SIDES * 50e3,
        c=SIDES * 150.0,
        cap=SIDES * case.grip,
        slip=0.05,
        release=0.10,
        hold=case.hands / SIDES,
        opens=(0.0, 1.0),
        push_cap=SIDES * ARM_PUSH,
        name="grips",
    )
    seat = Bushing(
        a="lower torso",
        b="vehicle",
        point_a=_local("lower torso", SEAT),
        point_b=SEAT,
        k=case.seat_rate,
        c=700.0,
        cap=case.seat_cap,
        slip=0.08,
        release=0.16,
        preload=(0.0, case.mass * GRAVITY),
        name="seat",
    )
    return grips, seat


@lru_cache(maxsize=32)
def _members(laws: tuple[tuple[str, Belt | Airbag | Impulse], ...], power: float) -> tuple[Member, ...]:
    """The candidates kind by kind: the same in every case, so they are made once."""
    return tuple(_member(site, law, kind, power) for kind, law in laws for site in member_sites())


def _member(site: Site, law: Belt | Airbag | Impulse, kind: str, power: float) -> Member:
    return Member(
        a=site.segment,
        b="vehicle",
        point_a=_local(site.segment, site.on_occupant),
        point_b=site.on_vehicle,
        law=law,
        offset=site.offset,
        power=power,
        name=f"{kind} {site.number}",
    )


def _local(segment: str, point: tuple[float, float]) -> tuple[float, float]:
    _, x, y, _ = SEGMENTS[segment]
    return point[0] - x, point[1] - y


@cache
def _table(name: str) -> tuple[dict[str, str], ...]:
    text = files("studies").joinpath("data", name).read_text(encoding="utf-8")
    return tuple(csv.DictReader(text.splitlines()))
