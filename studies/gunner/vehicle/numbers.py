"""The vehicle's numbers as typed records, and what follows from them at rest."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..parameters import Number
from ..parts import GRAVITY, Triple

__all__ = [
    "CORNERS", "Axle", "Geometry", "Masses", "Payload", "Shell", "Steering", "Stops", "Tyres",
    "VehicleParameters", "wheel_loads",
]  # fmt: skip

Array = np.ndarray[Any, Any]
CORNERS = ("front left", "front right", "rear left", "rear right")


@dataclass(frozen=True, slots=True, kw_only=True)
class Masses:
    """Masses and inertias about mass centres; what is not at the wheels is sprung."""

    total: Annotated[float, Number("kg", positive=True)]
    centre: Annotated[Triple, Number("m", count=3)]
    sprung_inertia: Annotated[Triple, Number("kg m2", positive=True, count=3)]
    wheel: Annotated[float, Number("kg", positive=True)]
    upright: Annotated[float, Number("kg", least=0.0)]
    upright_inertia: Annotated[Triple, Number("kg m2", least=0.0, count=3)]
    wheel_inertia: Annotated[Triple, Number("kg m2", positive=True, count=3)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Geometry:
    """Where the wheels stand."""

    wheelbase: Annotated[float, Number("m", positive=True)]
    track: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Axle:
    """Suspension of an axle; rates and dampers of one wheel, upwards at the wheel."""

    wheel_rate: Annotated[float, Number("N/m", positive=True)]
    bump_damping: Annotated[float, Number("N s/m", least=0.0)]
    rebound_damping: Annotated[float, Number("N s/m", least=0.0)]
    roll_centre: Annotated[float, Number("m")]
    swing_arm: Annotated[float, Number("m", positive=True)]
    anti_roll: Annotated[float, Number("N m/rad", least=0.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stops:
    """Where the travel of a wheel ends, on either side."""

    travel: Annotated[float, Number("m", positive=True)]
    rate: Annotated[float, Number("N/m", least=0.0)]
    width: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Steering:
    """From the steering wheel to the road wheels, both turned by the same angle."""

    ratio: Annotated[float, Number("1", positive=True)]
    lock: Annotated[float, Number("deg", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tyres:
    """Four equal tyres: Pacejka's formula of 1989 with relaxation, a vertical spring and damper."""

    radius: Annotated[float, Number("m", positive=True)]
    stiffness: Annotated[float, Number("N/m", positive=True)]
    damping: Annotated[float, Number("N s/m", least=0.0)]
    relaxation: Annotated[float, Number("m", positive=True)]
    reference_friction: Annotated[float, Number("1", positive=True)]
    rolling_resistance: Annotated[float, Number("1", least=0.0)]
    lateral: Annotated[tuple[float, ...], Number("kN, deg", count=8)]
    longitudinal: Annotated[tuple[float, ...], Number("kN, %", count=9)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shell:
    """What strikes the ground when it rolls, and obstacles: levels of front x, rear x, half width, height."""

    bumper: Annotated[tuple[float, ...], Number("m", count=4)]
    bonnet: Annotated[tuple[float, ...], Number("m", count=4)]
    belt: Annotated[tuple[float, ...], Number("m", count=4)]
    roof: Annotated[tuple[float, ...], Number("m", count=4)]
    stiffness: Annotated[float, Number("N/m", positive=True)]
    damping: Annotated[float, Number("s/m", least=0.0)]
    friction: Annotated[float, Number("1", least=0.0)]
    width: Annotated[float, Number("m", positive=True)]
    foot: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class VehicleParameters:
    """All numbers of the vehicle; `read(VehicleParameters, "vehicle")` takes them from gunner.toml."""

    masses: Masses
    geometry: Geometry
    front: Axle
    rear: Axle
    stops: Stops
    steering: Steering
    tyre: Tyres
    shell: Shell


@dataclass(frozen=True, slots=True, kw_only=True)
class Payload:
    """Something the vehicle carries at rest: its mass, kg, and place in the vehicle's frame, m."""

    mass: float
    at: Triple


def wheel_loads(parameters: VehicleParameters, payload: Sequence[Payload] = ()) -> Array:
    """(4,) vertical tyre forces at rest, N, in the order of CORNERS.

    Both axles carry their load at the lateral place of the whole's mass centre.
    """
    masses, geometry = parameters.masses, parameters.geometry
    m = np.array([masses.total, *(p.mass for p in payload)])
    places = np.array([masses.centre, *(p.at for p in payload)])
    x, y, _ = m @ places / m.sum()
    rear = -x / geometry.wheelbase
    aside = y / geometry.track
    return GRAVITY * m.sum() * np.outer((1.0 - rear, rear), (0.5 + aside, 0.5 - aside)).ravel()
