"""The discrete adjoints of planar runs on all coordinates.

The compiled sweep of the alpha family, and the loops in Python behind BDF2 and users' laws.

Backwards over the steps, with the transposed matrices of the forward run at its converged states; see
`_kernels/alpha_adjoint`. Cost: about half a forward run, whatever the number of members, and little more for
several objectives of one run.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..integration.changes import Multipliers, OfStates
from ..integration.grids import step_changes
from ..integration.loops import Pulled, alpha_adjoint_loop, bdf2_adjoint_loop
from ..integration.schemes import BDF2, GeneralisedAlpha, VelocityVerlet
from ..integration.seeds import NodeSeeds, Seeds, row_by_row
from ._kernels.alpha_adjoint import alpha_adjoint, linearise
from ._kernels.contraction import contract_history
from ._kernels.tables import DamageSweep, SpringTables, Tables, Work, work_space
from .compiled import acting_tables, compiled
from .equations import SampledEquations
from .parameters import adjoints_of
from .start import proximal
from .trajectory import Trajectory

__all__ = ["COMPILED", "LOOP"]

Array = np.ndarray[Any, Any]

ROWS = 64e6  # bytes of adjoint states that one sweep over several rows may hold
STRETCH = 4e5  # bytes of tangents that are evaluated again at a time: they stay in a processor's cache


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
        by_scale, _ = _sweep(r, part)
        for at, row in zip(rows, by_scale, strict=True):
            out[at] = r.by_density(row)
    return out


def _told(trajectory: Trajectory, seeds: NodeSeeds) -> tuple[Array, Multipliers]:
    """Slopes by scale and multipliers of one row of seeds from the compiled sweep."""
    gradient, (mu, nu, costate, eta) = _sweep(trajectory, seeds)
    r, count = trajectory.nodes, len(mu)
    return gradient[0], Multipliers(
        times=r.times[:count], q=r.position[:count], v=r.velocity[:count], w=r.acceleration[:count],
        lam=r.multiplier[:count], mu=np.ascontiguousarray(mu[:, 0]), nu=_of_index_3(nu[:, 0]),
        by_q=costate[0, 0], by_v=costate[0, 1], whole=False,
        states=None if eta is None else OfStates(z=r.states[:count], eta=eta[:, 0]),
    )  # fmt: skip


def _of_index_3(nu: Array) -> Array:
    """(nodes, 3, m) adjoints of Phi at all nodes but the start, of Phi'' there."""
    out = np.zeros((len(nu), 3, nu.shape[1]))
    out[1:, 0] = nu[1:]
    out[0, 2] = nu[0]
    return out


def _pulled(trajectory: Trajectory, seeds: Seeds) -> Pulled:
    """The loop in Python behind BDF2, or behind users' laws."""
    equations = SampledEquations(compiled(trajectory.system), trajectory.tables)
    scheme: Any = trajectory.scheme
    if isinstance(scheme, BDF2):
        before = 0 if trajectory.start is None else trajectory.start.known - 1
        return bdf2_adjoint_loop(equations, trajectory.step, trajectory.nodes, seeds, before)
    grid, given = _grid(trajectory), trajectory.start is not None
    return alpha_adjoint_loop(equations, scheme, grid, trajectory.nodes, seeds, given=given)


def _told_by_loop(trajectory: Trajectory, seeds: Seeds) -> tuple[Array, Multipliers]:
    found, r = _pulled(trajectory, seeds), trajectory.nodes
    count = len(found.mu)
    return found.gradient, Multipliers(
        times=r.times[:count], q=r.position[:count], v=r.velocity[:count], w=r.acceleration[:count],
        lam=r.multiplier[:count], mu=found.mu, nu=_of_index_3(found.nu), by_q=found.by_q, by_v=found.by_v,
        whole=False,
    )  # fmt: skip


COMPILED = adjoints_of(_swept, _told)
LOOP = adjoints_of(
    lambda r, seeds: row_by_row(r, seeds, lambda r, s: _pulled(r, s).gradient),
    lambda r, seeds: _told_by_loop(r, seeds.dense(0)),
)


def _acting(trajectory: Trajectory) -> tuple[Tables, Work]:
    """The acting tables of a run and work arrays for them, made once."""
    memo = trajectory.memo
    if "acting" not in memo:
        few = acting_tables(trajectory.tables)
        memo["acting"] = few, trajectory.work if few is trajectory.tables else work_space(few)
    found: tuple[Tables, Work] = memo["acting"]
    return found


