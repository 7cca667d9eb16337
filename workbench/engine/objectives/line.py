"""The line between two points of bodies at one node: length, rate and their slopes, for quantities along it.

    d = r_a - r_b,  l = sqrt(d.d + o^2),  u = d/l,  l' = u.d',   dl = u.dd,   dl' = u.dd' + (d' - l' u)/l . dd

o is a constant offset out of the plane.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory

__all__ = ["End", "Line", "line_at", "line_series"]

Array = np.ndarray[Any, Any]
End = tuple[str, tuple[float, ...]]

NEAR = 1e-20  # m^2: a line of no length has a direction all the same


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """Rate (m/s) of the length, and slopes (n,): of the length by position, of the rate by position.

    The rate's slope by velocity is that of the length by position.
    """

    rate: float
    length_q: Array
    rate_q: Array


def line_series(trajectory: AnyTrajectory, a: End, b: End, offset: float = 0.0) -> tuple[Array, Array]:
    """(steps + 1,) length, m, and its rate between two points (body, point in its frame)."""
    near, far = trajectory.point_series(*a), trajectory.point_series(*b)
    d, u = near.place - far.place, near.velocity - far.velocity
    length = np.sqrt((d * d).sum(axis=1) + offset**2 + NEAR)
    return length, (d * u).sum(axis=1) / length


def line_at(trajectory: AnyTrajectory, node: int, a: End, b: End, offset: float = 0.0) -> Line:
    """The line at a node."""
    near, far = trajectory.point_motion(node, *a), trajectory.point_motion(node, *b)
    d, g = near.place - far.place, near.velocity - far.velocity
    length = float(np.sqrt(d @ d + offset**2 + NEAR))
    u = d / length
    rate = float(u @ g)
    place_q, velocity_q = near.place_q - far.place_q, near.velocity_q - far.velocity_q
    return Line(
        rate=rate, length_q=place_q @ u, rate_q=velocity_q @ u + place_q @ ((g - rate * u) / length)
    )  # fmt: skip
