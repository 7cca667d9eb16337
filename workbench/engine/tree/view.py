"""The mean of some bodies' points seen from another body's frame, along the run of a tree."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from .slopes import cross

__all__ = ["SpatialView"]

Array = np.ndarray[Any, Any]
Point = tuple[str, tuple[float, ...], float]


class _Seen(NamedTuple):
    """Place and rate in the reference's axes at one node, and what their slopes need."""

    place: tuple[float, ...]
    rate: tuple[float, ...]
    node: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialView:
    """sum of share A^T (p - o): points p of bodies in the frame A, o of a reference.

    points: (body, point in its frame, share) with shares that add to 1; trajectory: a `TreeTrajectory`.
    """

    trajectory: Any
    points: tuple[Point, ...]
    reference: str

    def series(self) -> Array:
        """(steps + 1, 3) at every node."""
        key = f"seen from {self.reference}: {self.points}"
        if key not in self.trajectory.memo:
            frames = self.trajectory.frames(self.reference)
            mean = sum(share * self.trajectory.of(body, point) for body, point, share in self.points)
            place = np.einsum("tji,tj->ti", frames.axes, mean - frames.origin)
            self.trajectory.memo[key] = np.asarray(place)
        return np.asarray(self.trajectory.memo[key])

    def _at(self, node: int) -> tuple[Any, ...]:
        """Axes, spin, turns of columns, spin_q, and d, d', d_q, d'_q of the mean less the origin."""
        # the start and the last node asked for are kept: a quantity looks at both again and again
        key = f"nodes seen from {self.reference}: {self.points}"
        kept = self.trajectory.memo.setdefault(key, {})
        if node not in kept:
            for old in [old for old in kept if old]:
                del kept[old]
            motion, place = self.trajectory.motion(node), self.trajectory.place
            points = [*self.points, (self.reference, (0.0, 0.0, 0.0), -1.0)]
            mean = motion.mean(
                [place(body) for body, _, _ in points],
                np.array([point for _, point, _ in points], float),
                np.array([share for _, _, share in points]),
            )
            kept[node] = (*motion.frame(place(self.reference)), *mean)
        return tuple(kept[node])

    def seen(self, node: int) -> _Seen:
        """The view and its rate A^T (d' - w x d) at a node."""
        axes, spin, _, _, d, rate, _, _ = self._at(node)
        place, speed = axes.T @ d, axes.T @ (rate - cross(spin, d))
        return _Seen(tuple(place.tolist()), tuple(speed.tolist()), node)

    def rates(self, nodes: Array) -> Array:
        """(len(nodes), 3) rate of the series A^T (d' - w x d) at some nodes."""
        base = self.trajectory.frames(self.reference, nodes)
        d, rate = -base.origin, -base.velocity
        for body, point, share in self.points:
            frames = self.trajectory.frames(body, nodes)
            arm = frames.axes @ np.asarray(point, float)
            d = d + share * (frames.origin + arm)
            rate = rate + share * (frames.velocity + cross(frames.spin, arm))
        return np.asarray(np.einsum("tji,tj->ti", base.axes, rate - cross(base.spin, d)))

    def chain(self, seen: _Seen, by_place: Sequence[float], by_rate: Sequence[float]) -> tuple[Array, Array]:
        """(n,) slopes by position and velocity of a scalar with the given slopes by place and rate."""
        axes, spin, turns, spin_q, d, rate, d_q, rate_q = self._at(seen.node)
        p, r = axes @ np.asarray(by_place, float), axes @ np.asarray(by_rate, float)
        speed = rate - cross(spin, d)
        speed_q = rate_q - cross(spin_q, d) - cross(spin, d_q)
        by_q = (d_q - cross(turns, d)) @ p + (speed_q - cross(turns, speed)) @ r
        by_v = (d_q - cross(turns, d)) @ r
        return by_q, by_v

    def jacobian(self) -> Array:
        """(steps + 1, 3, n) derivatives of the series by the coordinates."""
        out = []
        for node in range(len(self.trajectory.times)):
            axes, _, turns, _, d, _, d_q, _ = self._at(node)
            out.append(((d_q - cross(turns, d)) @ axes).T)
        return np.array(out)
