"""Scalars g(state, t, alpha) along a trajectory, with the slopes that gradients need.

A quantity gives its values at all nodes, its time derivatives at chosen nodes, and at one node the slopes of
the
value and of the time derivative with respect to position, velocity, acceleration and density (`Slopes`).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..errors import NotSupported
from ..planar._kernels.energy import member_power
from ..planar.compiled import compiled
from ..planar.trajectory import Trajectory

__all__ = ["Coordinate", "Deviation", "Quantity", "Scalar", "Slopes", "StoredEnergy"]

Array = np.ndarray[Any, Any]
_Pair = tuple[float, float]

NODES = 4  # whose members' energies are remembered: a peak and its neighbours


class Slopes(NamedTuple):
    """Partial derivatives at one node; None stands for zero."""

    position: Array | None = None  # (n,)
    velocity: Array | None = None  # (n,)
    acceleration: Array | None = None  # (n,)
    multiplier: Array | None = None  # (m,)
    damage: Array | None = None  # (bushings,)
    density: Array | None = None  # (N,) explicit dependence only


class Quantity(Protocol):
    """What an objective asks of a scalar of the state; `rates` may raise NotSupported."""

    has_rates: bool

    def values(self, trajectory: Trajectory) -> Array:
        """(steps + 1,) g at every node."""
        ...

    def rates(self, trajectory: Trajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt at the given nodes."""
        ...

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        ...

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        ...


def full_state(trajectory: Trajectory, node: int) -> tuple[Array, Array]:
    """Positions and velocities of all bodies, driven ones and the ground included."""
    motion = trajectory.tables.motion
    q = np.concatenate([trajectory.position[node], motion[node, 0]])
    v = np.concatenate([trajectory.velocity[node], motion[node, 1]])
    return q, v


def scale_slope(trajectory: Trajectory) -> Array:
    """(N,) d scale/d alpha = power alpha^(power - 1) in segment order."""
    parts = compiled(trajectory.system)
    if (parts.power == 1.0).all():
        return np.ones(len(parts.order))
    alpha, power = trajectory.density[parts.order], parts.power[parts.order]
    return np.where(power == 1.0, 1.0, power * alpha ** (power - 1.0))


def in_order(by_segment: Array, inverse: Array | None) -> Array:
    """Turn segment order into member order; None where they are the same."""
    return by_segment if inverse is None else by_segment[inverse]


