"""A corner of the vehicle: swing arm, hub and wheel, with spring, shock, stops and brake.

Every corner hangs on one hinge along x whose place gives the axle its roll centre and its camber gain:
`swing_arm` inboard of the wheel and so high that the line from the tyre's contact through the roll centre
meets it. Wheel rates and dampers act on the hinge, times the arm squared.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin
from typing import Any

import numpy as np

from workbench.engine import (
    CoordinateDamper,
    CoordinateSpring,
    Prescribed,
    Revolute,
    SpatialBody,
    SpatialMotion,
)

from ..manoeuvre import Function, Manoeuvre
from ..parts import GRAVITY, Triple, triple
from .numbers import CORNERS, Axle, Payload, VehicleParameters, wheel_loads

__all__ = ["Corner", "brake", "corner_at_rest", "corner_bodies", "hinge_spring", "shock", "steered"]

SLOW_TRAVEL = 0.01  # m/s at the wheel, over which a shock turns from bump to rebound
SLOW_SPIN = 0.2  # rad/s: below it a braked wheel creeps


@dataclass(frozen=True, slots=True, kw_only=True)
class Corner:
    """A corner at rest: side +1 left; hinge and wheel centre in the vehicle's frame; angle upwards, rad."""

    name: str
    side: float
    axle: Axle
    load: float
    empty: float  # N, the load without payload
    hinge: Triple
    design: Triple
    angle: float
    preload: float  # N m, pressing the wheel down


def corner_at_rest(parameters: VehicleParameters, i: int, load: float) -> Corner:
    """A corner (number in CORNERS) at rest under a vertical load, N."""
    axle = parameters.front if i < 2 else parameters.rear
    side, geometry, masses = (1.0, -1.0)[i % 2], parameters.geometry, parameters.masses
    x, half = (0.0 if i < 2 else -geometry.wheelbase), 0.5 * geometry.track
    tyre, arm = parameters.tyre, axle.swing_arm
    empty = wheel_loads(parameters)[i]
    height = tyre.radius - empty / tyre.stiffness
    up = axle.roll_centre / half * arm - height  # of the hinge over the wheel centre
    # the payload presses the tyre: the wheel stands lower by that, turned down about its hinge
    loaded = tyre.radius - load / tyre.stiffness
    angle = 0.0
    for _ in range(8):  # contraction: the arm is a hundred times the change
        angle = (loaded * cos(angle) - height + up * (cos(angle) - 1.0)) / arm
    aside = arm * cos(angle) + up * sin(angle)  # of the wheel centre from the hinge
    weight = (masses.wheel + masses.upright) * GRAVITY
    return Corner(
        name=CORNERS[i], side=side, axle=axle, load=float(load), empty=float(empty), angle=angle,
        hinge=(x, side * (half - arm), height + up), design=(x, side * half, height),
        preload=float(load * (aside + loaded * sin(angle)) - weight * aside),
    )  # fmt: skip


def corner_bodies(
    parameters: VehicleParameters, corner: Corner, turn: SpatialMotion, speed: float
) -> list[SpatialBody]:
    """Arm, hub where it steers, and wheel."""
    masses, tyre = parameters.masses, parameters.tyre
    at = triple(np.subtract(corner.design, corner.hinge))
    arm = SpatialBody(
        name=f"{corner.name} arm",
        parent="vehicle",
        joint=Revolute(axis=(corner.side, 0.0, 0.0), angle=corner.angle),
        at=corner.hinge,
        mass=masses.upright,
        centre=at,
        inertia=masses.upright_inertia,
    )
    bodies, carrier = [arm], arm.name
    if corner.name.startswith("front"):
        hub = SpatialBody(name=f"{corner.name} hub", parent=arm.name, joint=Prescribed(motion=turn), at=at)
        bodies.append(hub)
        carrier, at = hub.name, (0.0, 0.0, 0.0)
    rolling = speed / (tyre.radius - corner.load / tyre.stiffness)
    wheel = SpatialBody(
        name=f"{corner.name} wheel",
        parent=carrier,
        joint=Revolute(axis=(0.0, 1.0, 0.0), speed=rolling),
        at=at,
        mass=masses.wheel,
        inertia=masses.wheel_inertia,
    )
    return [*bodies, wheel]