def _grid(trajectory: Trajectory) -> Array:
    """(2, nodes) lengths of the steps, and the factor of the auxiliary acceleration before each."""
    memo = trajectory.memo
    if "grid" not in memo:
        before, joints = (
            None if trajectory.start is None else trajectory.start.step,
            trajectory.multiplier.shape[1] > 0,
        )
        memo["grid"] = step_changes(trajectory.nodes.times, joints=joints, before=before)
    found: Array = memo["grid"]
    return found


def _stretches(trajectory: Trajectory, last: int) -> Iterator[tuple[int, tuple[Array, ...]]]:
    """First node and tangents of stretches of nodes, the latest first: those kept, or evaluated again."""
    r, kept = trajectory.nodes, trajectory.tangents
    n, m, states = r.position.shape[1], r.multiplier.shape[1], r.states.shape[1]
    least = 0 if trajectory.start is None else 1  # a start that is given solves no equations
    if kept is not None and len(kept.stiffness):
        trajectory.complete_tangents()
        whole = kept.stiffness, kept.damping, kept.jacobian, np.empty((len(r.times), 0, 10))
        yield least, tuple(x[least:] for x in whole)
        return
    tables, work = _acting(trajectory)
    grid = _grid(trajectory)
    size = min(last + 1, max(1, int(STRETCH // (8 * n * (2 * n + m) + 80 * states))))
    k, c = np.empty((size, n, n)), np.empty((size, n, n))
    j, b = np.empty((size, m, n)), np.empty((size, states, 10))
    for end in range(last + 1, least, -size):
        first = max(least, end - size)
        part = tuple(x[: end - first] for x in (k, c, j, b))
        linearise(
            tables, work, compiled(trajectory.system).saddle, first, grid, r.position, r.velocity,
            r.multiplier, r.states, r.state_rates, *part,
        )  # fmt: skip
        yield first, part


def _state_sweep(trajectory: Trajectory, start: NodeSeeds) -> DamageSweep:
    """The states' part of a sweep, before its first stretch."""
    r, tables, work = trajectory.nodes, trajectory.tables, trajectory.work
    rows, states = len(start.starts), r.states.shape[1]
    return DamageSweep(
        state_pair=tables.state_pair, pair=tables.pair, motion=tables.motion,
        q=work.q, v=work.v, turn=work.turn, big=work.big, row_g=work.row_g,
        rates=r.velocity, seed=start.states, slopes=np.empty((0, states, 10)),
        costate=np.zeros((rows, 2, states)), eta=np.zeros((int(start.starts[0]) + 1, rows, states)),
    )  # fmt: skip


def _sweep(
    trajectory: Trajectory, start: NodeSeeds
) -> tuple[Array, tuple[Array, Array, Array, Array | None]]:
    """(R, N) by scale in segment order; mu, nu, the costates at the start and the states' adjoints."""
    scheme = trajectory.scheme
    assert isinstance(scheme, GeneralisedAlpha | VelocityVerlet)
    r, tables, work = trajectory.nodes, trajectory.tables, trajectory.work
    n, m, states = r.position.shape[1], r.multiplier.shape[1], r.states.shape[1]
    total, count, rows = n + m, len(trajectory.density), len(start.starts)
    nodes, pairs = int(start.starts[0]) + 1, len(tables.pair)
    gradient = np.zeros((rows, count))
    shift = proximal(tables, redundant=len(trajectory.diagnosis.redundant_rows) > 0)
    mu, nu, costate = np.empty((nodes, rows, n)), np.empty((nodes, rows, m)), np.zeros((rows, 4, n))
    mu[0], nu[0] = 0.0, 0.0
    band = compiled(trajectory.system).saddle
    size = total, total if band is None else 3 * int(band.width[0]) + 1
    space = (
        np.empty(size), np.empty(size) if shift else None, np.empty((rows, total)), np.empty((3, total)),
        np.empty(total, np.int64), shift, costate, mu, nu,
    )  # fmt: skip
    sweep, grid = _state_sweep(trajectory, start) if states else None, _grid(trajectory)
    for first, (k, c, j, slopes) in _stretches(trajectory, nodes - 1):
        alpha_adjoint(
            tables.mass, band, scheme.numbers, grid, first, r.position, start.starts, start.at,
            start.position, start.velocity, start.acceleration, start.multiplier,
            *space, k, c, j, None if sweep is None else sweep._replace(slopes=slopes),
        )  # fmt: skip
    plain = rows == 1 and isinstance(tables, SpringTables)
    contract_history(
        tables, work, start.starts, r.position, r.velocity, mu, np.empty((nodes, pairs, 8)),
        np.empty((pairs, nodes, rows, 3)), None if plain else np.empty((3, count)), gradient,
    )  # fmt: skip
    return gradient, (mu, nu, costate, None if sweep is None else sweep.eta)
