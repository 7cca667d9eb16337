"""Parts of a spatial system that are built apart and joined: a vehicle, a gunner, restraints."""

from dataclasses import dataclass, fields
from typing import Any

from workbench.engine import (
    CoordinateDamper,
    CoordinateSpring,
    Coupling,
    SpatialBody,
    SpatialBushing,
    SpatialContact,
    SpatialLoad,
    SpatialMember,
    SphericalSpring,
    TreeSystem,
    Tyre,
)

__all__ = ["GRAVITY", "Parts", "Triple", "joined", "triple"]

Triple = tuple[float, float, float]
GRAVITY = 9.81  # m/s^2, the engine's


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Some of the bodies and forces of a `TreeSystem`; a body may hang on one of other parts, by name.

    >>> from workbench.engine import Prismatic
    >>> joined(Parts(bodies=(SpatialBody(name="cart", joint=Prismatic(), mass=1.0),)), Parts()).size
    1
    """

    bodies: tuple[SpatialBody, ...] = ()
    members: tuple[SpatialMember, ...] = ()
    bushings: tuple[SpatialBushing, ...] = ()
    contacts: tuple[SpatialContact, ...] = ()
    tyres: tuple[Tyre, ...] = ()
    springs: tuple[CoordinateSpring, ...] = ()
    dampers: tuple[CoordinateDamper, ...] = ()
    spherical_springs: tuple[SphericalSpring, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    loads: tuple[SpatialLoad, ...] = ()


def joined(*parts: Parts) -> TreeSystem:
    """One system of all parts, in the order given; raises InvalidSystem where a body they name is missing."""
    together = {
        field.name: tuple(item for part in parts for item in getattr(part, field.name))
        for field in fields(Parts)
    }
    return TreeSystem(**together)


def triple(x: Any) -> Triple:
    """Three plain numbers."""
    a, b, c = (float(e) for e in x)
    return a, b, c
