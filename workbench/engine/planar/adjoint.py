"""The discrete adjoints of planar runs on all coordinates.

The compiled sweep of the alpha family, and the loops in Python behind BDF2 and users' laws.

Backwards over the steps, with the transposed matrices of the forward run at its converged states; see
`_kernels/alpha_adjoint`. Cost: about half a forward run, whatever the number of members, and little more for
several objectives of one run.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.bushing import Bushing
from ..elements.joint_spring import JointSpring
from ..elements.table import PARAMETERS
from ..errors import NotSupported
from ..integration.kinds import Adjoints, no_parameters
from ..integration.loops import alpha_adjoint_loop, bdf2_adjoint_loop
from ..integration.schemes import GeneralisedAlpha, VelocityVerlet
from ..integration.seeds import NodeSeeds, Seeds, row_by_row
from ._kernels.alpha_adjoint import alpha_adjoint, linearise
from ._kernels.contraction import contract_history, contract_parameter_history
from ._kernels.tables import DamageSweep, SpringTables
from .compiled import compiled
from .equations import SampledEquations
from .start import proximal
from .trajectory import Trajectory

__all__ = ["BDF2_LOOP", "COMPILED", "PYTHON", "ByParameter"]

Array = np.ndarray[Any, Any]

ROWS = 64e6  # bytes of adjoint states that one sweep over several rows may hold
STRETCH = 4e5  # bytes of tangents that are evaluated again at a time: they stay in a processor's cache


@dataclass(frozen=True, slots=True, kw_only=True)
class ByParameter:
    """Gradient with respect to everything that has a number.

    density: (N,).
    law: (PARAMETERS, N) by the law's parameters, row j as in `law.names`.
    natural_length: (N,).
    spring: (6, joint springs) by k, c, rest, k_stop, upper, lower.
    bushing: (4, bushings) by k, c, cap, hold.
    element: of `System.elements`, each by its `names`.
    mass, inertia: (free bodies,).
    """

    density: Array
    law: Array
    natural_length: Array
    spring: Array
    bushing: Array
    element: tuple[Array, ...]
    mass: Array
    inertia: Array


def _swept(trajectory: Trajectory, seeds: NodeSeeds) -> Array:
    """(R, N) of the compiled sweep, as many rows at once as memory allows.

    The tangents are evaluated and factored once per step for all rows together; a further row costs a solve.
    """
    r = trajectory
    out = np.empty((len(seeds.starts), len(r.density)))
    # adjoint states and covectors of a row at all nodes
    size = 8 * len(r.times) * (r.position.shape[1] + 3 * len(r.tables.pair))
    some = max(1, int(ROWS // size))
    for first in range(0, len(out), some):
        rows, part = seeds.of_objectives(first, first + some)
        by_scale, _ = _sweep(r, part, detailed=False)
        for at, row in zip(rows, by_scale, strict=True):
            out[at] = r.by_density(row)
    return out


def _swept_parameters(trajectory: Trajectory, seeds: NodeSeeds) -> ByParameter:
    """The same sweep of one row, contracted with every parameter."""
    parts = compiled(trajectory.system)
    gradient, (law, length, element, mass) = _sweep(trajectory, seeds, detailed=True)
    order = np.argsort(parts.order)
    system = trajectory.system
    springs, bushings = len(system.springs), len(system.springs) + len(system.bushings)
    others = zip(system.elements, element.T[bushings:], strict=True)
    return ByParameter(
        density=trajectory.by_density(gradient[0]) + seeds.density[0],
        law=law[:, order],
        natural_length=length[order],
        spring=element[: len(JointSpring.names), :springs],
        bushing=element[: len(Bushing.names), springs:bushings],
        element=tuple(slopes[: len(part.names)] for part, slopes in others),
        mass=mass.reshape(-1, 3)[:, :2].sum(axis=1),
        inertia=mass.reshape(-1, 3)[:, 2],
    )


def _alpha_row(trajectory: Trajectory, seeds: Seeds) -> Array:
    equations = SampledEquations(compiled(trajectory.system), trajectory.tables)
    scheme: Any = trajectory.scheme
    return alpha_adjoint_loop(equations, scheme, trajectory.step, trajectory.nodes, seeds)


def _bdf2_row(trajectory: Trajectory, seeds: Seeds) -> Array:
    equations = SampledEquations(compiled(trajectory.system), trajectory.tables)
    return bdf2_adjoint_loop(equations, trajectory.step, trajectory.nodes, seeds)


def _user_law(trajectory: Trajectory, seeds: NodeSeeds) -> ByParameter:
    parts = compiled(trajectory.system)
    first = int(parts.order[parts.user[0].first])
    raise NotSupported(
        f"parameter_gradient knows the parameters of the engine's own laws only; members[{first}] has a "
        "UserLaw. Take gradient() for the densities, or differences for the parameters of that law"
    )


COMPILED = Adjoints(by_density=_swept, by_parameter=_swept_parameters)
PYTHON = Adjoints(by_density=lambda r, seeds: row_by_row(r, seeds, _alpha_row), by_parameter=_user_law)
BDF2_LOOP = Adjoints(by_density=lambda r, seeds: row_by_row(r, seeds, _bdf2_row), by_parameter=no_parameters)


def _stretches(trajectory: Trajectory, last: int) -> Iterator[tuple[int, tuple[Array, ...]]]:
    """First node and tangents of stretches of nodes, the latest first: those kept, or evaluated again."""
    r, tables, work, kept = trajectory.nodes, trajectory.tables, trajectory.work, trajectory.tangents
    n, m, states = r.position.shape[1], r.multiplier.shape[1], r.states.shape[1]
    if kept is not None and len(kept.stiffness):
        trajectory.complete_tangents()
        yield 0, (kept.stiffness, kept.damping, kept.jacobian, np.empty((len(r.times), 0, 10)))
        return
    size = min(last + 1, max(1, int(STRETCH // (8 * n * (2 * n + m) + 80 * states))))
    k, c = np.empty((size, n, n)), np.empty((size, n, n))
    j, b = np.empty((size, m, n)), np.empty((size, states, 10))
    for end in range(last + 1, 0, -size):
        first = max(0, end - size)
        part = tuple(x[: end - first] for x in (k, c, j, b))
        linearise(
            tables,
            work,
            first,
            trajectory.step,
            r.position,
            r.velocity,
            r.multiplier,
            r.states,
            r.state_rates,
            *part,
        )
        yield first, part


def _state_sweep(trajectory: Trajectory, start: NodeSeeds) -> DamageSweep:
    """The states' part of a sweep, before its first stretch."""
    r, tables, work = trajectory.nodes, trajectory.tables, trajectory.work
    return DamageSweep(
        state_pair=tables.state_pair, pair=tables.pair, motion=tables.motion,
        q=work.q, v=work.v, big=work.big, row_g=work.row_g,
        rates=r.velocity, seed=start.states, slopes=np.empty((0, r.states.shape[1], 10)),
        costate=np.zeros((len(start.starts), 2, r.states.shape[1])),
    )  # fmt: skip


