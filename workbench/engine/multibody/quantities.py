"""Scalars g(state, t, alpha) along a trajectory, with the slopes that gradients need.

A quantity gives its values at all nodes, its time derivatives at chosen nodes, and at one node the slopes of
the
value and of the time derivative with respect to position, velocity, acceleration and density (`Slopes`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ._kernels_equations import contract, energy_by_scale, evaluate
from .compiled import compiled
from .tables import Tables, Work, work_space
from .trajectory import Trajectory

__all__ = ["Coordinate", "Deviation", "Quantity", "Scalar", "Slopes", "StoredEnergy"]

Array = np.ndarray[Any, Any]

SPIN = np.array([[0.0, 1.0], [-1.0, 0.0]])  # d(A^T)/dtheta = SPIN A^T


class Slopes(NamedTuple):
    """Partial derivatives at one node; None stands for zero."""

    position: Array | None = None  # (n,)
    velocity: Array | None = None  # (n,)
    acceleration: Array | None = None  # (n,)
    multiplier: Array | None = None  # (m,)
    damage: Array | None = None  # (bushings,)
    density: Array | None = None  # (N,) explicit dependence only


class Quantity(Protocol):
    """What an objective asks of a scalar of the state; `rates` may raise NotImplementedError."""

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


def elastic(tables: Tables) -> Tables:
    """Tables that hold the stored forces of the members alone, every body free (so rates see driven
    bodies)."""
    bodies = len(tables.mass) + tables.motion.shape[2]
    law = tables.law
    if (tables.segment[:, 1] != -1).any():
        law = tables.law.copy()  # undamped springs need no copy without dampers
    segments = []
    for pair, code, first, last in tables.segment:
        if code == 2:
            continue  # impulses store nothing
        damper = {0: 1, 1: 1, 3: 4}.get(int(code))
        if damper is not None:
            law[damper, first:last] = 0.0
        segments.append((pair, code, first, last))
    samples = len(tables.times)
    return tables._replace(
        mass=np.ones(bodies),
        gravity=np.zeros(bodies),
        law=law,
        segment=np.array(segments, np.int64).reshape(-1, 4),
        torsion_pair=np.zeros(0, np.int64),
        bushing_pair=np.zeros(0, np.int64),
        row=np.zeros((0, 4), np.int64),
        load=np.zeros((0, 4), np.int64),
        load_sample=np.zeros((samples, 0, 3)),
        motion=np.zeros((samples, 2, 0)),
        drive=np.zeros((samples, 0)),
    )


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


def in_member_order(trajectory: Trajectory, by_scale: Array) -> Array:
    """Turn slopes by scale in segment order into slopes by density in member order."""
    if "member_order" not in trajectory.memo:
        parts = compiled(trajectory.system)
        inverse = np.argsort(parts.order)
        plain = (parts.power == 1.0).all()
        trajectory.memo["member_order"] = inverse, None if plain else scale_slope(trajectory)[inverse]
    inverse, slope = trajectory.memo["member_order"]
    by_density = by_scale[inverse]
    if slope is not None:
        by_density *= slope
    return np.asarray(by_density)


_EMPTY = np.zeros(0)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredEnergy:
    """Energy stored in the members, J: sum of alpha^p times the law's energy; k alpha delta^2/2 for springs.

    The "deviation energy" of (7.12). It depends on alpha explicitly; its slopes hold that part.
    """

    has_rates: bool = True

    def values(self, trajectory: Trajectory) -> Array:
        """(steps + 1,) g at every node."""
        return trajectory.stored_energy()

    def _at(self, trajectory: Trajectory, node: int, *, tangent: bool) -> tuple[Tables, Work, Array]:
        if "elastic" not in trajectory.memo:
            fresh = elastic(trajectory.tables)
            trajectory.memo["elastic"] = fresh, work_space(fresh)
        tables, work = trajectory.memo["elastic"]
        q, v = full_state(trajectory, node)
        if trajectory.memo.get("elastic_at") != node:  # else the work space holds this node with its tangents
            evaluate(tables, work, node, q, v, _EMPTY, _EMPTY, _EMPTY, 0.0, tangent)
            trajectory.memo["elastic_at"] = node if tangent else None
        return tables, work, v

    def rates(self, trajectory: Trajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt = F . v over all bodies."""
        out = []
        for node in nodes:
            _, work, v = self._at(trajectory, int(node), tangent=False)
            out.append(work.force @ v)
        return np.array(out)

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        tables, work, _ = self._at(trajectory, node, tangent=True)  # the rate's slopes are asked for next
        explicit = np.zeros(len(trajectory.density))
        energy_by_scale(tables, work, node, explicit, 1.0)
        n = trajectory.position.shape[1]
        return Slopes(position=work.force[:n].copy(), density=in_member_order(trajectory, explicit))

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        tables, work, v = self._at(trajectory, node, tangent=True)
        explicit = np.zeros(len(trajectory.density))
        n = trajectory.position.shape[1]
        by_position = (v @ work.k)[:n]
        force = work.force[:n].copy()
        contract(tables, work, node, v, explicit)  # at the state that the evaluation left
        return Slopes(position=by_position, velocity=force, density=in_member_order(trajectory, explicit))


