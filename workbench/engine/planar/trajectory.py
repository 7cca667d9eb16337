"""The solution of a system on its time grid, with what is needed to judge it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from ..errors import NotSupported
from ..integration.grids import is_even
from ..integration.independent import Splits
from ..integration.kinds import (
    Adjoints,
    Change,
    MemberPower,
    StateSensitivities,
    Widths,
    read_only,
    writable,
)
from ..integration.outcome import Diagnosis, Status
from ..integration.points import PointMotion, PointSeries
from ..integration.run_state import Course, GoesOn, RunState
from ..integration.schemes import Scheme
from ..integration.seeds import NodeSeeds
from ._kernels.energy import element_energies, member_energy_series, member_power
from ._kernels.equations import evaluate, place
from ._kernels.tables import Tables, Work, work_space
from .compiled import compiled, in_member_order, on_grid, scale_slope
from .forward import forward_sensitivities
from .linearised import LinearisedRun
from .system import System
from .view import MeanView, columns_of, point_motion, point_series

__all__ = ["Tangents", "Trajectory"]

Array = np.ndarray[Any, Any]

KEPT = 4  # nodes whose members' energies are remembered: a peak and its neighbours


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tangents:
    """Tangents at the converged states of a run, kept for its adjoint.

    stiffness, damping: (steps + 1, n, n) dF/dq with the geometric term, dF/dv.  jacobian: (steps + 1, m, n)
    Phi_q.  energy: (steps + 1,) stored in the members, where all are undamped springs. Node 0
    is filled by `Trajectory.complete_tangents`. Arrays of length 0 when nothing was kept.
    """

    stiffness: Array
    damping: Array
    jacobian: Array
    energy: Array


class StateNodes(NamedTuple):
    """States at the nodes as the kernels take them, which compile once, for arrays that could be written."""

    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    states: Array
    state_rates: Array


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Trajectory(GoesOn):
    """States at the nodes of the time grid; coordinates are (x, y, theta) of every free body in order.

    times: (steps + 1,).  position, velocity, acceleration: (steps + 1, n).  multiplier: (steps + 1, m), one
    per joint row.  states: (steps + 1, states) of force elements (the damage of bushings) with rates
    state_rates. These arrays cannot be written; `nodes` holds them for the kernels.
    """

    system: System
    density: Array
    scheme: Scheme
    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    states: Array
    state_rates: Array
    diagnosis: Diagnosis
    tables: Tables
    adjoints: Adjoints  # of the scheme that made the run
    tangents: Tangents | None = None
    splits: Splits | None = None  # of a run in independent coordinates
    course: Course | None = None
    last: Callable[[Any], RunState] | None = None  # what the run left at its last node
    status: Status = Status.COMPLETE
    memo: dict[str, Any] = field(default_factory=dict, repr=False)  # derived series, computed once
    nodes: StateNodes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        states = {name: writable(getattr(self, name)) for name in StateNodes._fields}
        object.__setattr__(self, "nodes", StateNodes(**states))
        for name, array in (*states.items(), ("density", self.density)):
            object.__setattr__(self, name, read_only(array))

    def start_at(self, node: int) -> tuple[Array, Array]:
        """Places and velocities at a node, as `start` of another run."""
        return self.position[node].copy(), self.velocity[node].copy()

    @property
    def work(self) -> Work:
        """Work arrays of the kernels on this run's tables, made once."""
        if "work" not in self.memo:
            self.memo["work"] = work_space(self.tables)
        return self.memo["work"]  # type: ignore[no-any-return]

    def of(self, body: str) -> Array:
        """(steps + 1, 3) position of a body, free or prescribed."""
        for index, part in enumerate(self.system.prescribed):
            if part.name == body:
                return self.tables.motion[:, 0, 3 * index : 3 * index + 3]
        return self.position[:, self.system.coordinate(body)]

    def kinetic_energy(self) -> Array:
        """(steps + 1,) kinetic energy of the free bodies, J."""
        return np.asarray(0.5 * (self.velocity**2 @ self.tables.mass))

    def complete_tangents(self) -> None:
        """Fill in the kept tangents of the start, once; the forward run leaves them out."""
        kept = self.tangents
        if kept is None or len(kept.stiffness) == 0 or "start" in self.memo:
            return
        r, work = self.nodes, self.work
        z = r.states[0]
        evaluate(self.tables, work, 0, r.position[0], r.velocity[0], r.multiplier[0], z, z, 0.0, True)
        kept.stiffness[0], kept.damping[0], kept.jacobian[0] = work.k, work.c, work.phi_q
        kept.energy[:1] = work.energy
        self.memo["start"] = True

    def stored_energy(self) -> Array:
        """(steps + 1,) energy stored in the members, J."""
        if "stored_energy" not in self.memo:
            kept = self.tangents.energy if self.tangents is not None else np.empty(0)
            if len(kept):  # the run knows them from its tangents
                self.complete_tangents()
                energy = kept.copy()
            else:
                energy, nodes = np.empty(len(self.times)), np.arange(len(self.times))
                r = self.nodes
                member_energy_series(self.tables, self.work, nodes, r.position, r.velocity, energy)
            self.memo["stored_energy"] = energy
        return np.array(self.memo["stored_energy"])

    def spring_energy(self) -> Array:
        """(steps + 1,) energy stored in the elastic force elements (joint springs), J; none in bushings."""
        work = self.work
        energy = np.zeros(len(self.times))
        for step in range(len(self.times)):
            place(self.tables, work, step, self.nodes.position[step], self.nodes.velocity[step])
            energy[step] = element_energies(self.tables, work)
        return energy

    def gravity_energy(self) -> Array:
        """(steps + 1,) potential of gravity, J, zero at the global origin."""
        return np.asarray(-self.position @ self.tables.gravity)

    def mechanical_energy(self) -> Array:
        """(steps + 1,) kinetic, stored and gravity energy, J; constant where nothing dissipates or drives."""
        return self.kinetic_energy() + self.stored_energy() + self.spring_energy() + self.gravity_energy()

    def joint_residuals(self) -> Array:
        """(steps + 1, m) Phi at every node: how well the joints hold, m or rad."""
        r, work = self.nodes, self.work
        out = np.zeros((len(r.times), len(self.tables.row)))
        for step in range(len(r.times)):
            z = r.states[step]
            evaluate(
                self.tables, work, step, r.position[step], r.velocity[step], r.multiplier[step],
                z, z, 0.0, False,
            )  # fmt: skip
            out[step] = work.phi
        return out

    @property
    def damage(self) -> Array:
        """(steps + 1, bushings) the damage of `System.bushings`."""
        return self.states[:, : len(self.system.bushings)]

    @property
    def widths(self) -> Widths:
        """Lengths of slopes and seeds."""
        n = self.position.shape[1]
        return Widths(n, n, n, self.multiplier.shape[1], self.states.shape[1])

    def adjoint(self, seeds: NodeSeeds) -> Array:
        """(R, N) gradients by density of the implicit parts, in the order of the rows: exact for the run."""
        return self.adjoints.by_density(self, seeds)

    def parameter_adjoint(self, seeds: NodeSeeds) -> Any:
        """A `ByParameter` of one row of seeds. Raises NotSupported for systems with a UserLaw."""
        return self.adjoints.by_parameter(self, seeds)

    def change_adjoint(
        self, values: Sequence[Callable[[Any], float]], seeds: NodeSeeds, changes: Sequence[Change]
    ) -> Array:
        """(R, changes) slopes of each value(trajectory), whose seeds are given, by changes of the system."""
        return self.adjoints.by_change(self, values, seeds, changes)

    def by_density(self, by_scale: Array) -> Array:
        """Slopes by scale in segment order as slopes by density in member order; maybe the same array."""
        parts = compiled(self.system)
        if "scale_slope" not in self.memo:
            slope = None if (parts.power == 1.0).all() else scale_slope(parts, self.density)
            self.memo["scale_slope"] = None if slope is None else in_member_order(slope, parts.inverse)
        slope = self.memo["scale_slope"]
        by_density = in_member_order(by_scale, parts.inverse)
        return np.asarray(by_density if slope is None else by_density * slope)

    def linearised(self, *, method: str, times: Array | None = None) -> LinearisedRun:
        """The equations on the run's grid or another. Raises NotSupported, naming the method that asks."""
        if self.start is not None:
            raise NotSupported(
                f"{method} begins at the start of a system, not at that of a run that goes on; use "
                "method='discrete_adjoint'"
            )
        parts = compiled(self.system)
        tables = self.tables if times is None else on_grid(parts, self.density, times)
        return LinearisedRun(parts, tables, self.density, method=method)

    @property
    def goes_forward(self) -> bool:
        """Whether sensitivities can go forward with the run.

        Not with internal states (damage), redundant joints, laws in Python, steps of unequal length, in
        independent coordinates, or where the run goes on from another.
        """
        return (
            self.states.shape[1] == 0
            and self.splits is None
            and not self.diagnosis.redundant_rows
            and not self.system.in_python
            and is_even(self.times)
            and self.start is None
        )

    def state_sensitivities(self, *, with_rates: bool = False) -> StateSensitivities:
        """d(state)/dalpha at all nodes, of runs of the alpha family. Raises NotSupported for others."""
        if not self.goes_forward:
            raise NotSupported(
                "forward sensitivities need a system without damage states, redundant joints and laws in "
                "Python, and a run with equal steps from the system's start that is not in independent "
                "coordinates; use the adjoint"
            )
        parts = compiled(self.system)
        return forward_sensitivities(
            parts, self.tables, self.density, self.scheme, self.nodes, with_rates=with_rates
        )

    def member_power(self, nodes: Sequence[int]) -> list[MemberPower]:
        """Rate and slopes of the energy in the members at some nodes; the last few asked for are kept."""
        seen: dict[int, MemberPower] = self.memo.setdefault("power", {})
        missing = [node for node in nodes if node not in seen]
        if missing:
            if len(seen) + len(missing) > KEPT:
                seen.clear()
                missing = list(nodes)
            fresh = np.array(missing, np.int64)
            n = self.position.shape[1]
            full = n + self.tables.motion.shape[2]
            rate, slopes = np.empty(len(fresh)), np.empty((len(fresh), 2, full))
            explicit = np.zeros((len(fresh), 2, len(self.density)))
            member_power(
                self.tables, self.work, fresh, self.nodes.position, self.nodes.velocity, rate, slopes,
                np.empty((full, full)), explicit,
            )  # fmt: skip
            for a, node in enumerate(missing):
                seen[node] = MemberPower(float(rate[a]), slopes[a, 0, :n], slopes[a, 1, :n], explicit[a])
        return [seen[node] for node in nodes]

    def view(self, *, bodies: tuple[str, ...], reference: str, shares: tuple[float, ...]) -> MeanView:
        """The mean of some bodies' centres, weighted by shares, seen from another."""
        views: dict[Any, MeanView] = self.memo.setdefault("views", {})
        key = bodies, reference, shares
        if key not in views:
            views[key] = MeanView(
                columns=columns_of(self.system, bodies=bodies, reference=reference, shares=shares),
                position=self.position, velocity=self.velocity, motion=self.tables.motion,
            )  # fmt: skip
        return views[key]

    def coordinate(self, name: str) -> slice:
        """Where the coordinates of a free body stand in q. Raises ValueError for a stranger."""
        return self.system.coordinate(name)

    def point_series(self, body: str, point: tuple[float, ...]) -> PointSeries:
        """A point of a body (its frame, m) at every node; the last asked for are remembered."""
        seen: dict[Any, PointSeries] = self.memo.setdefault("points", {})
        key = body, tuple(point)
        if key not in seen:
            if len(seen) >= KEPT:
                seen.clear()
            seen[key] = point_series(self, body, point)
        return seen[key]

    def point_motion(self, node: int, body: str, point: tuple[float, ...]) -> PointMotion:
        """A point of a body at a node, with slopes by position and velocity."""
        return point_motion(self, node, body, point)
