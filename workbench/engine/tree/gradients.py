"""From a backward sweep to gradients: the multipliers of a run contracted with densities and parameters."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from ..elements.table import PARAMETERS
from ..integration.kinds import Adjoints, Change
from ..integration.seeds import NodeSeeds
from ._kernels.contraction import TINY, contract, contract_parameters, work_along
from ._kernels.tables import SPHERICAL, TreeRun, TreeTables, tree_work
from .compiled import tree_compiled, tree_on_grid
from .system import TreeSystem
from .trajectory import TreeTrajectory

__all__ = ["Swept", "TreeGradient", "adjoints_of"]

Array = np.ndarray[Any, Any]

ROWS = 64e6  # bytes of adjoint states that one sweep over several rows may hold

NO_CAP = 1e30  # N


class Swept(NamedTuple):
    """Multipliers of all points at which the equations were solved, and what was solved there."""

    tables: TreeTables
    nodes: TreeRun
    starts: Array  # (R,) last point of each row, descending
    mu: Array  # (points, R, n)
    costate: Array  # (R, 2, n) gradients by the initial places and velocities


def adjoints_of(sweep: Callable[[TreeTrajectory, NodeSeeds], Swept]) -> Adjoints:
    """How the run of a scheme goes backwards, from its sweep."""

    def by_density(trajectory: TreeTrajectory, seeds: NodeSeeds) -> Array:
        out = np.empty((len(seeds.starts), len(trajectory.density)))
        for rows, part in _few_rows(trajectory, seeds):
            out[rows] = trajectory.by_density(_by_scale(trajectory, sweep(trajectory, part)))
        return out

    def by_parameter(trajectory: TreeTrajectory, seeds: NodeSeeds) -> TreeGradient:
        return _by_parameter(trajectory, seeds, sweep(trajectory, seeds))

    def by_change(
        trajectory: TreeTrajectory,
        values: Sequence[Callable[[TreeTrajectory], float]],
        seeds: NodeSeeds,
        changes: Sequence[Change],
    ) -> Array:
        out = np.empty((len(values), len(changes)))
        for rows, part in _few_rows(trajectory, seeds):
            some = [values[objective] for objective in seeds.order[rows]]
            found = _by_change(trajectory, some, part, changes, sweep(trajectory, part))
            out[seeds.order[rows]] = found
        return out

    return Adjoints(by_density=by_density, by_parameter=by_parameter, by_change=by_change)


def _few_rows(trajectory: TreeTrajectory, seeds: NodeSeeds) -> Iterator[tuple[Array, NodeSeeds]]:
    """As many rows of the seeds at a time as one sweep may hold, and their seeds."""
    some = max(1, int(ROWS // (8 * len(trajectory.times) * trajectory.parts.size)))
    for first in range(0, len(seeds.starts), some):
        yield seeds.of_objectives(first, first + some)


def _by_scale(trajectory: TreeTrajectory, swept: Swept) -> Array:
    """(R, N) implicit gradients by scale in segment order."""
    found = np.zeros((len(swept.starts), len(trajectory.density)))
    virtual = np.zeros((len(swept.tables.link) + 1, 6))
    contract(swept.tables, trajectory.work, swept.nodes, swept.starts, swept.mu, virtual, found)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class TreeGradient:
    """Gradient of an objective by what a tree has numbers for.

    density: (N,).
    law: (PARAMETERS, N) by the laws' parameters, row j as in `law.names`.
    natural_length: (N,).
    point_a, point_b: (N, 3), in the bodies' frames, natural lengths held.
    spring: (7, springs) by k, c, rest, k_stop, upper, lower, torque.
    spherical_spring: (2, B) by k, c.
    coupling: (3, C) by k, c, rest.
    bushing: (15, U) by k (3), c (3), cap, slip, release, tau, eps, hold, preload (3).
    mass: (bodies,) by the mass, centre and inertia about it held.
    centre: (bodies, 3).
    inertia: (bodies, 3, 3), about the centre, body's axes: dG = sum of inertia * dI.
    position, velocity: (n,) by small motions of the joints' start and by the initial velocities.
    state: (x,).
    """

    density: Array
    law: Array
    natural_length: Array
    point_a: Array
    point_b: Array
    spring: Array
    spherical_spring: Array
    coupling: Array
    bushing: Array
    mass: Array
    centre: Array
    inertia: Array
    position: Array
    velocity: Array
    state: Array


def _by_parameter(trajectory: TreeTrajectory, seeds: NodeSeeds, swept: Swept) -> TreeGradient:
    """One row, contracted with every parameter; the objective's own dependence on parameters other than
    density is not included. Natural lengths and rests that were taken from the start count as given numbers.
    """
    r, tables = trajectory, swept.tables
    count, links = len(r.density), len(tables.link)
    density = _by_scale(r, swept)
    law, length, points = np.zeros((PARAMETERS, count)), np.zeros(count), np.zeros((6, count))
    spring, ball = np.zeros(tables.spring.shape), np.zeros((2, len(tables.ball)))
    coupling, inertia = np.zeros((3, len(tables.coupling))), np.zeros((10, links))
    bushing = np.zeros((15, len(tables.bushing_pair)))
    contract_parameters(
        tables, r.work, swept.nodes, int(swept.starts[0]), np.ascontiguousarray(swept.mu[:, 0]),
        np.zeros((links + 1, 6)), law, length, points, spring, ball, coupling, bushing, inertia,
        np.zeros(PARAMETERS), np.zeros((3, 6)), np.zeros((26, 1), complex),
    )  # fmt: skip
    order = np.argsort(r.parts.order)
    # a limit of 1e30 N is none
    bushing[6, tables.bushing[6] >= NO_CAP] = 0.0
    mass, centre, matrix = _by_body(r, inertia)
    first, second = _by_end(r, points[:, order].T)
    by_q, by_v = swept.costate[0]
    return TreeGradient(
        density=r.by_density(density)[0] + seeds.density[0], law=law[:, order], natural_length=length[order],
        point_a=first, point_b=second,
        spring=spring[[0, 1, 2, 3, 4, 5, 7]], spherical_spring=ball, coupling=coupling, bushing=bushing,
        mass=mass, centre=centre, inertia=matrix, position=by_q[: r.size], velocity=by_v[: r.size],
        state=by_v[r.size : r.size + len(r.parts.states)],
    )  # fmt: skip


def _by_end(trajectory: TreeTrajectory, points: Array) -> tuple[Array, Array]:
    """From slopes by the points on the links of each pair (N, 6) to those by the members' own points."""
    places = trajectory.parts.places
    out = np.zeros((2, len(points), 3))
    for i, member in enumerate(trajectory.system.members):
        ends = places[member.a], places[member.b]
        ground = len(trajectory.tables.link)
        # tables hold the later link first, the ground second
        swapped = ends[0].link == ground or (ends[1].link != ground and ends[0].link < ends[1].link)
        for end, place in enumerate(ends):
            side = 1 - end if swapped else end
            out[end, i] = place.turn.T @ points[i, 3 * side : 3 * side + 3]
    return out[0], out[1]


