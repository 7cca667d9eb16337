"""Joints of several coordinates as chains of joints of one, with bodies without mass in between."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from ..joints import ZERO, Cylindrical, Joint, Planar, Prismatic, Revolute, Universal
from ..system import UNIT, SpatialBody

__all__ = ["one_axis_each", "pieces"]


def pieces(joint: Joint) -> tuple[Joint, ...]:
    """Joints of one coordinate that move alike, from the parent on, at zero; the joint itself where it has
    one already or is not a chain of such.

    >>> [type(piece).__name__ for piece in pieces(Cylindrical())]
    ['Prismatic', 'Revolute']
    """
    match joint:
        case Universal():
            return tuple(Revolute(axis=axis) for axis in joint.axes)
        case Cylindrical():
            return Prismatic(axis=joint.axis), Revolute(axis=joint.axis)
        case Planar():
            x, y, z = (float(value) for value in np.cross(*joint.axes))
            return *(Prismatic(axis=axis) for axis in joint.axes), Revolute(axis=(x, y, z))
        case _:
            return (joint,)


def one_axis_each(bodies: Iterable[SpatialBody]) -> list[SpatialBody]:
    """The same tree; the new bodies between a body and its parent are called "name 1", "name 2"."""
    found = []
    for body in bodies:
        *between, last = pieces(body.joint)
        parent, at, axes = body.parent, body.at, body.axes
        for i, joint in enumerate(between, 1):
            link = SpatialBody(name=f"{body.name} {i}", parent=parent, joint=joint, at=at, axes=axes)
            found.append(link)
            parent, at, axes = link.name, ZERO, UNIT
        found.append(replace(body, parent=parent, joint=last, at=at, axes=axes))
    return found
