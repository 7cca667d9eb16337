"""The vehicle put together: a sprung body, four corners, anti-roll bars, tyres, and what strikes the ground.

The preload of each hinge balances the wheel load of the vehicle at rest, payload included, so every run
starts in equilibrium. Axes: x forward, y left, z up; the body "vehicle" has its origin on the ground under
the front axle at rest.
"""

from collections.abc import Sequence
from functools import lru_cache
from math import radians

import numpy as np

from workbench.engine import Coupling, Floating, Plane, SpatialBody, SpatialContact, SpatialMotion, Tyre

from ..manoeuvre import Function, Ground, Manoeuvre
from ..parts import Parts, triple
from .corners import Corner, brake, corner_at_rest, corner_bodies, hinge_spring, shock, steered
from .numbers import Payload, VehicleParameters, wheel_loads

__all__ = ["road_wheel_angle", "vehicle"]


def road_wheel_angle(parameters: VehicleParameters, manoeuvre: Manoeuvre) -> Function:
    """t -> angle of the front wheels, rad: the steering wheel's over the ratio, ended at the lock."""
    steering = parameters.steering
    lock = radians(steering.lock)
    return lambda t: min(max(manoeuvre.steering(t) / steering.ratio, -lock), lock)


@lru_cache(maxsize=16)
def front_wheels(parameters: VehicleParameters, manoeuvre: Manoeuvre) -> SpatialMotion:
    """How both front wheels turn: one motion, and its samples, for all cases of one turn."""
    return steered(road_wheel_angle(parameters, manoeuvre))


def vehicle(
    parameters: VehicleParameters,
    ground: Ground,
    manoeuvre: Manoeuvre,
    *,
    payload: Sequence[Payload] = (),
) -> Parts:
    """The vehicle on a ground in a manoeuvre, at rest on its springs and rolling straight on.

    payload: what hangs on the body "vehicle" by forces of other parts (the gunner), for the preloads only.
    """
    masses, tyre = parameters.masses, parameters.tyre
    corners = [corner_at_rest(parameters, i, load) for i, load in enumerate(wheel_loads(parameters, payload))]
    unsprung = masses.wheel + masses.upright
    sprung = masses.total - 4.0 * unsprung
    wheels = sum(unsprung * np.asarray(corner.design) for corner in corners)
    centre = (masses.total * np.asarray(masses.centre) - wheels) / sprung
    body = SpatialBody(
        name="vehicle",
        joint=Floating(velocity=(manoeuvre.speed, manoeuvre.drift, 0.0)),
        mass=sprung,
        centre=triple(centre),
        inertia=masses.sprung_inertia,
    )
    bodies, springs, tyres, dampers = [body], [], [], []
    turn = front_wheels(parameters, manoeuvre)
    for corner in corners:
        bodies += corner_bodies(parameters, corner, turn, manoeuvre.speed)
        springs.append(hinge_spring(parameters, corner))
        dampers += [shock(corner), brake(parameters, corner, manoeuvre, payload)]
        tyres.append(
            Tyre(
                body=f"{corner.name} wheel",
                radius=tyre.radius,
                stiffness=tyre.stiffness,
                damping=tyre.damping,
                nominal_load=corner.load,
                lateral=tyre.lateral,
                longitudinal=tyre.longitudinal,
                friction=ground.friction,
                reference_friction=tyre.reference_friction,
                relaxation=tyre.relaxation,
                rolling_resistance=tyre.rolling_resistance,
                road=ground.road,
            )
        )
    bars = tuple(
        Coupling(
            a=f"{end} left arm", b=f"{end} right arm",
            k=axle.anti_roll * (axle.swing_arm / parameters.geometry.track) ** 2,
        )
        for end, axle in (("front", parameters.front), ("rear", parameters.rear))
        if axle.anti_roll > 0.0
    )  # fmt: skip
    contacts = (*_shell(parameters), *_feet(parameters, corners, ground))
    return Parts(
        contacts=contacts,
        bodies=tuple(bodies),
        springs=tuple(springs),
        dampers=tuple(dampers),
        tyres=tuple(tyres),
        couplings=bars,
    )


def _shell(parameters: VehicleParameters) -> tuple[SpatialContact, ...]:
    """Corners of the body against the plane z = 0, for when it lies on its side."""
    shell = parameters.shell
    return tuple(
        SpatialContact(
            a="vehicle", point=(x, side * half, z), shape=Plane(), k=shell.stiffness, power=1.0,
            damping=shell.damping, width=shell.width, friction=shell.friction,
        )
        for front, rear, half, z in (shell.bumper, shell.bonnet, shell.belt, shell.roof)
        for x in (front, rear)
        for side in (1.0, -1.0)
    )  # fmt: skip


def _feet(
    parameters: VehicleParameters, corners: Sequence[Corner], ground: Ground
) -> tuple[SpatialContact, ...]:
    """A sphere at the foot of each wheel, on its suspension, against every obstacle."""
    shell, foot = parameters.shell, parameters.shell.foot
    return tuple(
        SpatialContact(
            a=f"{corner.name} arm", radius=foot, shape=shape, k=shell.stiffness, power=1.0,
            point=triple(np.subtract((*corner.design[:2], 0.0), corner.hinge)),
            damping=shell.damping, width=shell.width, friction=shell.friction,
        )
        for shape in ground.obstacles
        for corner in corners
    )  # fmt: skip