def _by_body(trajectory: TreeTrajectory, slopes: Array) -> tuple[Array, Array, Array]:
    """From slopes by the links' numbers (10, L) to those by mass, centre and inertia of every body."""
    bodies, links = trajectory.system.bodies, len(trajectory.tables.link)
    mass, centre, inertia = np.zeros(len(bodies)), np.zeros((len(bodies), 3)), np.zeros((len(bodies), 3, 3))
    for i, body in enumerate(bodies):
        place = trajectory.parts.places[body.name]
        if place.link == links:
            continue  # welded to the ground
        g = slopes[:, place.link]
        by_first = g[1:4]
        by_inertia = np.array([
            [g[4], 0.5 * g[7], 0.5 * g[8]], [0.5 * g[7], g[5], 0.5 * g[9]], [0.5 * g[8], 0.5 * g[9], g[6]],
        ])  # fmt: skip
        c = place.at + place.turn @ np.asarray(body.centre, float)
        shift = np.trace(by_inertia) * c - by_inertia @ c  # half the slope of |c|^2 tr - c.G c
        mass[i] = g[0] + by_first @ c + shift @ c
        centre[i] = place.turn.T @ (body.mass * (by_first + 2.0 * shift))
        inertia[i] = place.turn.T @ by_inertia @ place.turn
    return mass, centre, inertia


