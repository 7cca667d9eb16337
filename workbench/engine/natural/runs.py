"""Runs of spatial systems in natural coordinates, and the trajectory they leave."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.changes import multipliers
from ..integration.dop853_tableau import A, B, C
from ..integration.independent import (
    IndependentEquations,
    March,
    Pulled,
    Splits,
    independent_state,
    march,
    march_rk8,
    notices,
    point_times,
    pulled_alpha,
    pulled_rk8,
)
from ..integration.kinds import (
    Change,
    Linearised,
    MemberPower,
    Nodes,
    StateSensitivities,
    View,
    Widths,
    read_only,
    writable,
)
from ..integration.outcome import Diagnosis, Status
from ..integration.points import PointMotion, PointSeries
from ..integration.redundancy import redundancy
from ..integration.run_state import Course, GoesOn, RunState, checked_start, earlier_times
from ..integration.schemes import (
    GeneralisedAlpha,
    IndependentAlpha,
    RungeKutta8,
    Scheme,
)
from ..integration.seeds import NodeSeeds, Seeds, row_by_row
from ._kernels_equations import energy_series
from .compiled import (
    Compiled,
    compiled,
    on_grid,
)
from .parameters import slopes_by_changes
from .start import checked, independent_equations, look
from .system import NaturalSystem
from .tables import NaturalTables, work_space

__all__ = ["NaturalTrajectory", "run"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NaturalTrajectory(GoesOn):
    """States of a spatial system at the nodes of the time grid: points and unit vectors, free ones only.

    times: (steps + 1,).
    position, velocity, acceleration: (steps + 1, n).
    multiplier: (steps + 1, m), 0 for rows set aside as redundant.
    """

    system: NaturalSystem
    density: Array
    scheme: IndependentAlpha | RungeKutta8
    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    tables: NaturalTables
    splits: Splits
    diagnosis: Diagnosis
    course: Course | None = None
    last: Callable[[Any], RunState] | None = None  # what the run left at its last node
    status: Status = Status.COMPLETE
    nodes: Nodes = field(init=False, repr=False)

    def __post_init__(self) -> None:
        states = {name: writable(getattr(self, name)) for name in Nodes._fields}
        object.__setattr__(self, "nodes", Nodes(**states))
        for name, array in (*states.items(), ("density", self.density)):
            object.__setattr__(self, name, read_only(array))

    @property
    def states(self) -> Array:
        """(steps + 1, 0): these systems have no states of first order."""
        return np.zeros((len(self.times), 0))

    @property
    def widths(self) -> Widths:
        """Lengths of slopes and seeds."""
        n = self.position.shape[1]
        return Widths(n, n, n, self.multiplier.shape[1], 0)

    def coordinate(self, name: str) -> slice | None:
        """Where a free point or vector stands in q, None for a fixed one. ValueError for a stranger."""
        parts = compiled(self.system)
        if name not in parts.index:
            raise ValueError(f"system has no point or vector '{name}'; it has {', '.join(parts.index)}")
        at = parts.index[name]
        return slice(at, at + 3) if at < self.position.shape[1] else None

    def of(self, name: str) -> Array:
        """(steps + 1, 3) a point's position or a unit vector."""
        part = self.coordinate(name)
        if part is None:
            at = compiled(self.system).index[name] - self.position.shape[1]
            return np.broadcast_to(self.tables.held[at : at + 3], (len(self.times), 3))
        return self.position[:, part]

    def point_series(self, body: str, point: Sequence[float]) -> PointSeries:
        """A named point at every node; it has no frame, so `point` is not looked at."""
        part = self.coordinate(body)
        if part is None:
            still = np.zeros((len(self.times), 3))
            return PointSeries(place=self.of(body), velocity=still, acceleration=still)
        return PointSeries(self.position[:, part], self.velocity[:, part], self.acceleration[:, part])

    def point_motion(self, node: int, body: str, point: Sequence[float]) -> PointMotion:
        """A named point at a node, with slopes by the coordinates."""
        series, part = self.point_series(body, point), self.coordinate(body)
        moved, none = (np.zeros((self.position.shape[1], 3)) for _ in range(2))
        if part is not None:
            moved[part] = np.eye(3)
        return PointMotion(
            place=series.place[node], velocity=series.velocity[node], acceleration=series.acceleration[node],
            place_q=moved, velocity_q=none, acceleration_q=none, acceleration_v=none,
        )  # fmt: skip

    def kinetic_energy(self) -> Array:
        """(steps + 1,) J."""
        return np.asarray(0.5 * np.einsum("ti,ij,tj->t", self.velocity, self.tables.mass, self.velocity))

    def stored_energy(self) -> Array:
        """(steps + 1,) energy stored in the members, J."""
        energy = np.zeros((len(self.times), len(self.density)))
        r = self.nodes
        energy_series(self.tables, work_space(self.tables), r.position, r.velocity, energy)
        return np.asarray(energy @ self.tables.scale)

    def gravity_energy(self) -> Array:
        """(steps + 1,) potential of gravity less that of what is fixed, J, zero at the global origin."""
        return np.asarray(-self.position @ self.tables.gravity)

    def mechanical_energy(self) -> Array:
        """(steps + 1,) kinetic, stored and gravity energy, J; constant where nothing dissipates or drives."""
        return self.kinetic_energy() + self.stored_energy() + self.gravity_energy()

    def joint_residuals(self) -> Array:
        """(steps + 1, m) Phi at every node, redundant rows included, m."""
        parts = compiled(self.system)
        equations = independent_equations(parts, self.tables)
        out = np.zeros_like(self.multiplier)
        zero = np.zeros(self.position.shape[1])
        for node in range(len(self.times)):
            look(equations, node, self.nodes.position[node], self.nodes.velocity[node], zero)
            out[node] = equations.work.phi
        return out

    def adjoint(self, seeds: NodeSeeds) -> Array:
        """(R, N) gradients by density of the implicit parts, in the order of the rows: exact for the run."""
        return row_by_row(self, seeds, _gradient)

    def parameter_adjoint(self, seeds: NodeSeeds) -> Any:
        """Raises NotSupported: numbers are told by name here."""
        raise NotSupported(
            "parameter_gradient lists the numbers of planar systems and trees; in natural coordinates take "
            "parameter_slopes, which takes any of them by name"
        )

    def change_adjoint(
        self, values: Sequence[Callable[[Any], float]], seeds: NodeSeeds, changes: Sequence[Change]
    ) -> Array:
        """(R, changes) slopes of each value(trajectory), whose seeds are given, by changes of the system."""
        out = np.empty((len(values), len(changes)))
        for row, objective in enumerate(seeds.order):
            dense = seeds.dense(row)
            found, *points = _pulled(self, dense, joints=True)
            told = multipliers(found, *points)
            out[objective] = slopes_by_changes(self, values[objective], dense, changes, told)
        return out

    def by_density(self, by_scale: Array) -> Array:
        """From slopes by scale in segment order to slopes by density in member order."""
        parts = compiled(self.system)
        out = np.zeros_like(by_scale)
        out[parts.order] = by_scale
        power, alpha = parts.power, self.density
        return np.asarray(out * np.where(power == 1.0, 1.0, power * alpha ** (power - 1.0)))

    def linearised(self, *, method: str, times: Array | None = None) -> Linearised:
        """Raises NotSupported: the forward methods are written for planar systems."""
        raise NotSupported(f"{method} is written for planar systems; use method='discrete_adjoint'")

    @property
    def goes_forward(self) -> bool:
        """No: runs are in independent coordinates."""
        return False

    def state_sensitivities(self, *, with_rates: bool) -> StateSensitivities:
        """Raises NotSupported: runs are in independent coordinates."""
        raise NotSupported("forward sensitivities are written for planar systems; use the adjoint")

    def member_power(self, nodes: Sequence[int]) -> list[MemberPower]:
        """Raises NotSupported: the members' energy has values here, no slopes."""
        raise NotSupported(
            "StoredEnergy has values, but no rates and slopes in natural coordinates; take another quantity"
        )

    def view(self, *, bodies: tuple[str, ...], reference: str, shares: tuple[float, ...]) -> View:
        """Raises NotSupported: there are points here, no bodies with centres."""
        raise NotSupported(
            "Coordinate and Deviation look at bodies; systems in natural coordinates have points, and "
            "PointCoordinate looks at them"
        )


