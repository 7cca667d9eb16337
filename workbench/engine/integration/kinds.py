"""What a kind of system provides, so that objectives, sensitivities and layouts need not know it.

A kind is a record of the system (`AnySystem`), a function `run(system, density, times, scheme)` that the
table of the facade names, and the trajectory it returns (`AnyTrajectory`), which brings its own adjoint,
views and energies. Coordinates q and velocities v may differ in number (a base that turns freely in
space): slopes by position are then those of the tangent space, as many as `widths` says.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import numpy as np

from .outcome import Diagnosis, Status
from .points import PointMotion, PointSeries
from .schemes import Scheme
from .seeds import NodeSeeds

__all__ = [
    "Adjoints", "AnySystem", "AnyTrajectory", "Linearisation", "Linearised", "MemberEnds", "MemberPower",
    "Nodes", "StateSensitivities", "View", "Widths", "read_only", "writable",
]  # fmt: skip

Array = np.ndarray[Any, Any]


class MemberEnds(NamedTuple):
    """Where the members are at the start: numbers of the bodies and global points, of either end."""

    body_a: Array  # (N,)
    point_a: Array  # (N, 2 or 3)
    body_b: Array  # (N,)
    point_b: Array  # (N, 2 or 3)


class AnySystem(Protocol):
    """A system of any kind; `members` in the order of densities and gradients."""

    @property
    def members(self) -> Sequence[Any]:
        """Records with `law`, `power` and `name`."""
        ...

    @property
    def size(self) -> int:
        """Number of velocities."""
        ...

    @property
    def in_python(self) -> bool:
        """Whether a law written in Python is called during a run: then runs do not go side by side."""
        ...

    def member_ends(self) -> MemberEnds:
        """The ends of all members at the start."""
        ...


class Widths(NamedTuple):
    """Lengths of the slopes of a quantity by each part of the state at a node."""

    position: int
    velocity: int
    acceleration: int
    multiplier: int
    states: int  # of first order: damage of bushings, forces of tyres


class MemberPower(NamedTuple):
    """Energy stored in the members at a node: its rate, and the slopes of both."""

    rate: float  # dg/dt
    force: Array  # (n,) dg/dq = d(dg/dt)/dv
    drift: Array  # (n,) d(dg/dt)/dq
    explicit: Array  # (2, N) slopes of g and dg/dt by the scales; `by_density` takes them


class Seen(Protocol):
    """A point seen from a reference body at one node, in its frame: tuples of as many numbers as axes."""

    @property
    def place(self) -> tuple[float, ...]:
        """A^T d."""
        ...

    @property
    def rate(self) -> tuple[float, ...]:
        """Its time derivative."""
        ...


class View(Protocol):
    """Mean of some bodies' centres seen from a reference body (or the ground), along a run."""

    def series(self) -> Array:
        """(steps + 1, axes) A^T d at every node."""
        ...

    def seen(self, node: int) -> Any:
        """A `Seen` at a node."""
        ...

    def rates(self, nodes: Array) -> Array:
        """(len(nodes), axes) rate of the series at some nodes."""
        ...

    def chain(
        self, seen: Any, by_place: tuple[float, ...], by_rate: tuple[float, ...]
    ) -> tuple[Array, Array]:
        """Slopes by position and velocity of a scalar with the given slopes by A^T d and its rate."""
        ...

    def jacobian(self) -> Array:
        """(steps + 1, axes, n) derivatives of the series by the coordinates."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearisation:
    """F, K = d(F + Phi_q^T lambda)/dq, C = dF/dv, Phi and Phi_q at one state; fresh arrays."""

    force: Array  # (n,)
    stiffness: Array  # (n, n)
    damping: Array  # (n, n)
    constraint: Array  # (m,)
    jacobian: Array  # (m, n)


class Linearised(Protocol):
    """The equations of motion linearised at states on a time grid, for the methods that go forward."""

    mass: Array  # (n,) diagonal
    size: int  # n coordinates
    rows: int  # m constraints
    members: int  # N densities

    def tangents(self, node: int, q: Array, v: Array, lam: Array) -> Linearisation:
        """Linearise at a state."""
        ...

    def design(self, node: int, q: Array, v: Array) -> Array:
        """(n, N) dF/dalpha at a state, member order."""
        ...

    def member_stiffness(self, node: int, q: Array, v: Array) -> Array:
        """(n, n) stiffness of the members alone at a state."""
        ...

    def saddle(self, block: Array, jacobian: Array) -> Array:
        """[[block, J^T], [J, 0]]."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSensitivities:
    """position, velocity, acceleration: (nodes, n, N) derivatives; the last two empty when not asked for."""

    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A parameter of a system: the system at each of its values, and the value that ran."""

    system: Callable[[float], Any]
    value: float

    @property
    def step(self) -> float:
        """Step of the differences by which the numbers of a system follow the parameter."""
        return 1e-3 * (abs(self.value) or 1.0)

    def around(self) -> tuple[Any, Any, Any, Any]:
        """The systems at value - 2, - 1, + 1, + 2 steps."""
        h = self.step
        low, below, above, high = (self.system(self.value + k * h) for k in (-2, -1, 1, 2))
        return low, below, above, high

    def slope(self, found: Sequence[Any]) -> Any:
        """Derivative of numbers found for the systems of `around`: central differences of fourth order."""
        low, below, above, high = (np.asarray(x) for x in found)
        return (8.0 * (above - below) - (high - low)) / (12.0 * self.step)


class AnyTrajectory(Protocol):
    """A run of any kind of system: states at the nodes of the time grid, and what can be asked of them."""

    @property
    def system(self) -> Any:
        """The system that ran, an `AnySystem`."""
        ...

    @property
    def density(self) -> Array:
        """(N,)."""
        ...

    @property
    def scheme(self) -> Scheme:
        """The scheme that made the run."""
        ...

    @property
    def times(self) -> Array:
        """(steps + 1,) s."""
        ...

    @property
    def position(self) -> Array:
        """(steps + 1, coordinates)."""
        ...

    @property
    def velocity(self) -> Array:
        """(steps + 1, n)."""
        ...

    @property
    def acceleration(self) -> Array:
        """(steps + 1, n)."""
        ...

    @property
    def multiplier(self) -> Array:
        """(steps + 1, m)."""
        ...

    @property
    def states(self) -> Array:
        """(steps + 1, k) states of first order."""
        ...

    @property
    def widths(self) -> Widths:
        """Lengths of slopes and seeds."""
        ...

    @property
    def step(self) -> float:
        """Length of a step, s."""
        ...

    @property
    def diagnosis(self) -> Diagnosis:
        """Numbers to judge the run by."""
        ...

    @property
    def status(self) -> Status:
        """How it ended."""
        ...

    @property
    def goes_forward(self) -> bool:
        """Whether `state_sensitivities` can treat it."""
        ...

    def adjoint(self, seeds: NodeSeeds) -> Array:
        """(R, N) gradients by density of the implicit parts, in the order of the rows: exact for the run."""
        ...

    def parameter_adjoint(self, seeds: NodeSeeds) -> Any:
        """One row of seeds, contracted with every parameter the kind has; a record of the kind."""
        ...

    def change_adjoint(
        self, values: Sequence[Callable[[Any], float]], seeds: NodeSeeds, changes: Sequence[Change]
    ) -> Array:
        """(R, changes) slopes of each value(trajectory), whose seeds are given, by changes of the system."""
        ...

    def by_density(self, by_scale: Array) -> Array:
        """From slopes by scale, as the kernels number members, to slopes by density in member order."""
        ...

    def linearised(self, *, method: str, times: Array | None = None) -> Linearised:
        """The equations on the run's grid or another. Raises NotSupported, naming the method that asks."""
        ...

    def state_sensitivities(self, *, with_rates: bool) -> StateSensitivities:
        """d(state)/dalpha at all nodes. Raises NotSupported unless `goes_forward`."""
        ...

    def stored_energy(self) -> Array:
        """(steps + 1,) energy stored in the members, J."""
        ...

    def member_power(self, nodes: Sequence[int]) -> list[MemberPower]:
        """Rate and slopes of the energy stored in the members, at some nodes."""
        ...

    def view(self, *, bodies: tuple[str, ...], reference: str, shares: tuple[float, ...]) -> View:
        """The mean of some bodies' centres, weighted by shares, seen from another."""
        ...

    def coordinate(self, name: str) -> slice | None:
        """Where the coordinates of a body or point stand in q; None where it does not move freely."""
        ...

    def of(self, name: str) -> Array:
        """(steps + 1, 2 or 3) position of a body or point."""
        ...

    def point_series(self, body: str, point: Any) -> PointSeries:
        """A point of a body, in its frame, at every node. Raises ValueError for a stranger."""
        ...

    def point_motion(self, node: int, body: str, point: Any) -> PointMotion:
        """A point of a body at a node, with slopes by position and velocity."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Adjoints:
    """How the run of a scheme goes backwards; a trajectory carries the ones of the scheme that made it.

    by_density(trajectory, seeds): (R, N) as `AnyTrajectory.adjoint`.  by_parameter(trajectory, seeds): a
    record, as `AnyTrajectory.parameter_adjoint`.  by_change(trajectory, values, seeds, changes): (R, changes)
    as `AnyTrajectory.change_adjoint`.
    """

    by_density: Callable[[Any, NodeSeeds], Array]
    by_parameter: Callable[[Any, NodeSeeds], Any]
    by_change: Callable[[Any, Sequence[Callable[[Any], float]], NodeSeeds, Sequence[Change]], Array]


class Nodes(NamedTuple):
    """States at the nodes as the kernels take them: they compile once, for arrays that could be written."""

    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array


def writable(array: Array) -> Array:
    """The array itself, or a copy of one that is read only."""
    return array if array.flags.writeable else array.copy()


def read_only(array: Array) -> Array:
    """A view that cannot be written."""
    view = array.view()
    view.flags.writeable = False
    return view
