"""Bodies of a planar run seen from another: their mean centre in the other's frame, and its slopes."""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .system import System

__all__ = ["MeanView", "columns_of"]

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