def run(
    system: NaturalSystem, density: Array, times: Array, scheme: Scheme, *, start: RunState | None = None
) -> NaturalTrajectory:
    """Run a spatial system; GeneralisedAlpha means IndependentAlpha with its rho.

    start: what an earlier run left, which goes on.
    Raises AssemblyError, NotConverged, or NotSupported for BDF2 and VelocityVerlet.
    """
    if isinstance(scheme, GeneralisedAlpha):
        scheme = IndependentAlpha(rho=scheme.rho, tolerance=scheme.tolerance, iterations=scheme.iterations)
    if not isinstance(scheme, IndependentAlpha | RungeKutta8):
        raise NotSupported(
            f"spatial systems run with IndependentAlpha or RungeKutta8, not {type(scheme).__name__}"
        )
    parts = compiled(system)
    n, m = len(parts.start[0]), len(parts.row_names)
    checked_start(start, scheme, (n, n, m, 0))
    course = Course(start=start, until=partial(run, system, density, scheme=scheme, start=start))
    tables = on_grid(parts, density, times)
    q0, v0, phi_q = checked(parts, tables if start is None else on_grid(parts, density, np.zeros(1)))
    made, _ = _march(parts, density, times, scheme, (q0, v0), start)
    lost = redundancy(parts.row_names, phi_q).rows
    return NaturalTrajectory(
        system=system, density=density, scheme=scheme, times=times, position=made.position,
        velocity=made.velocity, acceleration=made.acceleration, multiplier=made.multiplier, tables=tables,
        splits=made.splits, course=course,
        last=lambda r: independent_state(made, r.times, scheme, start),
        diagnosis=Diagnosis(
            newton_iterations=made.evaluations, factorisations=made.evaluations,
            redundant_rows=lost, reason="natural coordinates, independent ones by pivoting",
            notices=notices(type(scheme).__name__, made, lost, times),
        ),
    )  # fmt: skip


