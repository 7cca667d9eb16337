"""Which way the gunner faces: the second variant of section 9.2.

Figure 9.2 shows him turned to the side: figure, bars and seat turn together about the axis of the hatch, as
on a turret; ring, cabin and vehicle stay.
"""

from dataclasses import replace
from math import cos, radians, sin
from typing import Any

import numpy as np

from workbench.engine import Floating, SpatialBody, SpatialBushing

from ..parts import Parts, Triple, triple

__all__ = ["HATCH", "faced", "turned"]

HATCH = (-1.848, -0.041)  # m: axis of the hatch, the centre of Table C.1's columns


def faced(point: Any, degrees: float) -> Triple:
    """A place of the vehicle's frame turned about the axis of the hatch, to the left."""
    x, y, z = np.subtract(point, (*HATCH, 0.0))
    c, s = cos(radians(degrees)), sin(radians(degrees))
    return HATCH[0] + c * x - s * y, HATCH[1] + s * x + c * y, float(z)


def turned(held: Parts, degrees: float) -> Parts:
    """The gunner with what holds him, turned to the left by an angle; springs and contacts turn with him."""
    half = radians(0.5 * degrees)
    return replace(
        held, bodies=tuple(_body(body, degrees, half) for body in held.bodies),
        bushings=tuple(_bushing(bushing, degrees) for bushing in held.bushings),
    )  # fmt: skip


def _body(body: SpatialBody, degrees: float, half: float) -> SpatialBody:
    if isinstance(body.joint, Floating):
        at = faced(body.joint.position, degrees)
        joint = replace(body.joint, position=at, orientation=(cos(half), 0.0, 0.0, sin(half)))
        return replace(body, joint=joint)
    if body.parent == "vehicle":  # the shelf
        return replace(body, at=faced(body.at, degrees), axes=np.array(_axes(degrees)))
    return body


def _axes(degrees: float) -> tuple[Triple, Triple, Triple]:
    c, s = cos(radians(degrees)), sin(radians(degrees))
    return (c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


def _bushing(bushing: SpatialBushing, degrees: float) -> SpatialBushing:
    opens = None if bushing.opens is None else triple(np.array(_axes(degrees)) @ bushing.opens)
    return replace(bushing, point_b=faced(bushing.point_b, degrees), opens=opens)
