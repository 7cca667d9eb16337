"""Runs of trees, and the gradients of what was computed."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.schemes import GeneralisedAlpha, Scheme
from ._kernels.alpha import march
from ._kernels.alpha_adjoint import sweep
from ._kernels.contraction import contract, contract_parameters
from ._kernels.tables import tree_run, tree_work
from .compiled import tree_compiled, tree_on_grid
from .system import TreeSystem
from .trajectory import TreeTrajectory

__all__ = ["TreeGradient", "simulate_tree", "tree_gradients", "tree_parameter_gradient"]

Array = np.ndarray[Any, Any]

MEMORY = 2e9  # bytes of tangents that a run may keep


def simulate_tree(
    system: TreeSystem,
    density: Array,
    times: Array,
    scheme: Scheme | None = None,
    *,
    keep: bool = True,
    start: tuple[Array, Array] | None = None,
) -> TreeTrajectory:
    """Run a tree on the time grid `times` with generalised-alpha on the group of its joints.

    keep: keep the tangents for gradients.  start: q and v (states behind the velocities) in place of those of
    the joints. Raises NotConverged, NotSupported for other schemes, ValueError for a wrong number of
    densities.
    """
    scheme = GeneralisedAlpha() if scheme is None else scheme
    if not isinstance(scheme, GeneralisedAlpha):
        raise NotSupported(f"trees run with GeneralisedAlpha, not {type(scheme).__name__}")
    parts = tree_compiled(system)
    tables = tree_on_grid(parts, density, times)
    work = tree_work(tables, len(parts.states))
    size = 3 * 8 * len(times) * parts.size**2
    if keep and size > MEMORY:
        raise NotSupported(
            f"the tangents of {len(times) - 1} steps with {parts.size} unknowns take {size / 1e9:.1f} GB, "
            f"more than {MEMORY / 1e9:.0f}; run with keep=False, or in parts"
        )
    run = tree_run(parts.start if start is None else start, len(times), keep=keep)
    h = float(times[1] - times[0])
    failed = march(tables, work, parts.pattern, run, scheme.numbers, h, scheme.tolerance, scheme.iterations)
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
        system=system, density=np.asarray(density, float), scheme=scheme, times=times, tables=tables, run=run,
        newton=int(run.counts[0]), factorisations=int(run.counts[1]),
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seeds:
    """Seeds of R objectives, latest node first; objectives in the order of their latest nodes."""

    order: Array
    starts: Array
    at: Array
    position: Array
    velocity: Array
    rate: Array
    density: Array


def _seeds(trajectory: TreeTrajectory, objectives: Sequence[Any]) -> _Seeds:
    r, full, joints = trajectory, trajectory.parts.size, trajectory.size
    weights = [sorted(objective.weights(r), reverse=True) for objective in objectives]
    starts = np.array([part[0].node if part else 0 for part in weights], np.int64)
    order = np.argsort(-starts, kind="stable")
    entries = sorted(
        ((part.node, row, part) for row, index in enumerate(order) for part in weights[index]), reverse=True
    )
    at = np.array([(node, row) for node, row, _ in entries], np.int64).reshape(-1, 2)
    position, velocity, rate = (np.zeros((len(entries), full)) for _ in range(3))
    density = np.zeros((len(objectives), len(r.density)))
    for entry, (node, row, part) in enumerate(entries):
        quantity = objectives[order[row]].quantity
        for weight, found in ((part.weight, quantity.slopes), (part.rate_weight, quantity.rate_slopes)):
            if weight:
                slopes = found(r, node)
                for table, name in ((position, "position"), (velocity, "velocity"), (rate, "acceleration")):
                    slope = getattr(slopes, name)
                    if slope is not None:
                        table[entry, :joints] += weight * slope
                if slopes.damage is not None:
                    velocity[entry, joints:] += weight * slopes.damage
                if slopes.density is not None:
                    density[row] += weight * slopes.density
    return _Seeds(
        order=order, starts=starts[order], at=at, position=position, velocity=velocity, rate=rate,
        density=density,
    )  # fmt: skip


def _sweep(trajectory: TreeTrajectory, seeds: _Seeds) -> tuple[Array, Array]:
    """mu (nodes, rows, n) and the costates at node 0."""
    r, n, rows = trajectory, trajectory.parts.size, len(seeds.starts)
    if len(r.run.stiffness) < len(r.times):
        raise NotSupported("this run kept no tangents; simulate with keep=True for gradients")
    assert isinstance(r.scheme, GeneralisedAlpha)
    mu, costate = np.empty((int(seeds.starts[0]) + 1, rows, n)), np.zeros((rows, 4, n))
    sweep(
        r.tables, r.work, r.parts.pattern, r.run, r.scheme.numbers, r.step, seeds.starts, seeds.at,
        seeds.position, seeds.velocity, seeds.rate, costate, np.empty((1, n)), mu,
    )  # fmt: skip
    return mu, costate


def _by_density(trajectory: TreeTrajectory, by_scale: Array) -> Array:
    """Slopes by scale in segment order as slopes by density in member order."""
    parts = trajectory.parts
    power, alpha = parts.power, trajectory.density
    slope = np.where(power == 1.0, 1.0, power * np.where(power == 1.0, 1.0, alpha) ** (power - 1.0))
    return np.asarray(by_scale[..., np.argsort(parts.order)] * slope)


def tree_gradients(trajectory: TreeTrajectory, objectives: Sequence[Any]) -> Array:
    """(R, N) dG/dalpha of several objectives of one run, exact for the computed values."""
    r = trajectory
    seeds = _seeds(r, objectives)
    mu, _ = _sweep(r, seeds)
    found = np.zeros((len(objectives), len(r.density)))
    contract(r.tables, r.work, r.run, seeds.starts, mu, np.zeros((len(r.tables.link) + 1, 6)), found)
    out = np.empty_like(found)
    out[seeds.order] = _by_density(r, found) + seeds.density
    return out


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


def tree_parameter_gradient(trajectory: TreeTrajectory, objective: Any) -> TreeGradient:
    """One sweep, contracted with every parameter; the objective's own dependence on parameters other than
    density is not included. Natural lengths and rests that were taken from the start count as given numbers.
    """
    r, tables = trajectory, trajectory.tables
    seeds = _seeds(r, (objective,))
    mu, costate = _sweep(r, seeds)
    count, links = len(r.density), len(tables.link)
    virtual, density = np.zeros((links + 1, 6)), np.zeros((1, count))
    contract(tables, r.work, r.run, seeds.starts, mu, virtual, density)
    law, length = np.zeros((9, count)), np.zeros(count)
    spring, ball = np.zeros(tables.spring.shape), np.zeros((2, len(tables.ball)))
    coupling, inertia = np.zeros((3, len(tables.coupling))), np.zeros((10, links))
    contract_parameters(
        tables, r.work, r.run, int(seeds.starts[0]), np.ascontiguousarray(mu[:, 0]), virtual, law, length,
        spring, ball, coupling, inertia, np.zeros(9), np.zeros((3, 6)),
    )  # fmt: skip
    order = np.argsort(r.parts.order)
    mass, centre, matrix = _by_body(r, inertia)
    return TreeGradient(
        density=_by_density(r, density)[0] + seeds.density[0], law=law[:, order],
        natural_length=length[order], spring=spring[[0, 1, 2, 3, 4, 5, 7]], spherical_spring=ball,
        coupling=coupling, mass=mass, centre=centre, inertia=matrix, position=costate[0, 0, : r.size],
        velocity=costate[0, 1, : r.size], state=costate[0, 1, r.size :],
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
