"""The discrete adjoint of generalised-alpha: exact gradients of computed objectives, for any number of
members.

Backwards over the steps, with the transposed matrices of the forward run at its converged states; see
`_kernels_adjoint`. Cost: about half a forward run, whatever the number of members, and little more for
several objectives of one run. It holds for the index-3 DAE too, where the source had no adjoint (its claim
that an adjoint is not available is refuted here).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.loops import alpha_adjoint_loop, bdf2_adjoint_loop
from ..integration.schemes import (
    BDF2,
    GeneralisedAlpha,
    RungeKutta8,
    VelocityVerlet,
)
from ..objectives.quantities import in_member_order
from ..objectives.reductions import Objective
from ..planar._kernels.alpha_adjoint import alpha_adjoint, linearise
from ..planar._kernels.contraction import contract_history, contract_parameter_history
from ..planar._kernels.tables import DamageSweep, SpringTables
from ..planar.compiled import compiled
from ..planar.equations import PlanarEquations
from ..planar.runge_kutta import runge_kutta_adjoint
from ..planar.runs import proximal
from ..planar.trajectory import Trajectory
from .independent import independent_gradients
from .seeds import NodeSeeds, Seeds, node_seeds, seeds

__all__ = ["ByParameter", "discrete_adjoint", "discrete_adjoints", "parameter_gradient"]

Array = np.ndarray[Any, Any]

ROWS = 64e6  # bytes of adjoint states that one sweep over several rows may hold
STRETCH = 4e5  # bytes of tangents that are evaluated again at a time: they stay in a processor's cache


@dataclass(frozen=True, slots=True, kw_only=True)
class ByParameter:
    """Gradient with respect to everything that has a number.

    density: (N,).  law: (9, N) by the law's parameters, row j as in `law.names`.  natural_length: (N,).
    spring: (6, joint springs) by k, c, rest, k_stop, upper, lower.  bushing: (4, bushings) by k, c, cap,
    hold.
    mass, inertia: (free bodies,).
    """

    density: Array
    law: Array
    natural_length: Array
    spring: Array
    bushing: Array
    mass: Array
    inertia: Array


def discrete_adjoint(trajectory: Trajectory, objective: Objective) -> Array:
    """(N,) dG/dalpha of the computed objective, exact to rounding."""
    return np.asarray(discrete_adjoints(trajectory, (objective,))[0])


def discrete_adjoints(trajectory: Trajectory, objectives: Sequence[Objective]) -> Array:
    """(R, N) gradients of several objectives of one run: one backward sweep carries them all.

    The tangents are evaluated and factored once per step for all rows together; a further row costs a solve.
    """
    r = trajectory
    if r.splits is not None:
        return independent_gradients(r, objectives)
    out = np.empty((len(objectives), len(r.density)))
    if not swept(r):
        for row, objective in enumerate(objectives):
            dense = seeds(r, objective)
            out[row] = in_member_order(r, _one(r, dense)) + dense.density
        return out
    # adjoint states and covectors of a row at all nodes
    size = 8 * len(r.times) * (r.position.shape[1] + 3 * len(r.tables.pair))
    some = max(1, int(ROWS // size))
    for first in range(0, len(objectives), some):
        start = node_seeds(r, objectives[first : first + some])
        by_scale, _ = _sweep(r, start, detailed=False)
        for row, index in enumerate(start.order):
            out[first + index] = in_member_order(r, by_scale[row])
            out[first + index] += start.density[row]
    return out


def swept(trajectory: Trajectory) -> bool:
    """Whether the compiled sweep treats a run, and several rows at once; the other loops take them singly."""
    alpha = isinstance(trajectory.scheme, GeneralisedAlpha | VelocityVerlet)
    return alpha and compiled(trajectory.system).fused


def parameter_gradient(trajectory: Trajectory, objective: Objective) -> ByParameter:
    """The same sweep, contracted with every parameter of members, springs, bushings and bodies.

    The objective's explicit dependence on a parameter other than density (stored energy on k, say) is not
    included. Raises NotSupported for runs of BDF2 and RungeKutta8 and for systems with a UserLaw.
    """
    if not isinstance(trajectory.scheme, GeneralisedAlpha | VelocityVerlet):
        raise NotSupported(
            f"parameter_gradient needs a run of GeneralisedAlpha or VelocityVerlet, got one of "
            f"{type(trajectory.scheme).__name__}; simulate again with GeneralisedAlpha, or take gradient() "
            "for the densities alone"
        )
    parts = compiled(trajectory.system)
    if not parts.fused:
        first = int(parts.order[parts.user[0].first])
        raise NotSupported(
            f"parameter_gradient knows the parameters of the engine's own laws only; members[{first}] has a "
            "UserLaw. Take gradient() for the densities, or differences for the parameters of that law"
        )
    start = node_seeds(trajectory, (objective,))
    gradient, (law, length, spring, bushing, mass) = _sweep(trajectory, start, detailed=True)
    order = np.argsort(parts.order)
    return ByParameter(
        density=in_member_order(trajectory, gradient[0]) + start.density[0],
        law=law[:, order],
        natural_length=length[order],
        spring=spring,
        bushing=bushing[:4],
        mass=mass.reshape(-1, 3)[:, :2].sum(axis=1),
        inertia=mass.reshape(-1, 3)[:, 2],
    )


def _one(trajectory: Trajectory, start: Seeds) -> Array:
    """Order 8, BDF2, and systems with users' laws (their loops are written in Python)."""
    r = trajectory
    if isinstance(r.scheme, RungeKutta8):
        # accelerations are functions of the state, w = -M^-1 F, not states of their own
        if start.acceleration.any():
            raise NotSupported(
                "objectives of the acceleration have no adjoint under RungeKutta8; use GeneralisedAlpha"
            )
        return runge_kutta_adjoint(r, start.last, start.position, start.velocity)
    equations = PlanarEquations(compiled(r.system), r.tables)
    if isinstance(r.scheme, BDF2):
        return bdf2_adjoint_loop(equations, r.step, r, start)
    if not isinstance(r.scheme, GeneralisedAlpha | VelocityVerlet):
        raise NotSupported(f"no discrete adjoint for {type(r.scheme).__name__}")
    return alpha_adjoint_loop(equations, r.scheme, r.step, r, start)


