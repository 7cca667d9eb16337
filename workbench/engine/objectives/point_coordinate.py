"""Scalars of spatial trajectories, for the objectives."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory
from .quantities import Slopes

__all__ = ["PointCoordinate"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class PointCoordinate:
    """A component of a free point's position (or of a unit vector) along a fixed direction: n . p, m.

    relative: subtract the value at the start.

    >>> PointCoordinate(point="P3", direction=(0.0, 1.0, 0.0)).relative
    False
    """

    point: str
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0)
    relative: bool = False
    has_rates: bool = True

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) n . p at every node."""
        series = trajectory.of(self.point) @ np.array(self.direction)
        return np.asarray(series - series[0] if self.relative else series)

    def _slope(self, trajectory: AnyTrajectory) -> Array:
        out = np.zeros(trajectory.position.shape[1])
        part = trajectory.coordinate(self.point)
        if part is not None:
            out[part] = self.direction
        return out

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) n . v."""
        return np.asarray(trajectory.velocity[nodes] @ self._slope(trajectory))

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of n . p at a node."""
        return Slopes(position=self._slope(trajectory))

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of n . v at a node."""
        return Slopes(velocity=self._slope(trajectory))