class _Seen(NamedTuple):
    """Position of a point seen from a reference body, at one node."""

    turn: Array  # (2, 2) A^T of the reference
    spin: float  # its angular velocity
    place: Array  # (2,) A^T d
    rate: Array  # (2,) its time derivative
    drift: Array  # (2,) A^T d'


@dataclass(frozen=True, slots=True, kw_only=True)
class _View:
    """Mass-weighted mean of some bodies' centres, seen from a reference body (or the ground)."""

    bodies: tuple[str, ...]
    reference: str
    shares: tuple[float, ...]

    def columns(self, trajectory: Trajectory) -> list[tuple[int, float]]:
        """(first full coordinate, share) of every body that enters."""
        system = trajectory.system
        index = {body.name: i for i, body in enumerate((*system.free, *system.prescribed))}
        index["ground"] = len(index)
        for name in (*self.bodies, self.reference):
            if name not in index:
                raise ValueError(f"quantity refers to body '{name}'; bodies are {', '.join(sorted(index))}")
        total = sum(self.shares)
        return [
            *((3 * index[name], share / total) for name, share in zip(self.bodies, self.shares, strict=True)),
            (3 * index[self.reference], -1.0),
        ]

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
        q, v = full_state(trajectory, node)
        columns = self.columns(trajectory)
        d = sum(share * q[at : at + 2] for at, share in columns)
        d1 = sum(share * v[at : at + 2] for at, share in columns)
        angle, spin = q[columns[-1][0] + 2], float(v[columns[-1][0] + 2])
        turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        place = turn @ d
        drift = turn @ d1
        return _Seen(turn, spin, place, drift + spin * SPIN @ place, drift)

    def chain(
        self, trajectory: Trajectory, seen: _Seen, by_place: Array, by_rate: Array
    ) -> tuple[Array, Array]:
        """(n,) slopes by position and velocity of a scalar with the given slopes by A^T d and its rate."""
        n = trajectory.position.shape[1]
        by_q, by_v = np.zeros(n), np.zeros(n)
        columns = self.columns(trajectory)
        for at, share in columns:
            if at < n:
                by_q[at : at + 2] += share * seen.turn.T @ (by_place + seen.spin * SPIN.T @ by_rate)
                by_v[at : at + 2] += share * seen.turn.T @ by_rate
        at = columns[-1][0]
        if at < n:
            by_q[at + 2] += by_place @ SPIN @ seen.place
            by_q[at + 2] += by_rate @ (SPIN @ seen.drift - seen.spin * seen.place)
            by_v[at + 2] += by_rate @ SPIN @ seen.place
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
        start = view.seen(trajectory, 0).place
        w = np.array(self.weights)
        seen = [view.seen(trajectory, int(node)) for node in nodes]
        return np.array([2.0 * (s.place - start) @ (w * s.rate) for s in seen])

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        view = self._view()
        seen, start = view.seen(trajectory, node), view.seen(trajectory, 0).place
        by_place = 2.0 * np.array(self.weights) * (seen.place - start)
        by_q, _ = view.chain(trajectory, seen, by_place, np.zeros(2))
        return Slopes(position=by_q)

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        view = self._view()
        seen, start = view.seen(trajectory, node), view.seen(trajectory, 0).place
        w = np.array(self.weights)
        by_q, by_v = view.chain(trajectory, seen, 2.0 * w * seen.rate, 2.0 * w * (seen.place - start))
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
        n = np.array(self.direction)
        return np.array([view.seen(trajectory, int(node)).rate @ n for node in nodes])

    def slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        view = self._view()
        by_q, _ = view.chain(trajectory, view.seen(trajectory, node), np.array(self.direction), np.zeros(2))
        return Slopes(position=by_q)

    def rate_slopes(self, trajectory: Trajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        view = self._view()
        by_q, by_v = view.chain(
            trajectory, view.seen(trajectory, node), np.zeros(2), np.array(self.direction)
        )
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
        raise NotImplementedError("a user's scalar has no time derivative; its peaks use nodal values")

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
        raise NotImplementedError("a user's scalar has no time derivative; its peaks use nodal values")
