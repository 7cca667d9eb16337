"""How points and frames of a tree move with its coordinates at one node, for objectives.

A small motion along column S_j, a turn e and a velocity s at the origin, moves what stands behind it:

    dr = s + e x r,   dv_q = S_j x v + psi1_j,   da_q = S_j x a + psi2_j - v x psi1_j
    dv_v = S_j,       da_v = psi1_j + S'_j - v x S_j,                       da_w = S_j      (spatial vectors)
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..integration.points import PointMotion
from .compiled import Place

__all__ = ["NodeMotion", "cross"]

Array = np.ndarray[Any, Any]


def cross(a: Array, b: Array) -> Array:
    """a x b of vectors (..., 3), to the bit those of `np.cross`, which takes longer to choose its axes.

    >>> cross(np.array([1.0, 0.0, 0.0]), np.eye(3))
    array([[ 0.,  0.,  0.],
           [ 0.,  0.,  1.],
           [ 0., -1.,  0.]])
    """
    x, y, z = a[..., 0], a[..., 1], a[..., 2]
    u, v, w = b[..., 0], b[..., 1], b[..., 2]
    first = y * w - z * v
    out = np.empty((*np.shape(first), 3))
    out[..., 0], out[..., 1], out[..., 2] = first, z * u - x * w, x * v - y * u
    return out


def crossed(a: Array, b: Array) -> Array:
    """a x b of spatial motion vectors, (..., 6)."""
    turn = cross(a[..., :3], b[..., :3])
    return np.concatenate([turn, cross(a[..., :3], b[..., 3:]) + cross(a[..., 3:], b[..., :3])], axis=-1)


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeMotion:
    """Columns, twists and accelerations of all links at one node, about the origin of spatial vectors."""

    origin: Array  # (3,)
    turn: Array  # (L + 1, 3, 3)
    place: Array  # (L + 1, 3) less the origin
    columns: Array  # (n, 6)
    twist: Array  # (L + 1, 6)
    push: Array  # (L + 1, 6), gravity as an acceleration of the ground
    gravity: Array  # (3,)
    parent: Array  # (n,) link before the column's
    own: Array  # (n,) link of the column
    moves: Array  # (L + 1, n) whether a column moves a link

    def frame(self, place: Place) -> tuple[Array, Array, Array, Array]:
        """Axes (3, 3) and spin (3,) of a frame on a link, the turns e of its columns (n, 3), and spin_q
        (n, 3)."""
        link = place.link
        turns = np.where(self.moves[link][:, None], self.columns[:, :3], 0.0)
        spin_q = np.where(self.moves[link][:, None], self._twist_q(link)[:, :3], 0.0)
        return self.turn[link] @ place.turn, self.twist[link, :3], turns, spin_q

    def _twist_q(self, link: int) -> Array:
        psi1 = crossed(self.twist[self.parent], self.columns)
        return np.asarray(crossed(self.columns, self.twist[link]) + psi1)

    def mean(self, places: list[Place], points: Array, shares: Array) -> tuple[Array, Array, Array, Array]:
        """Place and velocity of the mean of points (K, 3) with shares (K,), and their slopes by q (n, 3)."""
        link = np.array([place.link for place in places])
        inside = np.array([p.at + p.turn @ x for p, x in zip(places, points, strict=True)])
        r = self.place[link] + np.einsum("kij,kj->ki", self.turn[link], inside)
        twist, s = self.twist[link], self.columns
        psi1 = crossed(self.twist[self.parent], s)
        twist_q = crossed(s, twist[:, None]) + psi1  # (K, n, 6)
        arm, w = r[:, None], twist[:, None, :3]
        dr = s[:, 3:] + cross(s[:, :3], arm)
        dv = twist_q[..., 3:] + cross(twist_q[..., :3], arm) + cross(w, dr)
        moving = shares[:, None] * self.moves[link]  # (K, n)
        velocity = twist[:, 3:] + cross(twist[:, :3], r)
        return (
            shares.sum() * self.origin + shares @ r, shares @ velocity, np.einsum("kn,kni->ni", moving, dr),
            np.einsum("kn,kni->ni", moving, dv),
        )  # fmt: skip

    def point(self, place: Place, point: Array) -> PointMotion:
        """A point given in a frame on a link."""
        link = place.link
        r = self.place[link] + self.turn[link] @ (place.at + place.turn @ point)
        twist, push = self.twist[link], self.push[link]
        s, mine = self.columns, self.moves[link][:, None]
        psi1 = crossed(self.twist[self.parent], s)
        psi2 = crossed(self.push[self.parent], s) + crossed(self.twist[self.parent], psi1)
        rate = crossed(self.twist[self.own], s)
        twist_q, push_q = crossed(s, twist) + psi1, crossed(s, push) + psi2 - crossed(twist, psi1)
        push_v = psi1 + rate - crossed(twist, s)
        w, velocity = twist[:3], twist[3:] + cross(twist[:3], r)
        dr = s[:, 3:] + cross(s[:, :3], r)
        dv = twist_q[:, 3:] + cross(twist_q[:, :3], r) + cross(w, dr)
        acceleration = push[3:] + self.gravity + cross(push[:3], r) + cross(w, velocity)
        da = (
            push_q[:, 3:] + cross(push_q[:, :3], r) + cross(push[:3], dr)
            + cross(twist_q[:, :3], velocity) + cross(w, dv)
        )  # fmt: skip
        da_v = (
            push_v[:, 3:] + cross(push_v[:, :3], r) + cross(s[:, :3], velocity) + cross(w, dr)
        )  # fmt: skip
        return PointMotion(
            place=self.origin + r, velocity=velocity, acceleration=acceleration,
            place_q=np.where(mine, dr, 0.0), velocity_q=np.where(mine, dv, 0.0),
            acceleration_q=np.where(mine, da, 0.0), acceleration_v=np.where(mine, da_v, 0.0),
        )  # fmt: skip