def _stretches(trajectory: Trajectory, last: int) -> Iterator[tuple[int, tuple[Array, ...]]]:
    """First node and tangents of stretches of nodes, the latest first: those kept, or evaluated again."""
    r, tables, work, kept = trajectory, trajectory.tables, trajectory.work, trajectory.tangents
    n, m, bushings = r.position.shape[1], r.multiplier.shape[1], r.damage.shape[1]
    if kept is not None and len(kept.stiffness):
        r.complete_tangents()
        yield 0, (kept.stiffness, kept.damping, kept.jacobian, np.empty((len(r.times), 0, 10)))
        return
    size = min(last + 1, max(1, int(STRETCH // (8 * n * (2 * n + m) + 80 * bushings))))
    k, c = np.empty((size, n, n)), np.empty((size, n, n))
    j, b = np.empty((size, m, n)), np.empty((size, bushings, 10))
    for end in range(last + 1, 0, -size):
        first = max(0, end - size)
        part = tuple(x[: end - first] for x in (k, c, j, b))
        linearise(
            tables, work, first, r.step, r.position, r.velocity, r.multiplier, r.damage, r.damage_rate, *part
        )
        yield first, part


def _damage_sweep(trajectory: Trajectory, start: NodeSeeds) -> DamageSweep:
    """The bushings' part of a sweep, before its first stretch."""
    r, tables, work = trajectory, trajectory.tables, trajectory.work
    return DamageSweep(
        bushing_pair=tables.bushing_pair, pair=tables.pair, motion=tables.motion,
        q=work.q, v=work.v, big=work.big, row_g=work.row_g,
        rates=r.velocity, seed=start.damage, slopes=np.empty((0, r.damage.shape[1], 10)),
        costate=np.zeros((len(start.starts), 2, r.damage.shape[1])),
    )  # fmt: skip


def _sweep(trajectory: Trajectory, start: NodeSeeds, *, detailed: bool) -> tuple[Array, tuple[Array, ...]]:
    """(R, N) by scale in segment order; if detailed (one row only), slopes by all other parameters."""
    scheme = trajectory.scheme
    assert isinstance(scheme, GeneralisedAlpha | VelocityVerlet)
    r, tables = trajectory, trajectory.tables
    n, m, bushings = r.position.shape[1], r.multiplier.shape[1], r.damage.shape[1]
    total, count, rows = n + m, len(r.density), len(start.starts)
    nodes, pairs = int(start.starts[0]) + 1, len(tables.pair)
    gradient = np.zeros((rows, count))
    shift = proximal(tables, redundant=len(r.diagnosis.redundant_rows) > 0)
    mu = np.empty((nodes, rows, n))
    space = (
        np.empty((total, total)), np.empty((total, total)) if shift else None, np.empty((rows, total)),
        np.empty((2, total)), np.empty(total, np.int64), shift, np.zeros((rows, 4, n)), mu,
    )  # fmt: skip
    damage = _damage_sweep(r, start) if bushings else None
    for first, (k, c, j, slopes) in _stretches(r, nodes - 1):
        alpha_adjoint(
            tables.mass, scheme.numbers, r.step, first, r.position, start.starts, start.at,
            start.position, start.velocity, start.acceleration, start.multiplier,
            *space, k, c, j, None if damage is None else damage._replace(slopes=slopes),
        )  # fmt: skip
    plain = rows == 1 and isinstance(tables, SpringTables)
    contract_history(
        tables, r.work, start.starts, r.position, r.velocity, mu, np.empty((nodes, pairs, 8)),
        np.empty((pairs, nodes, rows, 3)), None if plain else np.empty((3, count)), gradient,
    )  # fmt: skip
    if not detailed:
        return gradient, ()
    law, length = np.zeros((9, count)), np.zeros(count)
    spring = np.zeros((6, len(tables.torsion_pair)))
    bushing, mass = np.zeros((5, bushings)), np.zeros(n)
    contract_parameter_history(
        tables, r.work, nodes - 1, r.position, r.velocity, r.acceleration, r.damage,
        np.ascontiguousarray(mu[:, 0]), law, length, spring, bushing, mass, np.zeros(9), np.zeros((5, 3)),
    )  # fmt: skip
    return gradient, (law, length, spring, bushing, mass)
