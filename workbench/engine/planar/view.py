"""Bodies of a planar run: their mean centre seen from another's frame, their points, and the slopes."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..integration.points import PointMotion, PointSeries
from .system import System

__all__ = ["MeanView", "columns_of", "point_motion", "point_series"]

Array = np.ndarray[Any, Any]
Columns = tuple[tuple[int, float], ...]


class _Seen(NamedTuple):
    """Position of a point seen from a reference body, at one node; pairs are vectors in its frame."""

    turn: tuple[float, float]  # cosine and sine of the reference's angle
    spin: float  # its angular velocity
    place: tuple[float, float]  # A^T d
    rate: tuple[float, float]  # its time derivative
    drift: tuple[float, float]  # A^T d'


def columns_of(
    system: System, *, bodies: tuple[str, ...], reference: str, shares: tuple[float, ...]
) -> Columns:
    """(first full coordinate, share) of every body that enters; the reference is the last, with -1.

    Raises ValueError for a body that the system does not have.
    """
    index = {body.name: i for i, body in enumerate((*system.free, *system.prescribed))}
    index["ground"] = len(index)
    for name in (*bodies, reference):
        if name not in index:
            raise ValueError(f"quantity refers to body '{name}'; bodies are {', '.join(sorted(index))}")
    total = sum(shares)
    return (
        *((3 * index[name], share / total) for name, share in zip(bodies, shares, strict=True)),
        (3 * index[reference], -1.0),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanView:
    """Mass-weighted mean of some bodies' centres, seen from a reference body (or the ground).

    columns: as from `columns_of`.
    position, velocity: (steps + 1, n).
    motion: (steps + 1, 2, k) of the prescribed bodies.
    """

    columns: Columns
    position: Array
    velocity: Array
    motion: Array

    def _angles(self) -> Array:
        at = self.columns[-1][0] + 2
        n = self.position.shape[1]
        return self.position[:, at] if at < n else self.motion[:, 0, at - n]

    def series(self) -> Array:
        """(steps + 1, 2) A^T d at every node."""
        q = np.concatenate([self.position, self.motion[:, 0]], axis=1)
        d = np.sum([share * q[:, at : at + 2] for at, share in self.columns], axis=0)
        angle = self._angles()
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0]], axis=1)

    def seen(self, node: int) -> _Seen:
        """The view and its rate at a node."""
        q = self.position[node].tolist() + self.motion[node, 0].tolist()
        v = self.velocity[node].tolist() + self.motion[node, 1].tolist()
        columns = self.columns
        dx, dy, ux, uy = (
            sum(share * x[at + k] for at, share in columns) for x, k in ((q, 0), (q, 1), (v, 0), (v, 1))
        )
        reference = columns[-1][0]
        spin = v[reference + 2]
        c, s = math.cos(q[reference + 2]), math.sin(q[reference + 2])
        x, y = c * dx + s * dy, c * dy - s * dx
        drift = c * ux + s * uy, c * uy - s * ux
        return _Seen((c, s), spin, (x, y), (drift[0] + spin * y, drift[1] - spin * x), drift)

    def rates(self, nodes: Array) -> Array:
        """(len(nodes), 2) rate of the series at some nodes."""
        return np.array([self.seen(int(node)).rate for node in nodes]).reshape(-1, 2)

    def chain(
        self, seen: _Seen, by_place: tuple[float, ...], by_rate: tuple[float, ...]
    ) -> tuple[Array, Array]:
        """(n,) slopes by position and velocity of a scalar with the given slopes by A^T d and its rate."""
        n = self.position.shape[1]
        by_q, by_v = np.zeros(n), np.zeros(n)
        (c, s), spin, (x, y), _, (u, w) = seen
        r0, r1 = by_rate
        p0, p1 = by_place[0] - spin * r1, by_place[1] + spin * r0
        for at, share in self.columns:
            if at < n:
                by_q[at] += share * (c * p0 - s * p1)
                by_q[at + 1] += share * (s * p0 + c * p1)
                by_v[at] += share * (c * r0 - s * r1)
                by_v[at + 1] += share * (s * r0 + c * r1)
        at = self.columns[-1][0]
        if at < n:
            by_q[at + 2] += by_place[0] * y - by_place[1] * x
            by_q[at + 2] += r0 * (w - spin * x) - r1 * (u + spin * y)
            by_v[at + 2] += r0 * y - r1 * x
        return by_q, by_v

    def jacobian(self) -> Array:
        """(steps + 1, 2, n) derivatives of the series by the coordinates."""
        nodes, n = self.position.shape
        series, angle = self.series(), self._angles()
        c, s = np.cos(angle), np.sin(angle)
        slopes = np.zeros((nodes, 2, n))
        for at, share in self.columns:
            if at < n:
                slopes[:, 0, at] += share * c
                slopes[:, 0, at + 1] += share * s
                slopes[:, 1, at] -= share * s
                slopes[:, 1, at + 1] += share * c
        at = self.columns[-1][0]
        if at < n:
            slopes[:, 0, at + 2] += series[:, 1]
            slopes[:, 1, at + 2] -= series[:, 0]
        return slopes


def _body(trajectory: Any, name: str) -> tuple[Array, Array, Array]:
    """(nodes, 3) position, velocity and acceleration of a body: free, prescribed or the ground."""
    times, system = trajectory.times, trajectory.system
    if name == "ground":
        still = np.zeros((len(times), 3))
        return still, still, still
    for index, body in enumerate(system.prescribed):
        if body.name == name:
            part = slice(3 * index, 3 * index + 3)
            kept = f"acceleration of '{name}'"
            if kept not in trajectory.memo:  # every point of the body asks for it
                trajectory.memo[kept] = np.array([body.motion.push(t) for t in times.tolist()])
            place, speed = (trajectory.tables.motion[:, k, part] for k in range(2))
            return place, speed, trajectory.memo[kept]
    part = system.coordinate(name)
    return trajectory.position[:, part], trajectory.velocity[:, part], trajectory.acceleration[:, part]


def point_series(trajectory: Any, body: str, point: tuple[float, ...]) -> PointSeries:
    """A body's point at every node.

        r = p + A s,   r' = v + w A^ s,   r'' = a + w' A^ s - w^2 A s,   A^ = dA/dtheta

    Raises ValueError for a body that the system does not have.
    """
    q, v, a = _body(trajectory, body)
    c, s = np.cos(q[:, 2]), np.sin(q[:, 2])
    x, y = point[0], point[1]
    arm = np.stack([c * x - s * y, s * x + c * y], axis=1)
    across = np.stack([-arm[:, 1], arm[:, 0]], axis=1)
    spin, push = v[:, 2:], a[:, 2:]
    return PointSeries(
        place=q[:, :2] + arm, velocity=v[:, :2] + spin * across,
        acceleration=a[:, :2] + push * across - spin**2 * arm,
    )  # fmt: skip


def point_motion(trajectory: Any, node: int, body: str, point: tuple[float, ...]) -> PointMotion:
    """A body's point at a node, and its slopes by the free coordinates."""
    series = trajectory.point_series(body, point)
    n = trajectory.position.shape[1]
    place_q, velocity_q, acceleration_q, acceleration_v = (np.zeros((n, 2)) for _ in range(4))
    if any(free.name == body for free in trajectory.system.free):
        first = trajectory.system.coordinate(body).start
        arm = series.place[node] - trajectory.position[node, first : first + 2]
        across = np.array([-arm[1], arm[0]])
        spin, push = trajectory.velocity[node, first + 2], trajectory.acceleration[node, first + 2]
        place_q[first : first + 2] = np.eye(2)
        place_q[first + 2] = across
        velocity_q[first + 2] = -spin * arm
        acceleration_q[first + 2] = -push * arm - spin**2 * across
        acceleration_v[first + 2] = -2.0 * spin * arm
    return PointMotion(
        place=series.place[node], velocity=series.velocity[node], acceleration=series.acceleration[node],
        place_q=place_q, velocity_q=velocity_q, acceleration_q=acceleration_q, acceleration_v=acceleration_v,
    )  # fmt: skip
