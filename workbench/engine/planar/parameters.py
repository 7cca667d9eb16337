"""From the multipliers of a planar run to slopes by parameters of every kind, whatever its scheme."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..elements.bushing import Bushing
from ..elements.joint_spring import JointSpring
from ..elements.table import PARAMETERS
from ..errors import NotSupported
from ..integration.changes import Multipliers, lagrangian_of, moved_start, slopes_by_change
from ..integration.independent import IndependentEquations
from ..integration.kinds import Adjoints, Change
from ..integration.seeds import NodeSeeds, Seeds
from ._kernels import chart_answers  # noqa: F401  (answers the questions of `lagrangian` by type)
from ._kernels.contraction import contract_parameter_history, contract_points
from ._kernels.tables import Tables, work_space
from .compiled import Compiled, compiled, on_grid
from .equations import SampledEquations, chart_of, rates_of
from .start import rates_of_joints
from .system import System
from .trajectory import Trajectory

__all__ = ["ByParameter", "adjoints_of"]

Array = np.ndarray[Any, Any]

# (N,) slopes by scale in segment order and the multipliers of a run, for one row of seeds
Told = Callable[[Trajectory, NodeSeeds], tuple[Array, Multipliers]]


@dataclass(frozen=True, slots=True, kw_only=True)
class ByParameter:
    """Gradient with respect to everything that has a number.

    density: (N,).
    law: (PARAMETERS, N) by the law's parameters, row j as in `law.names`.
    natural_length: (N,).
    point_a, point_b: (N, 2), in the bodies' frames, natural lengths held.
    spring: (6, joint springs) by k, c, rest, k_stop, upper, lower.
    bushing: (4, bushings) by k, c, cap, hold.
    element: of `System.elements`, each by its `names`.
    mass, inertia: (free bodies,).
    """

    density: Array
    law: Array
    natural_length: Array
    point_a: Array
    point_b: Array
    spring: Array
    bushing: Array
    element: tuple[Array, ...]
    mass: Array
    inertia: Array


def adjoints_of(by_density: Callable[[Trajectory, NodeSeeds], Array], told: Told) -> Adjoints:
    """How the run of a scheme goes backwards: its sweep for many rows of seeds, and the one that tells."""

    def by_parameter(trajectory: Trajectory, seeds: NodeSeeds) -> ByParameter:
        _refuse_user_laws(trajectory)
        by_scale, found = told(trajectory, seeds)
        return _by_parameter(trajectory, trajectory.by_density(by_scale) + seeds.density[0], found)

    def by_change(
        trajectory: Trajectory,
        values: Sequence[Callable[[Trajectory], float]],
        seeds: NodeSeeds,
        changes: Sequence[Change],
    ) -> Array:
        out = np.empty((len(values), len(changes)))
        for objective, value in enumerate(values):
            _, one = seeds.of_objectives(objective, objective + 1)
            found = told(trajectory, one)[1]
            out[objective] = _by_change(trajectory, value, one.dense(0), changes, found)
        return out

    return Adjoints(by_density=by_density, by_parameter=by_parameter, by_change=by_change)


def _refuse_user_laws(trajectory: Trajectory) -> None:
    parts = compiled(trajectory.system)
    if parts.user:
        first = int(parts.order[parts.user[0].first])
        raise NotSupported(
            f"parameter_gradient knows the parameters of the engine's own laws only; members[{first}] has a "
            "UserLaw. Take parameter_slopes() for any parameter by name, or gradient() for the densities"
        )


def _by_parameter(trajectory: Trajectory, density: Array, found: Multipliers) -> ByParameter:
    r, parts, system = trajectory, compiled(trajectory.system), trajectory.system
    tables, last = on_grid(parts, r.density, found.times), len(found.times) - 1
    work, count = work_space(tables), len(r.density)
    law, length, points = np.zeros((PARAMETERS, count)), np.zeros(count), np.zeros((4, count))
    names = max((len(part.names) for part in system.force_elements), default=0)
    element, mass = np.zeros((names, len(tables.element))), np.zeros(len(tables.mass))
    states = r.nodes.states[: last + 1] if system.has_states else np.zeros((last + 1, 0))
    contract_parameter_history(
        tables, work, last, found.q, found.v, found.w, states, found.mu, law, length, element, mass,
        np.zeros(PARAMETERS), np.zeros((names, 3)),
    )  # fmt: skip
    contract_points(tables, work, last, found.q, found.v, found.mu, points)
    order = np.argsort(parts.order)
    first, second = _by_end(system, points[:, order].T)
    springs, bushings = len(system.springs), len(system.springs) + len(system.bushings)
    others = zip(system.elements, element.T[bushings:], strict=True)
    return ByParameter(
        density=density,
        law=law[:, order],
        natural_length=length[order],
        point_a=first,
        point_b=second,
        spring=element[: len(JointSpring.names), :springs],
        bushing=element[: len(Bushing.names), springs:bushings],
        element=tuple(slopes[: len(part.names)] for part, slopes in others),
        mass=mass.reshape(-1, 3)[:, :2].sum(axis=1),
        inertia=mass.reshape(-1, 3)[:, 2],
    )


def _by_end(system: System, points: Array) -> tuple[Array, Array]:
    """From slopes by the points of each pair of bodies (N, 4) to those by the members' own points."""
    number = {body.name: i for i, body in enumerate((*system.free, *system.prescribed))} | {"ground": 10**9}
    swapped = np.array([number[m.a] > number[m.b] for m in system.members], bool)[:, None]
    return np.where(swapped, points[:, 2:], points[:, :2]), np.where(swapped, points[:, :2], points[:, 2:])


