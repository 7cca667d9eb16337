"""Points of bodies along a run of any kind: their series, and at one node how they move with the state."""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

__all__ = ["PointMotion", "PointSeries"]

Array = np.ndarray[Any, Any]


class PointSeries(NamedTuple):
    """A point of a body at every node, (steps + 1, 2 or 3) each, global axes."""

    place: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMotion:
    """A point of a body at one node, global axes; slopes are (n, 2 or 3).

    place_q is also the slope of the velocity by v and of the acceleration by the joints' accelerations.
    """

    place: Array
    velocity: Array
    acceleration: Array
    place_q: Array
    velocity_q: Array
    acceleration_q: Array
    acceleration_v: Array