def hinge_spring(parameters: VehicleParameters, corner: Corner) -> CoordinateSpring:
    """Spring, stops and preload of a hinge, positive upwards.

    The wheel rate is that of the vertical force at the contact, which moves away from the hinge as the wheel
    rises; the hinge is stiffer by what the wheel load then turns.
    """
    axle, stops, masses = corner.axle, parameters.stops, parameters.masses
    square = axle.swing_arm**2
    up = corner.hinge[2] - corner.design[2]
    weight = (masses.wheel + masses.upright) * GRAVITY
    turning = corner.empty * corner.hinge[2] - weight * up
    return CoordinateSpring(
        body=f"{corner.name} arm", k=axle.wheel_rate * square + turning, k_stop=stops.rate * square,
        upper=stops.travel / axle.swing_arm, lower=stops.travel / axle.swing_arm,
        width=stops.width / axle.swing_arm, torque=-corner.preload,
    )  # fmt: skip


def shock(corner: Corner) -> CoordinateDamper:
    """The shock absorber, at the hinge."""
    axle, square = corner.axle, corner.axle.swing_arm**2
    return CoordinateDamper(
        body=f"{corner.name} arm", forward=axle.bump_damping * square,
        backward=axle.rebound_damping * square, slow=SLOW_TRAVEL / axle.swing_arm,
    )  # fmt: skip


def brake(
    parameters: VehicleParameters, corner: Corner, manoeuvre: Manoeuvre, payload: Sequence[Payload]
) -> CoordinateDamper:
    """Friction that slows the wheel's share of the mass, and its own spin, by what the driver asks for.

    The shares are those of the loads on level ground at that deceleration: m (load of the corner at rest)
    -+ m a h/(2 L), so all four tyres use the same part of the road's friction.
    """
    masses, geometry, tyre = parameters.masses, parameters.geometry, parameters.tyre
    m = masses.total + sum(p.mass for p in payload)
    moment = masses.total * masses.centre[2] + sum(p.mass * p.at[2] for p in payload)
    shift = (1.0 if corner.name.startswith("front") else -1.0) * moment / (2.0 * geometry.wheelbase)
    radius = tyre.radius - corner.load / tyre.stiffness
    spin = 4.0 * masses.wheel_inertia[1] / radius  # all wheels' torque per deceleration

    def friction(t: float) -> float:
        a = manoeuvre.braking(t)
        share = (corner.load + shift * a) / (m * GRAVITY)
        return a * max(share, 0.0) * (m * radius + spin)

    return CoordinateDamper(body=f"{corner.name} wheel", friction=friction, slow=SLOW_SPIN)


def steered(angle: Function) -> SpatialMotion:
    """A turn about z by an angle over time; its rates by central differences of the angle."""
    h = 1e-4

    def rate(t: float) -> float:
        return (8.0 * (angle(t + h) - angle(t - h)) - (angle(t + 2 * h) - angle(t - 2 * h))) / (12.0 * h)

    def acceleration(t: float) -> float:
        return (8.0 * (rate(t + h) - rate(t - h)) - (rate(t + 2 * h) - rate(t - 2 * h))) / (12.0 * h)

    def rotation(t: float) -> Any:
        c, s = cos(angle(t)), sin(angle(t))
        return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))

    return SpatialMotion(
        position=lambda t: (0.0, 0.0, 0.0), rotation=rotation, velocity=lambda t: (0.0, 0.0, 0.0),
        acceleration=lambda t: (0.0, 0.0, 0.0), spin=lambda t: (0.0, 0.0, rate(t)),
        spin_rate=lambda t: (0.0, 0.0, acceleration(t)),
    )  # fmt: skip
