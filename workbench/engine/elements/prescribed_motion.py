"""Prescribed motions of a body: position, velocity and acceleration as functions of time."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from .samples_kept import sampled_once

__all__ = ["Motion", "motion_from_acceleration"]

Array = np.ndarray[Any, Any]
Planar = Callable[[float], Any]  # t -> (x, y, theta)

DIFFERENCE = 1e-4  # s; fourth-order differences of a user's position lose about 1e-11 relative


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, weakref_slot=True)
class Motion:
    """(x, y, theta) of a driven body as a function of time, with its two derivatives.

    Functions of time alone: what was sampled once on a grid is not asked for again, as in many cases of one
    motion.

    Give velocity and acceleration where you can; otherwise they are taken by fourth-order central differences
    of the position over 1e-4 s.

    >>> Motion(position=lambda t: (17.0 * t, 0.0, 0.0), velocity=lambda t: (17.0, 0.0, 0.0)).speed(0.3)
    array([17.,  0.,  0.])
    """

    position: Planar
    velocity: Planar | None = None
    acceleration: Planar | None = None

    def place(self, t: float) -> Array:
        """(3,) position and angle at time t."""
        return np.asarray(self.position(t), float)

    def speed(self, t: float) -> Array:
        """(3,) velocity at time t."""
        return np.asarray(self.velocity(t), float) if self.velocity else _slope(self.place, t)

    def sampled(self, times: Array) -> Array:
        """(k, 2, 3) position and velocity at the times (k,), the numbers of `place` and `speed`.

        Read-only, and kept for the next run on the same grid. Plain tuples go into one array: a small array
        for every sample costs more than a motion does.

        >>> Motion(position=lambda t: (17.0 * t, 0.0, 0.0)).sampled(np.array([0.0, 2.0]))[:, 0, 0]
        array([ 0., 34.])
        """
        return sampled_once(_SAMPLES.setdefault(self, {}), times, self._sampled)

    def _sampled(self, times: Array) -> Array:
        moments = times.tolist()
        found = np.empty((len(moments), 2, 3))
        found[:, 0] = np.array([self.position(t) for t in moments], dtype=float)
        speed = self.velocity or self.speed
        found[:, 1] = np.array([speed(t) for t in moments], dtype=float)
        found.flags.writeable = False
        return found

    def push(self, t: float) -> Array:
        """(3,) acceleration at time t."""
        if self.acceleration:
            return np.asarray(self.acceleration(t), float)
        return _slope(self.speed, t)


_SAMPLES: WeakKeyDictionary[Motion, dict[bytes, Array]] = WeakKeyDictionary()


def _slope(f: Callable[[float], Array], t: float) -> Array:
    h = DIFFERENCE
    return (8.0 * (f(t + h) - f(t - h)) - (f(t + 2 * h) - f(t - 2 * h))) / (12.0 * h)


def motion_from_acceleration(
    times: Array, acceleration: Array, *, position: Any = (0.0, 0.0, 0.0), velocity: Any = (0.0, 0.0, 0.0)
) -> Motion:
    """A motion from samples of the acceleration, linear between them, integrated exactly.

    Args:    times: (k,) increasing, s    acceleration: (k, 3)    position, velocity: at times[0]

    Before times[0] and after times[-1] the end accelerations go on.

    >>> m = motion_from_acceleration(np.array([0.0, 1.0]), np.array([[2.0, 0, 0], [2.0, 0, 0]]))
    >>> m.place(1.0)
    array([1., 0., 0.])
    """
    times = np.asarray(times, float)
    a = np.asarray(acceleration, float).reshape(len(times), 3)
    if len(times) < 2 or (np.diff(times) <= 0.0).any():
        raise ValueError("motion needs at least two increasing times for its acceleration samples")
    h = np.diff(times)[:, None]
    slope = np.diff(a, axis=0) / h
    v = np.vstack([np.asarray(velocity, float), np.zeros((len(h), 3))])
    x = np.vstack([np.asarray(position, float), np.zeros((len(h), 3))])
    for i in range(len(h)):
        v[i + 1] = v[i] + h[i] * (a[i] + 0.5 * h[i] * slope[i])
        x[i + 1] = x[i] + h[i] * (v[i] + h[i] * (0.5 * a[i] + h[i] * slope[i] / 6.0))

    def at(t: float) -> tuple[int, float, Array]:
        i = int(np.clip(np.searchsorted(times, t, side="right") - 1, 0, len(times) - 1))
        inside = 0 <= i < len(slope) and t >= times[0]
        return i, t - times[i], slope[i] if inside else np.zeros(3)

    def place(t: float) -> Array:
        i, s, b = at(t)
        return np.asarray(x[i] + s * (v[i] + s * (0.5 * a[i] + s * b / 6.0)))

    def speed(t: float) -> Array:
        i, s, b = at(t)
        return np.asarray(v[i] + s * (a[i] + 0.5 * s * b))

    def push(t: float) -> Array:
        i, s, b = at(t)
        return np.asarray(a[i] + s * b)

    return Motion(position=place, velocity=speed, acceleration=push)
