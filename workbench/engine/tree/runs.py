"""Runs of trees, and the gradients of what was computed."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.kinds import Adjoints
from ..integration.outcome import Diagnosis
from ..integration.schemes import GeneralisedAlpha, Scheme
from ..integration.seeds import NodeSeeds
from ._kernels.alpha import march, tangents_again
from ._kernels.alpha_adjoint import sweep
from ._kernels.contraction import contract, contract_parameters
from ._kernels.tables import tree_run, tree_work
from .compiled import tree_compiled, tree_on_grid
from .system import TreeSystem
from .trajectory import TreeTrajectory

__all__ = ["TreeGradient", "run"]

Array = np.ndarray[Any, Any]

MEMORY = 1e9  # bytes of tangents that a run keeps; beyond, the adjoint evaluates them again
STRETCH = 1e7  # bytes of tangents that are evaluated again at a time


def run(
    system: TreeSystem,
    density: Array,
    times: Array,
    scheme: Scheme,
    *,
    keep: bool = True,
    start: tuple[Array, Array] | None = None,
) -> TreeTrajectory:
    """Run a tree on the time grid `times` with generalised-alpha on the group of its joints.

    keep: keep the tangents for gradients, where they are not too many; without them a gradient takes half
    again as long and a run a third less.  start: q and v (states behind the velocities) in place of those of
    the joints. Raises NotConverged, NotSupported for other schemes, ValueError for a wrong number of
    densities.
    """
    if not isinstance(scheme, GeneralisedAlpha):
        raise NotSupported(f"trees run with GeneralisedAlpha, not {type(scheme).__name__}")
    parts = tree_compiled(system)
    tables = tree_on_grid(parts, density, times)
    work = tree_work(tables, len(parts.states))
    keep = keep and 24 * len(times) * parts.size**2 <= MEMORY
    nodes = tree_run(parts.start if start is None else start, len(times), keep=keep)
    h = float(times[1] - times[0])
    failed = march(tables, work, parts.pattern, nodes, scheme.numbers, h, scheme.tolerance, scheme.iterations)
    if failed:
        time = float(times[abs(failed) % len(times)])
        why = (
            f"{scheme.iterations} Newton steps did not settle the accelerations. Take more steps, or look at "
            "the forces near that time"
            if failed > 0
            else "the mass and stiffness leave a motion undetermined: a joint moves nothing that has mass"
        )
        raise NotConverged(f"generalised-alpha stopped at t = {time:.6g} s: {why}", time)
    return TreeTrajectory(
        system=system, density=np.asarray(density, float), scheme=scheme, times=times, tables=tables,
        nodes=nodes, adjoints=Adjoints(by_density=by_density, by_parameter=by_parameter),
        diagnosis=Diagnosis(
            newton_iterations=int(nodes.counts[0]), factorisations=int(nodes.counts[1]), redundant_rows=(),
            reason="joint coordinates, generalised-alpha on the group of the joints",
        ),
    )  # fmt: skip


def _stretches(trajectory: TreeTrajectory, last: int) -> Iterator[tuple[int, tuple[Array, Array, Array]]]:
    """First node and tangents of stretches of nodes up to `last`, the latest first: kept, or evaluated
    again."""
    r, n = trajectory, trajectory.parts.size
    if len(r.nodes.stiffness) == len(r.times):
        yield 0, (r.nodes.stiffness, r.nodes.damping, r.nodes.factors)
        return
    assert isinstance(r.scheme, GeneralisedAlpha)
    size = max(1, min(last + 1, int(STRETCH // (24 * n * n))))
    room = np.empty((3, size, n, n))
    for end in range(last + 1, 0, -size):
        first = max(0, end - size)
        part = room[0, : end - first], room[1, : end - first], room[2, : end - first]
        tangents_again(r.tables, r.work, r.parts.pattern, r.nodes, r.scheme.numbers, r.step, first, *part)
        yield first, part


def _sweep(trajectory: TreeTrajectory, seeds: NodeSeeds) -> tuple[Array, Array]:
    """mu (nodes, rows, n) and the costates at node 0."""
    r, n, rows = trajectory, trajectory.parts.size, len(seeds.starts)
    assert isinstance(r.scheme, GeneralisedAlpha)
    entries = np.zeros((len(seeds.at), 3, n))
    entries[:, 0, : r.size], entries[:, 2, : r.size] = seeds.position, seeds.acceleration
    entries[:, 1, : r.size], entries[:, 1, r.size :] = seeds.velocity, seeds.states
    last = int(seeds.starts.max(initial=0))
    mu, costate = np.empty((last + 1, rows, n)), np.zeros((rows, 4, n))
    for first, tangents in _stretches(r, last):
        sweep(
            r.tables, r.work, r.parts.pattern, r.nodes, r.scheme.numbers, r.step, first, *tangents,
            seeds.starts, seeds.at, entries, costate, np.empty((1, n)), mu,
        )  # fmt: skip
    return mu, costate


def by_density(trajectory: TreeTrajectory, seeds: NodeSeeds) -> Array:
    """(R, N) implicit gradients by density in the order of the rows: exact for the computed run."""
    r, links = trajectory, len(trajectory.tables.link)
    mu, _ = _sweep(r, seeds)
    found = np.zeros((len(seeds.starts), len(r.density)))
    contract(r.tables, r.work, r.nodes, seeds.starts, mu, np.zeros((links + 1, 6)), found)
    return r.by_density(found)


@dataclass(frozen=True, slots=True, kw_only=True)
class TreeGradient:
    """Gradient of an objective by what a tree has numbers for.

    density: (N,).  law: (9, N) by the laws' parameters, row j as in `law.names`.  natural_length: (N,).
    spring: (7, springs) by k, c, rest, k_stop, upper, lower, torque.  spherical_spring: (2, B) by k, c.
    coupling: (3, C) by k, c, rest.  mass: (bodies,) by the mass, centre and inertia about it held.  centre:
    (bodies, 3).  inertia: (bodies, 3, 3), about the centre, body's axes: dG = sum of inertia * dI.
    position, velocity: (n,) by small motions of the joints' start and by the initial velocities.  state:
    (x,).
    """

    density: Array
    law: Array
    natural_length: Array
    spring: Array
    spherical_spring: Array
    coupling: Array
    mass: Array
    centre: Array
    inertia: Array
    position: Array
    velocity: Array
    state: Array


def by_parameter(trajectory: TreeTrajectory, seeds: NodeSeeds) -> TreeGradient:
    """One sweep, contracted with every parameter; the objective's own dependence on parameters other than
    density is not included. Natural lengths and rests that were taken from the start count as given numbers.
    """
    r, tables = trajectory, trajectory.tables
    mu, costate = _sweep(r, seeds)
    count, links = len(r.density), len(tables.link)
    virtual, density = np.zeros((links + 1, 6)), np.zeros((1, count))
    contract(tables, r.work, r.nodes, seeds.starts, mu, virtual, density)
    law, length = np.zeros((9, count)), np.zeros(count)
    spring, ball = np.zeros(tables.spring.shape), np.zeros((2, len(tables.ball)))
    coupling, inertia = np.zeros((3, len(tables.coupling))), np.zeros((10, links))
    contract_parameters(
        tables, r.work, r.nodes, int(seeds.starts[0]), np.ascontiguousarray(mu[:, 0]), virtual, law, length,
        spring, ball, coupling, inertia, np.zeros(9), np.zeros((3, 6)),
    )  # fmt: skip
    order = np.argsort(r.parts.order)
    mass, centre, matrix = _by_body(r, inertia)
    return TreeGradient(
        density=r.by_density(density)[0] + seeds.density[0], law=law[:, order], natural_length=length[order],
        spring=spring[[0, 1, 2, 3, 4, 5, 7]], spherical_spring=ball, coupling=coupling, mass=mass,
        centre=centre, inertia=matrix, position=costate[0, 0, : r.size], velocity=costate[0, 1, : r.size],
        state=costate[0, 1, r.size :],
    )  # fmt: skip


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