def _sweep(trajectory: Trajectory, start: NodeSeeds, *, detailed: bool) -> tuple[Array, tuple[Array, ...]]:
    """(R, N) by scale in segment order; if detailed (one row only), slopes by all other parameters."""
    scheme = trajectory.scheme
    assert isinstance(scheme, GeneralisedAlpha | VelocityVerlet)
    r, tables, work = trajectory.nodes, trajectory.tables, trajectory.work
    n, m, states = r.position.shape[1], r.multiplier.shape[1], r.states.shape[1]
    total, count, rows = n + m, len(trajectory.density), len(start.starts)
    nodes, pairs = int(start.starts[0]) + 1, len(tables.pair)
    gradient = np.zeros((rows, count))
    shift = proximal(tables, redundant=len(trajectory.diagnosis.redundant_rows) > 0)
    mu = np.empty((nodes, rows, n))
    space = (
        np.empty((total, total)), np.empty((total, total)) if shift else None, np.empty((rows, total)),
        np.empty((2, total)), np.empty(total, np.int64), shift, np.zeros((rows, 4, n)), mu,
    )  # fmt: skip
    sweep = _state_sweep(trajectory, start) if states else None
    for first, (k, c, j, slopes) in _stretches(trajectory, nodes - 1):
        alpha_adjoint(
            tables.mass, scheme.numbers, trajectory.step, first, r.position, start.starts, start.at,
            start.position, start.velocity, start.acceleration, start.multiplier,
            *space, k, c, j, None if sweep is None else sweep._replace(slopes=slopes),
        )  # fmt: skip
    plain = rows == 1 and isinstance(tables, SpringTables)
    contract_history(
        tables, work, start.starts, r.position, r.velocity, mu, np.empty((nodes, pairs, 8)),
        np.empty((pairs, nodes, rows, 3)), None if plain else np.empty((3, count)), gradient,
    )  # fmt: skip
    if not detailed:
        return gradient, ()
    law, length = np.zeros((PARAMETERS, count)), np.zeros(count)
    names = max((len(part.names) for part in trajectory.system.force_elements), default=0)
    element, mass = np.zeros((names, len(tables.element))), np.zeros(n)
    contract_parameter_history(
        tables, work, nodes - 1, r.position, r.velocity, r.acceleration, r.states,
        np.ascontiguousarray(mu[:, 0]), law, length, element, mass,
        np.zeros(PARAMETERS), np.zeros((names, 3)),
    )  # fmt: skip
    return gradient, (law, length, element, mass)
