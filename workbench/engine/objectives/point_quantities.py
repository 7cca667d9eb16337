"""Points of bodies, as quantities with exact slopes: speed, distance of two, clearance to a plane."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory
from .line import line_at, line_series
from .quantities import Slopes

__all__ = ["PlaneClearance", "PointDistance", "PointSpeed"]

Array = np.ndarray[Any, Any]
Point = tuple[float, ...]

ROUND = 1e-9  # m/s under the root of a speed: at rest it has slopes too


@dataclass(frozen=True, slots=True, kw_only=True)
class PointSpeed:
    """Speed of a point of a body in global axes, m/s: |v|. point: (x, y) or (x, y, z) in the body's frame."""

    body: str
    point: Point = (0.0, 0.0, 0.0)
    has_rates: bool = False

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) |v| at every node."""
        v = trajectory.point_series(self.body, self.point).velocity
        return np.asarray(np.sqrt((v * v).sum(axis=1) + ROUND**2))

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """Raises NotSupported: the rate holds the acceleration."""
        raise NotSupported("PointSpeed has no rates; its peaks are refined through nodal values")

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives at a node."""
        p = trajectory.point_motion(node, self.body, self.point)
        u = p.velocity / np.sqrt(p.velocity @ p.velocity + ROUND**2)
        return Slopes(position=p.velocity_q @ u, velocity=p.place_q @ u)

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Raises NotSupported, as `rates`."""
        raise NotSupported("PointSpeed has no rates; its peaks are refined through nodal values")


@dataclass(frozen=True, slots=True, kw_only=True)
class PointDistance:
    """Distance of a point of one body from a point of another, m: its minimum is a clearance."""

    a: str
    b: str
    point_a: Point = (0.0, 0.0, 0.0)
    point_b: Point = (0.0, 0.0, 0.0)
    has_rates: bool = True

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) distance at every node."""
        return line_series(trajectory, (self.a, self.point_a), (self.b, self.point_b))[0]

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) its rate."""
        return line_series(trajectory, (self.a, self.point_a), (self.b, self.point_b))[1][nodes]

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives at a node."""
        line = line_at(trajectory, node, (self.a, self.point_a), (self.b, self.point_b))
        return Slopes(position=line.length_q)

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of the rate at a node."""
        line = line_at(trajectory, node, (self.a, self.point_a), (self.b, self.point_b))
        return Slopes(position=line.rate_q, velocity=line.length_q)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaneClearance:
    """Clearance of a point of a body to a fixed plane, m: n . (r - through), positive on the side of n.

    normal: any length.  through: a point of the plane, global axes. In the plane both have two numbers.
    """

    body: str
    point: Point = (0.0, 0.0, 0.0)
    normal: Point = (0.0, 0.0, 1.0)
    through: Point = (0.0, 0.0, 0.0)
    has_rates: bool = True

    def _normal(self, axes: int) -> Array:
        n = np.asarray(self.normal, float)[:axes]
        length = float(np.linalg.norm(n))
        if not length > 0.0:
            raise ValueError(f"clearance needs a normal in the space of the system, got {self.normal}")
        return np.asarray(n / length)

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) clearance at every node."""
        place = trajectory.point_series(self.body, self.point).place
        axes = place.shape[1]
        return np.asarray((place - np.asarray(self.through, float)[:axes]) @ self._normal(axes))

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) its rate."""
        velocity = trajectory.point_series(self.body, self.point).velocity[nodes]
        return np.asarray(velocity @ self._normal(velocity.shape[1]))

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives at a node."""
        place_q = trajectory.point_motion(node, self.body, self.point).place_q
        return Slopes(position=place_q @ self._normal(place_q.shape[1]))

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of the rate at a node."""
        p = trajectory.point_motion(node, self.body, self.point)
        normal = self._normal(len(p.place))
        return Slopes(position=p.velocity_q @ normal, velocity=p.place_q @ normal)