def _march(
    parts: Compiled, density: Array, times: Array, scheme: IndependentAlpha | RungeKutta8,
    at: tuple[Array, Array], start: RunState | None = None,
) -> tuple[March, tuple[IndependentEquations, Any]]:  # fmt: skip
    """The run, with the equations and stage states that its adjoint needs."""
    if isinstance(scheme, IndependentAlpha):
        equations = independent_equations(parts, on_grid(parts, density, earlier_times(start, times)))
        return march(equations, scheme, times, *at, start), (equations, None)
    equations = independent_equations(parts, on_grid(parts, density, point_times(times, C)))
    run, sq, sv = march_rk8(equations, (A, B), times, *at, start)
    return run, (equations, (sq, sv))


def _pulled(trajectory: NaturalTrajectory, seeds: Seeds, *, joints: bool) -> tuple[Pulled, Any, Any, Any]:
    """The backward sweep, exact for the run's own result, and times, places and velocities of its points.

    Order 8 runs its stages again. joints: adjoints of the conditions too.
    """
    r, parts = trajectory, compiled(trajectory.system)
    nodes = r.nodes
    if isinstance(r.scheme, IndependentAlpha):
        equations = independent_equations(parts, r.tables)
        found = pulled_alpha(
            equations, r.scheme, r.step, nodes, r.splits, seeds, joints=joints, given=r.start is not None
        )
        return found, nodes.times, nodes.position, nodes.velocity
    at = nodes.position[0], nodes.velocity[0]
    made, (equations, points) = _march(parts, r.density, nodes.times, r.scheme, at, r.start)
    found = pulled_rk8(equations, (A, B), nodes.times, made, points, seeds, joints=joints)
    return found, np.append(nodes.times[0], point_times(nodes.times, C)), *points


def _gradient(trajectory: NaturalTrajectory, seeds: Seeds) -> Array:
    """(N,) sum of (dF/dscale)^T mu in segment order."""
    return _pulled(trajectory, seeds, joints=False)[0].gradient
