"""Scalars g(state, t, alpha) along a trajectory, with the slopes that gradients need.

A quantity gives its values at all nodes, its time derivatives at chosen nodes, and at one node the slopes of
the value and of the time derivative with respect to position, velocity, acceleration and density (`Slopes`).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory, View

__all__ = ["Coordinate", "Deviation", "Quantity", "Scalar", "Slopes", "StoredEnergy"]

Array = np.ndarray[Any, Any]

NODES = 4  # asked for at a time: a peak and its neighbours


class Slopes(NamedTuple):
    """Partial derivatives at one node; None stands for zero."""

    position: Array | None = None  # (n,)
    velocity: Array | None = None  # (n,)
    acceleration: Array | None = None  # (n,)
    multiplier: Array | None = None  # (m,)
    states: Array | None = None  # (first-order states,)
    density: Array | None = None  # (N,) explicit dependence only


class Quantity(Protocol):
    """What an objective asks of a scalar of the state; `rates` may raise NotSupported."""

    has_rates: bool

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) g at every node."""
        ...

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt at the given nodes."""
        ...

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        ...

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredEnergy:
    """Energy stored in the members, J: sum of alpha^p times the law's energy; k alpha delta^2/2 for springs.

    The "deviation energy" of (7.12). It depends on alpha explicitly; its slopes hold that part.
    """

    has_rates: bool = True

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) g at every node."""
        return trajectory.stored_energy()

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt = F . v over all bodies."""
        some = [nodes[first : first + NODES] for first in range(0, len(nodes), NODES)]
        return np.array(
            [at.rate for part in some for at in trajectory.member_power([int(node) for node in part])]
        )

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        (at,) = trajectory.member_power([node])
        return Slopes(position=at.force, density=trajectory.by_density(at.explicit[0]))

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        (at,) = trajectory.member_power([node])
        return Slopes(position=at.drift, velocity=at.force, density=trajectory.by_density(at.explicit[1]))


@dataclass(frozen=True, slots=True, kw_only=True)
class Deviation:
    """Weighted squared displacement of some bodies seen from another, (7.13), m^2.

        g = R^T W R,   R = A_ref^T (p - p_ref) minus its value at the start,   p = mass-weighted mean centre

    bodies: names; shares: their masses (equal if None).  weights: diagonal of W; (7.13) prints a third entry
    for an angle, which a mean of bodies does not have.

    >>> Deviation(bodies=("1",), reference="2").weights
    (1.0, 1.0)
    """

    bodies: tuple[str, ...]
    reference: str = "ground"
    shares: tuple[float, ...] | None = None
    weights: tuple[float, ...] = (1.0, 1.0)
    has_rates: bool = True

    def view(self, trajectory: AnyTrajectory) -> View:
        """The bodies seen from the reference along a run."""
        shares = (1.0,) * len(self.bodies) if self.shares is None else self.shares
        return trajectory.view(bodies=tuple(self.bodies), reference=self.reference, shares=tuple(shares))

    def _twice_moved(self, seen: Any, start: Any) -> tuple[float, ...]:
        """2 W R, the slopes of g by the place."""
        moved = zip(self.weights, seen.place, start.place, strict=True)
        return tuple(2.0 * w * (x - x0) for w, x, x0 in moved)

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) g at every node. Raises ValueError unless there is a weight for every axis."""
        series = self.view(trajectory).series()
        if len(self.weights) != series.shape[1]:
            raise ValueError(
                f"Deviation needs a weight for each of {series.shape[1]} axes, got weights={self.weights}"
            )
        return np.asarray((series - series[0]) ** 2 @ np.array(self.weights))

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt = 2 R^T W R'."""
        view = self.view(trajectory)
        series = view.series()
        return np.asarray(2.0 * ((series[nodes] - series[0]) * view.rates(nodes)) @ np.array(self.weights))

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        view = self.view(trajectory)
        seen = view.seen(node)
        by_place = self._twice_moved(seen, view.seen(0))
        by_q, _ = view.chain(seen, by_place, (0.0,) * len(by_place))
        return Slopes(position=by_q)

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        view = self.view(trajectory)
        seen = view.seen(node)
        by_place = tuple(2.0 * w * rate for w, rate in zip(self.weights, seen.rate, strict=True))
        by_rate = self._twice_moved(seen, view.seen(0))
        by_q, by_v = view.chain(seen, by_place, by_rate)
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
    direction: tuple[float, ...] = (0.0, 1.0)
    relative: bool = False
    has_rates: bool = True

    def view(self, trajectory: AnyTrajectory) -> View:
        """The bodies seen from the reference along a run."""
        shares = (1.0,) * len(self.bodies) if self.shares is None else self.shares
        return trajectory.view(bodies=tuple(self.bodies), reference=self.reference, shares=tuple(shares))

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) g at every node."""
        series = self.view(trajectory).series() @ np.array(self.direction)
        return np.asarray(series - series[0] if self.relative else series)

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """(len(nodes),) dg/dt."""
        return np.asarray(self.view(trajectory).rates(nodes) @ np.array(self.direction))

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of g at a node."""
        view = self.view(trajectory)
        by_q, _ = view.chain(view.seen(node), self.direction, (0.0,) * len(self.direction))
        return Slopes(position=by_q)

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Partial derivatives of dg/dt at a node."""
        view = self.view(trajectory)
        by_q, by_v = view.chain(view.seen(node), (0.0,) * len(self.direction), self.direction)
        return Slopes(position=by_q, velocity=by_v)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scalar:
    """A scalar of your own: `function(t, q, v, w, density) -> number` at one node, on complex arrays too.

    q, v, w: (n,) positions, velocities, accelerations.  Slopes are taken by complex step (exact to rounding);
    an explicit dependence on density is followed only with `by_density=True` (N calls per node).

    >>> spin = Scalar(function=lambda t, q, v, w, density: v[2] ** 2)
    """

    function: Callable[..., Any]
    by_density: bool = False
    has_rates: bool = False

    def _call(self, trajectory: AnyTrajectory, node: int, q: Array, v: Array, w: Array, alpha: Array) -> Any:
        return self.function(float(trajectory.times[node]), q, v, w, alpha)

    def values(self, trajectory: AnyTrajectory) -> Array:
        """(steps + 1,) g at every node."""
        r = trajectory
        return np.array(
            [
                float(np.real(self._call(r, i, r.position[i], r.velocity[i], r.acceleration[i], r.density)))
                for i in range(len(r.times))
            ]
        )

    def rates(self, trajectory: AnyTrajectory, nodes: Array) -> Array:
        """Not known for a user's scalar: peaks are refined through four nodal values instead."""
        raise NotSupported("a user's scalar has no time derivative; its peaks use nodal values")

    def slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
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

    def rate_slopes(self, trajectory: AnyTrajectory, node: int) -> Slopes:
        """Not known for a user's scalar."""
        raise NotSupported("a user's scalar has no time derivative; its peaks use nodal values")
