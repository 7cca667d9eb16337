"""Where the bodies of a tree are at the start, from their joints' coordinates, in plain numpy."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .joints import (
    Cylindrical,
    Floating,
    Joint,
    Planar,
    Prescribed,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
)

__all__ = ["Place", "start_frames"]

Array = np.ndarray[Any, Any]


def start_frames(bodies: Sequence[Any]) -> dict[str, tuple[Array, Array]]:
    """Axes (3, 3) as columns and origin (3,) of every body and of the ground, by name."""
    frames = {"ground": (np.eye(3), np.zeros(3))}
    by_name = {body.name: body for body in bodies}
    for body in bodies:
        way = [body]
        while way[-1].parent not in frames:
            way.append(by_name[way[-1].parent])
        for part in reversed(way):
            axes, origin = frames[part.parent]
            turn, move = _moved(part.joint)
            base = axes @ np.asarray(part.axes, float)
            frames[part.name] = (base @ turn, origin + axes @ np.asarray(part.at, float) + base @ move)
    return frames


def _turned(axis: Any, angle: float) -> Array:
    """Rotation about an axis, Rodrigues' formula."""
    x, y, z = np.asarray(axis, float) / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


def _of_quaternion(orientation: Any) -> Array:
    w, *v = np.asarray(orientation, float) / np.linalg.norm(orientation)
    x = np.array(v)
    cross = np.cross(np.eye(3), x)
    return np.asarray((w * w - x @ x) * np.eye(3) + 2.0 * np.outer(x, x) + 2.0 * w * cross)


def _moved(joint: Joint) -> tuple[Array, Array]:
    """Rotation and displacement of a joint at its start."""
    eye, zero = np.eye(3), np.zeros(3)
    match joint:
        case Floating():
            return _of_quaternion(joint.orientation), np.asarray(joint.position, float)
        case Spherical():
            return _of_quaternion(joint.orientation), zero
        case Universal():
            return _turned(joint.axes[0], joint.angles[0]) @ _turned(joint.axes[1], joint.angles[1]), zero
        case Revolute():
            return _turned(joint.axis, joint.angle), zero
        case Prismatic():
            return eye, joint.position * _unit(joint.axis)
        case Cylindrical():
            return _turned(joint.axis, joint.angle), joint.position * _unit(joint.axis)
        case Planar():
            x, y = (_unit(axis) for axis in joint.axes)
            move = joint.position[0] * x + joint.position[1] * y
            return _turned(np.cross(x, y), joint.angle), move
        case Prescribed():
            sample = joint.motion.sample(0.0)
            return sample[:9].reshape(3, 3), sample[9:12]
        case _:
            return eye, zero


def _unit(axis: Any) -> Array:
    return np.asarray(axis, float) / np.linalg.norm(axis)


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A body's frame on its link: rotation (3, 3) and position (3,) in the link's frame; link L is the
    ground."""

    link: int
    turn: Array
    at: Array