def _by_change(
    trajectory: TreeTrajectory,
    values: Sequence[Callable[[TreeTrajectory], float]],
    seeds: NodeSeeds,
    changes: Sequence[Change],
    swept: Swept,
) -> Array:
    """(R, changes) slopes of the rows by changes of the system: the tables' by differences, what follows
    exact. values: of the rows.
    """
    r = trajectory
    given = r.parts.start
    at = swept.nodes.position[0], swept.nodes.velocity[0]
    free = r.start is None and all(map(np.array_equal, at, given))
    by_start = _beyond_the_first(trajectory, seeds, swept)
    out = np.empty((len(values), len(changes)))
    for column, change in enumerate(changes):
        systems = change.around()
        slope = change.slope([_numbers(system, r, swept.tables) for system in systems])
        out[:, column] = _work_of_rows(trajectory, swept, slope)
        if free:
            starts = [tree_compiled(system).start for system in systems]
            dq = _small_motion(r, at[0], change.slope([start[0] for start in starts]))
            dv = change.slope([start[1] for start in starts])
            out[:, column] += by_start[0] @ dq + by_start[1] @ dv
        # where an objective refers to the start, the first node moves; what its seeds say of it is known
        held = [_held(r, system, free=free) for system in systems]
        out[:, column] += [float(change.slope([value(one) for one in held])) for value in values]
    return out


def _beyond_the_first(trajectory: TreeTrajectory, seeds: NodeSeeds, swept: Swept) -> tuple[Array, Array]:
    """(R, n) and (R, n + states + cuts) slopes of the rows by the start, less what their seeds at the first
    node say."""
    r, costate = trajectory, swept.costate
    by_q, by_v = costate[:, 0, : r.size].copy(), costate[:, 1].copy()
    for entry in np.flatnonzero(seeds.at[:, 0] == 0):
        row = seeds.at[entry, 1]
        by_q[row] -= seeds.position[entry]
        rates = np.concatenate([seeds.velocity[entry], seeds.states[entry]])
        by_v[row, : len(rates)] -= rates
    return by_q, by_v


def _work_of_rows(trajectory: TreeTrajectory, swept: Swept, slope: Array) -> Array:
    """(R,) what the multipliers of each row do along a direction of all numbers of the tables."""
    tables, full = swept.tables, swept.costate.shape[2]
    moved, work = _along(tables, slope), tree_work(tables, len(trajectory.parts.states), complex)
    work.push[-1, 3:] = -moved.gravity
    q = swept.nodes.position.shape[1]
    scratch = np.zeros(q, complex), np.zeros(full, complex), np.zeros(full, complex)
    out = np.zeros((len(swept.starts), 1))
    for row, start in enumerate(swept.starts):
        mu = np.ascontiguousarray(swept.mu[:, row])
        work_along(moved, work, swept.nodes, int(start), mu, *scratch, out[row])
    return out[:, 0]


def _numbers(system: TreeSystem, trajectory: TreeTrajectory, tables: TreeTables) -> Array:
    """All numbers of the tables of a system on the grid of a run, in one row."""
    try:
        found = tree_on_grid(tree_compiled(system), trajectory.density, tables.times, closing=tables.closing)
    except ValueError:
        found = None
    if found is None or any(
        a.shape != b.shape or (a.size and a.dtype != float and not np.array_equal(a, b))
        for a, b in zip(found, tables, strict=True)
    ):
        raise ValueError(
            "parameter_slopes needs systems of the same bodies, joints and elements at every value of a "
            "parameter, got one of another structure"
        )
    return np.concatenate([part.ravel() for part in found if part.dtype == float])


def _along(tables: TreeTables, slope: Array) -> TreeTables:
    """The tables moved by i tiny along a direction of all their numbers."""
    changed, at = {}, 0
    for name, part in tables._asdict().items():
        if part.dtype == float:
            changed[name] = part + 1j * TINY * slope[at : at + part.size].reshape(part.shape)
            at += part.size
    return tables._replace(**changed)


def _small_motion(trajectory: TreeTrajectory, q: Array, dq: Array) -> Array:
    """(n,) motion of the joints for a change of their coordinates: 2 Im(q* dq) of quaternions."""
    out = np.zeros(trajectory.size)
    for kind, _, first, count, at, _ in trajectory.tables.link:
        if kind != SPHERICAL:
            out[first : first + count] = dq[at : at + count]
            continue
        w, x, dw, dx = q[at], q[at + 1 : at + 4], dq[at], dq[at + 1 : at + 4]
        out[first : first + 3] = 2.0 * (w * dx - dw * x - np.cross(x, dx))
    return out


def _held(trajectory: TreeTrajectory, system: TreeSystem, *, free: bool) -> TreeTrajectory:
    """The states of a run read with the numbers of another system, at whose start its first node stands."""
    r, parts = trajectory, tree_compiled(system)
    nodes = r.nodes
    if free:
        position, velocity = nodes.position.copy(), nodes.velocity.copy()
        position[0], velocity[0] = parts.start
        nodes = nodes._replace(position=position, velocity=velocity)
    tables = tree_on_grid(parts, r.density, r.times, closing=r.tables.closing)
    return replace(r, system=system, tables=tables, nodes=nodes, memo={})
