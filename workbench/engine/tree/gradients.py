"""From a backward sweep to gradients: the multipliers of a run contracted with densities and parameters."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..integration.kinds import Adjoints
from ..integration.seeds import NodeSeeds
from ._kernels.contraction import contract, contract_parameters
from ._kernels.tables import TreeRun, TreeTables
from .trajectory import TreeTrajectory

__all__ = ["Swept", "TreeGradient", "adjoints_of"]

Array = np.ndarray[Any, Any]

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
        return trajectory.by_density(_by_scale(trajectory, sweep(trajectory, seeds)))

    def by_parameter(trajectory: TreeTrajectory, seeds: NodeSeeds) -> TreeGradient:
        return _by_parameter(trajectory, seeds, sweep(trajectory, seeds))

    return Adjoints(by_density=by_density, by_parameter=by_parameter)


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
    law: (9, N) by the laws' parameters, row j as in `law.names`.
    natural_length: (N,).
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
    law, length = np.zeros((9, count)), np.zeros(count)
    spring, ball = np.zeros(tables.spring.shape), np.zeros((2, len(tables.ball)))
    coupling, inertia = np.zeros((3, len(tables.coupling))), np.zeros((10, links))
    bushing = np.zeros((15, len(tables.bushing_pair)))
    contract_parameters(
        tables, r.work, swept.nodes, int(swept.starts[0]), np.ascontiguousarray(swept.mu[:, 0]),
        np.zeros((links + 1, 6)), law, length, spring, ball, coupling, bushing, inertia, np.zeros(9),
        np.zeros((3, 6)), np.zeros((26, 1), complex),
    )  # fmt: skip
    order = np.argsort(r.parts.order)
    # a limit of 1e30 N is none
    bushing[6, tables.bushing[6] >= NO_CAP] = 0.0
    mass, centre, matrix = _by_body(r, inertia)
    by_q, by_v = swept.costate[0]
    return TreeGradient(
        density=r.by_density(density)[0] + seeds.density[0], law=law[:, order], natural_length=length[order],
        spring=spring[[0, 1, 2, 3, 4, 5, 7]], spherical_spring=ball, coupling=coupling, bushing=bushing,
        mass=mass, centre=centre, inertia=matrix, position=by_q[: r.size], velocity=by_v[: r.size],
        state=by_v[r.size :],
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
