"""Joints of trees: how a body may move against its parent, with its coordinates at the start.

The joint frame is fixed to the parent (`SpatialBody.at`, `SpatialBody.axes`); at zero coordinates the body's
frame coincides with it. Velocities: of a translation along axes of the joint frame, of a spherical joint the
spin in the body's frame. SI units, radians; quaternions (w, x, y, z).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..elements.samples_kept import sampled_once

__all__ = [
    "FREEDOM", "Cylindrical", "Floating", "Joint", "Planar", "Prescribed", "Prismatic", "Revolute",
    "SpatialMotion", "Spherical", "Universal", "Welded", "sampled",
]  # fmt: skip

Array = np.ndarray[Any, Any]
Triple = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]
ZERO: Triple = (0.0, 0.0, 0.0)
STRAIGHT: Quaternion = (1.0, 0.0, 0.0, 0.0)

DIFFERENCE = 1e-4  # s: fourth-order differences of a user's position lose about 1e-11 relative


@dataclass(frozen=True, slots=True, kw_only=True)
class Floating:
    """Six free coordinates: the place of the body's frame, then its orientation."""

    position: Triple = ZERO
    orientation: Quaternion = STRAIGHT
    velocity: Triple = ZERO
    spin: Triple = ZERO


@dataclass(frozen=True, slots=True, kw_only=True)
class Spherical:
    """Free rotation about a common point."""

    orientation: Quaternion = STRAIGHT
    spin: Triple = ZERO


@dataclass(frozen=True, slots=True, kw_only=True)
class Universal:
    """A turn about axes[0] of the parent, then one about axes[1] of the body in between."""

    axes: tuple[Triple, Triple] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    angles: tuple[float, float] = (0.0, 0.0)
    speeds: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Revolute:
    """A turn about an axis."""

    axis: Triple = (0.0, 0.0, 1.0)
    angle: float = 0.0
    speed: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Prismatic:
    """A slide along an axis."""

    axis: Triple = (1.0, 0.0, 0.0)
    position: float = 0.0
    speed: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Cylindrical:
    """A slide along an axis and a turn about it; coordinates (position, angle)."""

    axis: Triple = (0.0, 0.0, 1.0)
    position: float = 0.0
    angle: float = 0.0
    speed: float = 0.0
    angular_speed: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Planar:
    """Two slides along `axes` and a turn about their normal; coordinates (x, y, angle)."""

    axes: tuple[Triple, Triple] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    position: tuple[float, float] = (0.0, 0.0)
    angle: float = 0.0
    velocity: tuple[float, float] = (0.0, 0.0)
    angular_speed: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Welded:
    """No motion against the parent."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialMotion:
    """Place and orientation of a driven body in its joint frame as functions of time alone: they are asked
    once for a grid, for all systems that one motion drives.

    position: t -> (3,) m.  rotation: t -> (3, 3), the body's axes as columns; None: it does not turn.
    velocity, acceleration, spin, spin_rate (both of the latter in the joint frame): their derivatives; those
    not given are taken by fourth-order central differences over 1e-4 s.

    >>> SpatialMotion(position=lambda t: (17.0 * t, 0.0, 0.0)).sample(0.5)[9:12]
    array([8.5, 0. , 0. ])
    """

    position: Callable[[float], Any]
    rotation: Callable[[float], Any] | None = None
    velocity: Callable[[float], Any] | None = None
    acceleration: Callable[[float], Any] | None = None
    spin: Callable[[float], Any] | None = None
    spin_rate: Callable[[float], Any] | None = None
    _kept: dict[bytes, Array] = field(default_factory=dict, init=False, compare=False, repr=False)

    def _place(self, t: float) -> Array:
        return np.asarray(self.position(t), float)

    def _turn(self, t: float) -> Array:
        return np.eye(3) if self.rotation is None else np.asarray(self.rotation(t), float)

    def _speed(self, t: float) -> Array:
        return np.asarray(self.velocity(t), float) if self.velocity else _slope(self._place, t)

    def _spin(self, t: float) -> Array:
        if self.spin is not None:
            return np.asarray(self.spin(t), float)
        if self.rotation is None:
            return np.zeros(3)
        m = _slope(self._turn, t) @ self._turn(t).T
        return 0.5 * np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])

    def sample(self, t: float) -> Array:
        """(24,) rotation by rows, place, spin, velocity, spin rate, acceleration at time t."""
        push = np.asarray(self.acceleration(t), float) if self.acceleration else _slope(self._speed, t)
        turning = np.asarray(self.spin_rate(t), float) if self.spin_rate else _slope(self._spin, t)
        return np.concatenate(
            [self._turn(t).ravel(), self._place(t), self._spin(t), self._speed(t), turning, push]
        )

    def samples(self, times: Array) -> Array:
        """(len(times), 24) of them, not to be written to."""
        return sampled_once(self._kept, times, self._sampled)

    def _sampled(self, times: Array) -> Array:
        return np.array([self.sample(t) for t in times.tolist()]).reshape(len(times), 24)


def _slope(f: Callable[[float], Array], t: float) -> Array:
    h = DIFFERENCE
    return (8.0 * (f(t + h) - f(t - h)) - (f(t + 2 * h) - f(t - 2 * h))) / (12.0 * h)


def sampled(motions: Sequence[SpatialMotion], times: Array) -> Array:
    """(len(times), motions, 24) samples."""
    if not motions:
        return np.empty((len(times), 0, 24))
    return np.stack([motion.samples(times) for motion in motions], axis=1)


@dataclass(frozen=True, slots=True, kw_only=True)
class Prescribed:
    """A joint without freedom that follows a motion over time."""

    motion: SpatialMotion


Joint = (
    Floating | Spherical | Universal | Revolute | Prismatic | Cylindrical | Planar | Welded | Prescribed
)  # fmt: skip

# velocities per joint
FREEDOM: dict[type, int] = {
    Floating: 6, Spherical: 3, Universal: 2, Revolute: 1, Prismatic: 1, Cylindrical: 2, Planar: 3, Welded: 0,
    Prescribed: 0,
}  # fmt: skip