def _by_change(
    trajectory: Trajectory,
    value: Callable[[Trajectory], float],
    seeds: Seeds,
    changes: Sequence[Change],
    found: Multipliers,
) -> Array:
    r = trajectory

    def total(system: System) -> float:
        parts = compiled(system)
        _same(parts, compiled(r.system))
        tables = on_grid(parts, r.density, found.times)
        if parts.user or found.states is not None:
            return _total_in_python(parts, tables, found, _begin(r, parts))
        equations = IndependentEquations(
            tables=tables, work=work_space(tables), rates=rates_of(parts, found.times),
            chart=chart_of(tables, np.zeros((len(tables.row), len(tables.mass)))), row_names=parts.row_names,
        )  # fmt: skip
        return lagrangian_of(equations, found, _begin(r, parts))

    return slopes_by_change(
        found, seeds, changes, start=lambda system: _begin(r, compiled(system)), total=total,
        held=lambda system: value(_held(r, system)),
    )  # fmt: skip


def _same(parts: Compiled, ran: Compiled) -> None:
    """Raise ValueError unless a system has the coordinates, joints and members of the one that ran."""
    here, there = (
        (*p.start[0].shape, *p.arrays["row"][:, 0], len(p.order), *p.arrays["state_pair"].shape)
        for p in (parts, ran)
    )
    if here != there:
        raise ValueError(
            "parameter_slopes needs systems of the same bodies, joints and elements at every value of a "
            "parameter, got one of another structure"
        )


def _begin(trajectory: Trajectory, parts: Compiled) -> tuple[Array, Array]:
    """Place and velocity at the first node with the numbers of a system: held where the run goes on."""
    return parts.start if trajectory.start is None else trajectory.start_at(0)


def _held(trajectory: Trajectory, system: System) -> Trajectory:
    """The states of a run read with the numbers of another system, at whose start its first node stands."""
    r, parts = trajectory, compiled(system)
    position, velocity = r.position.copy(), r.velocity.copy()
    position[0], velocity[0] = _begin(r, parts)
    return replace(
        r, system=system, tables=on_grid(parts, r.density, r.times), position=position, velocity=velocity,
        tangents=None, memo={},
    )  # fmt: skip


def _total_in_python(
    parts: Compiled, tables: Tables, found: Multipliers, start: tuple[Array, Array]
) -> float:
    """L of index-3 runs with laws that users wrote in Python, or with states of force elements:

    eta . (z1 - z0 - h/2 (z0' + z1')) of every step stands beside the rest, z held and z' by the numbers.
    """
    q, v = moved_start(found, start)
    equations, out = SampledEquations(parts, tables), 0.0
    z, eta = (None, None) if found.states is None else found.states
    before = np.zeros(0)
    for at in range(len(q)):
        equations.look(at, q[at], v[at], found.lam[at], None if z is None else z[at])
        work = equations.work
        if eta is not None:
            if at:
                half = 0.5 * (found.times[at] - found.times[at - 1])
                out -= float(half * eta[at] @ (before + work.zdot))
            before = work.zdot.copy()
        out += float(found.mu[at] @ (tables.mass * found.w[at] + work.force) + found.nu[at, 0] @ work.phi)
        if at == 0 and found.nu[0, 2].any():
            _, bend = rates_of_joints(parts, work, float(found.times[0]))
            out += float(found.nu[0, 2] @ (work.phi_q @ found.w[0] + bend))
    return out