def in_member_order(trajectory: Trajectory, by_scale: Array) -> Array:
    """Turn slopes by scale in segment order into slopes by density in member order; maybe the same array."""
    inverse = compiled(trajectory.system).inverse
    if "scale_slope" not in trajectory.memo:
        slope = scale_slope(trajectory)
        trajectory.memo["scale_slope"] = None if (slope == 1.0).all() else in_order(slope, inverse)
    slope = trajectory.memo["scale_slope"]
    by_density = in_order(by_scale, inverse)
    return np.asarray(by_density if slope is None else by_density * slope)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredEnergy:
    """Energy stored in the members, J: sum of alpha^p times the law's energy; k alpha delta^2/2 for springs.

    The "deviation energy" of (7.12). It depends on alpha explicitly; its slopes hold that part.
    """

    has_rates: bool = True

    def values(self, trajectory: Trajectory) -> Array:
        """(steps + 1,) g at every node."""
        return trajectory.stored_energy()

    def _at(self, trajectory: Trajectory, *nodes: int) -> "list[_Power]":
        """Everything at some nodes, in one pass over the members; the last few asked for are remembered."""
        seen: dict[int, _Power] = trajectory.memo.setdefault("power", {})
        missing = [node for node in nodes if node not in seen]
        if missing:
            if len(seen) + len(missing) > NODES:
                seen.clear()
                missing = list(nodes)
            fresh = np.array(missing, np.int64)
            r, tables = trajectory, trajectory.tables
            n = r.position.shape[1]
            full = n + tables.motion.shape[2]
            rate, slopes = np.empty(len(fresh)), np.empty((len(fresh), 2, full))
            explicit = np.zeros((len(fresh), 2, len(r.density)))
            member_power(
                tables, r.work, fresh, r.position, r.velocity, rate, slopes, np.empty((full, full)), explicit
            )
            for a, node in enumerate(missing):
                seen[node] = _Power(float(rate[a]), slopes[a, 0, :n], slopes[a, 1, :n], explicit[a])
        return [seen[node] for node in nodes]

    def rates(self, trajectory: Trajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt = F . v over all bodies."""
        some = [nodes[first : first + NODES] for first in range(0, len(nodes), NODES)]
        return np.array([at.rate for part in some for at in self._at(trajectory, *map(int, part))])

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        (at,) = self._at(trajectory, node)
        return Slopes(position=at.force, density=in_member_order(trajectory, at.explicit[0]))

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        (at,) = self._at(trajectory, node)
        return Slopes(
            position=at.drift, velocity=at.force, density=in_member_order(trajectory, at.explicit[1])
        )


class _Power(NamedTuple):
    """Stored energy at a node: its rate, and the slopes of both."""

    rate: float
    force: Array  # (n,) dg/dq = d(dg/dt)/dv
    drift: Array  # (n,) d(dg/dt)/dq
    explicit: Array  # (2, N) slopes of g and dg/dt by the scales, segment order


class _Seen(NamedTuple):
    """Position of a point seen from a reference body, at one node; pairs are vectors in its frame."""

    turn: tuple[float, float]  # cosine and sine of the reference's angle
    spin: float  # its angular velocity
    place: tuple[float, float]  # A^T d
    rate: tuple[float, float]  # its time derivative
    drift: tuple[float, float]  # A^T d'


@dataclass(frozen=True, slots=True, kw_only=True)
class _View:
    """Mass-weighted mean of some bodies' centres, seen from a reference body (or the ground)."""

    bodies: tuple[str, ...]
    reference: str
    shares: tuple[float, ...]

    def columns(self, trajectory: Trajectory) -> list[tuple[int, float]]:
        """(first full coordinate, share) of every body that enters."""
        memo: dict[Any, list[tuple[int, float]]] = trajectory.memo.setdefault("columns", {})
        key = tuple(self.bodies), self.reference, tuple(self.shares)
        if key not in memo:
            system = trajectory.system
            index = {body.name: i for i, body in enumerate((*system.free, *system.prescribed))}
            index["ground"] = len(index)
            for name in (*self.bodies, self.reference):
                if name not in index:
                    raise ValueError(
                        f"quantity refers to body '{name}'; bodies are {', '.join(sorted(index))}"
                    )
            total = sum(self.shares)
            memo[key] = [
                *(
                    (3 * index[name], share / total)
                    for name, share in zip(self.bodies, self.shares, strict=True)
                ),
                (3 * index[self.reference], -1.0),
            ]
        return memo[key]

    def series(self, trajectory: Trajectory) -> Array:
        """(steps + 1, 2) A^T d at every node."""
        q = np.concatenate([trajectory.position, trajectory.tables.motion[:, 0]], axis=1)
        columns = self.columns(trajectory)
        d = np.sum([share * q[:, at : at + 2] for at, share in columns], axis=0)
        angle = q[:, columns[-1][0] + 2]
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([c * d[:, 0] + s * d[:, 1], c * d[:, 1] - s * d[:, 0]], axis=1)

    def seen(self, trajectory: Trajectory, node: int) -> _Seen:
        """The view and its rate at a node."""
        q, v = (x.tolist() for x in full_state(trajectory, node))
        columns = self.columns(trajectory)
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
        self, trajectory: Trajectory, seen: _Seen, by_place: _Pair, by_rate: _Pair
    ) -> tuple[Array, Array]:
        """(n,) slopes by position and velocity of a scalar with the given slopes by A^T d and its rate."""
        n = trajectory.position.shape[1]
        by_q, by_v = np.zeros(n), np.zeros(n)
        (c, s), spin, (x, y), _, (u, w) = seen
        r0, r1 = by_rate
        p0, p1 = by_place[0] - spin * r1, by_place[1] + spin * r0
        columns = self.columns(trajectory)
        for at, share in columns:
            if at < n:
                by_q[at] += share * (c * p0 - s * p1)
                by_q[at + 1] += share * (s * p0 + c * p1)
                by_v[at] += share * (c * r0 - s * r1)
                by_v[at + 1] += share * (s * r0 + c * r1)
        at = columns[-1][0]
        if at < n:
            by_q[at + 2] += by_place[0] * y - by_place[1] * x
            by_q[at + 2] += r0 * (w - spin * x) - r1 * (u + spin * y)
            by_v[at + 2] += r0 * y - r1 * x
        return by_q, by_v


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """Weighted squared displacement of some bodies seen from another, (7.13), m^2.

        g = R^T W R,   R = A_ref^T (p - p_ref) minus its value at the start,   p = mass-weighted mean centre

    bodies: names; shares: their masses (equal if None).  weights: diagonal of W; (7.13) prints a third entry
    for an
    angle, which a mean of bodies does not have.

    >>> Deviation(bodies=("1",), reference="2").weights
    (1.0, 1.0)
    """

    bodies: tuple[str, ...]
    reference: str = "ground"
    shares: tuple[float, ...] | None = None
    weights: tuple[float, float] = (1.0, 1.0)
    has_rates: bool = True

    def _view(self) -> _View:
        shares = (1.0,) * len(self.bodies) if self.shares is None else self.shares
        return _View(bodies=self.bodies, reference=self.reference, shares=shares)

    def values(self, trajectory: Trajectory) -> Array:
        """(steps + 1,) g at every node."""
        series = self._view().series(trajectory)
        return np.asarray((series - series[0]) ** 2 @ np.array(self.weights))

    def rates(self, trajectory: Trajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt = 2 R^T W R'."""
        view = self._view()
        x, y = view.seen(trajectory, 0).place
        a, b = self.weights
        seen = [view.seen(trajectory, int(node)) for node in nodes]
        return np.array(
            [2.0 * (a * (s.place[0] - x) * s.rate[0] + b * (s.place[1] - y) * s.rate[1]) for s in seen]
        )

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        view = self._view()
        seen, (x, y) = view.seen(trajectory, node), view.seen(trajectory, 0).place
        a, b = self.weights
        by_place = 2.0 * a * (seen.place[0] - x), 2.0 * b * (seen.place[1] - y)
        by_q, _ = view.chain(trajectory, seen, by_place, (0.0, 0.0))
        return Slopes(position=by_q)

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        view = self._view()
        seen, (x, y) = view.seen(trajectory, node), view.seen(trajectory, 0).place
        a, b = self.weights
        by_place = 2.0 * a * seen.rate[0], 2.0 * b * seen.rate[1]
        by_rate = 2.0 * a * (seen.place[0] - x), 2.0 * b * (seen.place[1] - y)
        by_q, by_v = view.chain(trajectory, seen, by_place, by_rate)
        return Slopes(position=by_q, velocity=by_v)


@dataclass(frozen=True, slots=True, kw_only=True)
class Coordinate:
    """A component of the mean centre of some bodies seen from another, m: n . A_ref^T (p - p_ref).

    direction: n in the reference's frame.  relative: subtract the value at the start.

    >>> Coordinate(bodies=("torso", "head"), reference="vehicle", shares=(40.0, 5.0)).relative
    False
    """

    bodies: tuple[str, ...]
    reference: str = "ground"
    shares: tuple[float, ...] | None = None
    direction: tuple[float, float] = (0.0, 1.0)
    relative: bool = False
    has_rates: bool = True

    def _view(self) -> _View:
        shares = (1.0,) * len(self.bodies) if self.shares is None else self.shares
        return _View(bodies=self.bodies, reference=self.reference, shares=shares)

    def values(self, trajectory: Trajectory) -> Array:
        """(steps + 1,) g at every node."""
        series = self._view().series(trajectory) @ np.array(self.direction)
        return np.asarray(series - series[0] if self.relative else series)

    def rates(self, trajectory: Trajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt."""
        view = self._view()
        a, b = self.direction
        rates = (view.seen(trajectory, int(node)).rate for node in nodes)
        return np.array([a * u + b * w for u, w in rates])

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        view = self._view()
        by_q, _ = view.chain(trajectory, view.seen(trajectory, node), self.direction, (0.0, 0.0))
        return Slopes(position=by_q)

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        view = self._view()
        by_q, by_v = view.chain(trajectory, view.seen(trajectory, node), (0.0, 0.0), self.direction)
        return Slopes(position=by_q, velocity=by_v)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scalar:
    """A scalar of your own: `function(t, q, v, w, density) -> number` at one node, on complex arrays too.

    q, v, w: (n,) positions, velocities, accelerations.  Slopes are taken by complex step (exact to rounding);
    an
    explicit dependence on density is followed only with `by_density=True` (N calls per node).

    >>> spin = Scalar(function=lambda t, q, v, w, density: v[2] ** 2)
    """

    function: Callable[..., Any]
    by_density: bool = False
    has_rates: bool = False

    def _call(self, trajectory: Trajectory, node: int, q: Array, v: Array, w: Array, alpha: Array) -> Any:
        return self.function(float(trajectory.times[node]), q, v, w, alpha)

    def values(self, trajectory: Trajectory) -> Array:
        """(steps + 1,) g at every node."""
        r = trajectory
        return np.array(
            [
                float(np.real(self._call(r, i, r.position[i], r.velocity[i], r.acceleration[i], r.density)))
                for i in range(len(r.times))
            ]
        )

    def rates(self, trajectory: Trajectory, nodes: Array) -> Array:
        """Not known for a user's scalar: peaks are refined through four nodal values instead."""
        raise NotSupported("a user's scalar has no time derivative; its peaks use nodal values")

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node, by complex step."""
        r = trajectory
        state = [x[node].astype(complex) for x in (r.position, r.velocity, r.acceleration)]
        state.append(r.density.astype(complex))
        found: list[Array | None] = []
        for part in range(4 if self.by_density else 3):
            slope = np.zeros(len(state[part]))
            for i in range(len(slope)):
                bumped = [x.copy() for x in state]
                bumped[part][i] += 1e-30j
                slope[i] = np.imag(self._call(r, node, *bumped)) / 1e-30
            found.append(slope)
        return Slopes(found[0], found[1], found[2], density=found[3] if self.by_density else None)

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Not known for a user's scalar."""
        raise NotSupported("a user's scalar has no time derivative; its peaks use nodal values")
