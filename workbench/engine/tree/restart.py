"""A tree that starts elsewhere: the joints' coordinates at the start replaced, everything else as it was."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import AssemblyError
from .compiled import TreeCompiled, tree_on_grid, tree_opened
from .joints import (
    Cylindrical,
    Floating,
    Joint,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
)
from .loops.closing import LEFT, nearest, opening
from .system import SpatialBody, TreeSystem

__all__ = ["close_loops", "restarted"]

Array = np.ndarray[Any, Any]


def restarted(system: TreeSystem, position: Array, velocity: Array | None = None) -> TreeSystem:
    """The system with its joints at `position` (nq,) and `velocity` (n,), at rest if None.

    Natural lengths and rests that were taken from the old start become numbers, so the forces stay what they
    were. The orientation at rest of a `SphericalSpring` stays too.
    """
    parts = tree_opened(system)
    q = np.asarray(position, float)
    v = np.zeros(len(parts.arrays["column"])) if velocity is None else np.asarray(velocity, float)
    lengths = np.empty(len(system.members))
    lengths[parts.order] = parts.arrays["geometry"][6]
    rests, pulls = parts.arrays["spring"][2], parts.arrays["coupling"][:, 2]
    turns = parts.arrays["ball_rest"]
    return replace(
        system,
        bodies=_bodies(parts, q, v),
        cuts=parts.cuts,
        members=tuple(
            replace(member, natural_length=float(length))
            for member, length in zip(system.members, lengths, strict=True)
        ),
        springs=tuple(replace(s, rest=float(r)) for s, r in zip(system.springs, rests, strict=True)),
        couplings=tuple(replace(s, rest=float(r)) for s, r in zip(system.couplings, pulls, strict=True)),
        spherical_springs=tuple(
            replace(s, rest=_four(r)) for s, r in zip(system.spherical_springs, turns, strict=True)
        ),
    )


def close_loops(system: TreeSystem, *, held: Sequence[tuple[str, int]] = ()) -> TreeSystem:
    """The system with its joints moved, as little as it takes, to where all cut joints close and stay closed.

    held: coordinates (body, number) whose place and speed stay as given, such as a crank's; number counts the
    velocities of the joint. Raises AssemblyError with the cut joint that stays open.
    """
    parts = tree_opened(system)
    if not parts.cuts:
        return system
    columns = [parts.columns[body].start + coordinate for body, coordinate in held]
    found = nearest(parts, tree_on_grid, np.setdiff1d(np.arange(len(parts.arrays["column"])), columns))
    for sizes, units, verb in (
        (found.after[0], ("m", "rad"), "stays open"), (found.after[1], ("m/s", "rad/s"), "parts"),
    ):  # fmt: skip
        said = opening(parts, parts.cut_rows, sizes, LEFT, units)
        if said:
            raise AssemblyError(
                f"{said[0]} {verb} by {said[1]} whatever the joints do that are not held; mend the start or "
                "hold others",
                found.q, float(np.abs(found.q - parts.start[0]).max()),
            )  # fmt: skip
    return replace(system, bodies=_bodies(parts, found.q, found.v))


def _bodies(parts: TreeCompiled, q: Array, v: Array) -> tuple[SpatialBody, ...]:
    return tuple(
        replace(body, joint=_at(body.joint, q[parts.coordinates[body.name]], v[parts.columns[body.name]]))
        for body in parts.system.bodies
    )


def _three(x: Array) -> tuple[float, float, float]:
    a, b, c = (float(e) for e in x)
    return a, b, c


def _four(x: Array) -> tuple[float, float, float, float]:
    a, b, c, d = (float(e) for e in x)
    return a, b, c, d


def _at(joint: Joint, q: Array, v: Array) -> Joint:
    match joint:
        case Floating():
            return replace(
                joint,
                position=_three(q[:3]),
                orientation=_four(q[3:]),
                velocity=_three(v[:3]),
                spin=_three(v[3:]),
            )
        case Spherical():
            return replace(joint, orientation=_four(q), spin=_three(v))
        case Universal():
            return replace(joint, angles=(float(q[0]), float(q[1])), speeds=(float(v[0]), float(v[1])))
        case Revolute():
            return replace(joint, angle=float(q[0]), speed=float(v[0]))
        case Prismatic():
            return replace(joint, position=float(q[0]), speed=float(v[0]))
        case Cylindrical():
            return replace(
                joint, position=float(q[0]), angle=float(q[1]), speed=float(v[0]), angular_speed=float(v[1])
            )
        case Planar():
            return replace(
                joint, position=(float(q[0]), float(q[1])), angle=float(q[2]),
                velocity=(float(v[0]), float(v[1])), angular_speed=float(v[2]),
            )  # fmt: skip
        case _:
            return joint
