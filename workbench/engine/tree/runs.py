"""Runs of trees, and the gradients of what was computed."""

import logging
from collections.abc import Iterator
from functools import partial
from typing import Any, NoReturn

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.grids import step_changes
from ..integration.outcome import Diagnosis
from ..integration.run_state import Course, RunState, checked_start, earlier_nodes
from ..integration.schemes import GeneralisedAlpha, RungeKutta8, Scheme
from ..integration.seeds import NodeSeeds
from ._kernels.alpha import tangents_again
from ._kernels.alpha_adjoint import sweep
from ._kernels.surfaces import surface_histories
from ._kernels.tables import TreeRun, TreeTables, TreeWork, tree_run, tree_work
from .compiled import TreeCompiled, tree_compiled, tree_on_grid
from .explicit import run_explicit
from .gradients import Swept, adjoints_of
from .loops.histories import acceleration_slopes, cut_gaps
from .steps.halved import TakenSteps, closing_of, marched
from .system import TreeSystem
from .trajectory import TreeTrajectory

__all__ = ["run", "run_from"]

Array = np.ndarray[Any, Any]
LOG = logging.getLogger("workbench.engine")

# bytes of tangents that a run keeps; beyond, the adjoint evaluates them again. A layout holds the runs of all
# its cases at several designs at once, and filling fresh memory costs a run more than evaluating again
MEMORY = 1e7
IMPLIED = 1e-6  # m or rad: rounding near places where conditions hardly differ
STRETCH = 1e7  # bytes of tangents that are evaluated again at a time


def run(
    system: TreeSystem,
    density: Array,
    times: Array,
    scheme: Scheme,
    *,
    keep: bool = True,
    start: tuple[Array, Array] | RunState | None = None,
) -> TreeTrajectory:
    """Run a tree on the time grid `times`: generalised-alpha on the group, or order 8 in charts.

    keep: keep the tangents for gradients, where they are not too many; without them a gradient takes half
    again as long and a run a third less.  start: q and v (states behind the velocities) in place of those of
    the joints, or what an earlier run left, which goes on. Raises NotConverged, NotSupported for other
    schemes, ValueError for a wrong number of densities.
    """
    parts = tree_compiled(system)
    left = start if isinstance(start, RunState) else None
    states, cuts = len(parts.states), len(parts.start[1]) - len(parts.arrays["column"]) - len(parts.states)
    checked_start(left, scheme, (len(parts.start[0]), len(parts.arrays["column"]), cuts, states))
    again = partial(run, system, density, scheme=scheme, keep=keep, start=start)
    course = Course(start=left, until=again)
    if isinstance(scheme, RungeKutta8):
        if system.cuts:
            raise NotSupported("order 8 holds no cut joints: places would drift apart. Take GeneralisedAlpha")
        return run_explicit(system, density, times, scheme, start=start, course=course)
    if not isinstance(scheme, GeneralisedAlpha):
        raise NotSupported(f"trees run with GeneralisedAlpha or RungeKutta8, not {type(scheme).__name__}")
    if system.cuts and scheme.rho > 0.99:
        raise NotSupported(
            f"cut joints need rho <= 0.99: above, their forces alternate; got rho={scheme.rho}"
        )
    before = left.known - 1 if left is not None else 0  # nodes of an earlier run in front
    grid = _grid(parts, times, left)
    tables = tree_on_grid(parts, density, times, closing=closing_of(scheme, grid[0]))
    keep = keep and 24 * len(times) * parts.size**2 <= MEMORY
    begin = parts.start if start is None or isinstance(start, RunState) else start
    nodes, all_tables = tree_run(begin, before + len(times), keep=keep), tables
    if left is not None:
        _take_over(nodes, left)
        all_times = np.concatenate([left.earlier["times"][:-1], times])
        grid = np.concatenate([np.tile(grid[:, :1], before), grid], axis=1)
        all_tables = tree_on_grid(parts, density, all_times, closing=closing_of(scheme, grid[0]))
    work = tree_work(all_tables, len(parts.states))
    asked = TakenSteps(tables=all_tables, nodes=nodes, grid=grid, at=np.arange(before + len(times)))
    taken, failed = marched(
        partial(tree_on_grid, parts, density), parts.pattern, scheme, asked, work,
        0 if left is None else left.known,
    )  # fmt: skip
    if failed:
        _stop(system, scheme, taken, work, failed)
    taken = taken.from_node(before)
    notices = () if taken.whole else (taken.sentence(),)
    for sentence in notices:
        LOG.info(sentence)
    aside = tuple(name for name, kept in zip(parts.cut_rows.names, parts.kept, strict=True) if not kept)
    trajectory = TreeTrajectory(
        system=system, density=np.asarray(density, float), scheme=scheme, times=times, tables=tables,
        nodes=taken.asked(), taken=None if taken.whole else taken, adjoints=adjoints_of(_sweep),
        course=course, last=_last,
        diagnosis=Diagnosis(
            newton_iterations=int(nodes.counts[0]), factorisations=int(nodes.counts[1]), redundant_rows=aside,
            notices=notices, halved=taken.halved,
            reason="joint coordinates, generalised-alpha on the group of the joints"
            + (", index 3 for the cut joints" if parts.cuts else ""),
        ),
    )  # fmt: skip
    if aside:
        _check_redundant(trajectory)
    return trajectory


def _take_over(nodes: TreeRun, left: RunState) -> None:
    """Write what an earlier run left into the first nodes and the solver's arrays of a run."""
    for name in ("position", "velocity", "rate"):
        getattr(nodes, name)[: left.known] = left.earlier[name]
    nodes.a[:] = left.auxiliary
    nodes.lu[:], nodes.level[:] = left.solver


def _stop(
    system: TreeSystem, scheme: GeneralisedAlpha, taken: TakenSteps, work: TreeWork, failed: int
) -> NoReturn:
    """Raises NotConverged with the time, and the contact that pushed hardest where there is one."""
    times = taken.tables.times
    time = float(times[abs(failed) % len(times)])
    if failed < 0:
        why = "the mass and stiffness leave a motion undetermined: a joint moves nothing that has mass"
    else:
        length = taken.grid[0, failed]
        why = (
            f"{scheme.iterations} Newton steps did not settle the accelerations"
            + (f" of a step of {length:.3g} s, halved {scheme.halvings} times" if scheme.halvings else "")
            + ". Take more steps, or look at the forces near that time"
            + _hardest_contact(system, taken.tables, work, taken.nodes, failed)
        )
    raise NotConverged(f"generalised-alpha stopped at t = {time:.6g} s: {why}", time)


def _taken(trajectory: TreeTrajectory) -> TakenSteps:
    """The steps of a run, those asked for where none was halved."""
    r = trajectory
    if r.taken is not None:
        return r.taken
    return TakenSteps(
        tables=r.tables, nodes=r.nodes, grid=_grid(r.parts, r.times, r.start), at=np.arange(len(r.times))
    )


def _last(trajectory: TreeTrajectory) -> RunState:
    """What a run of generalised-alpha leaves at its last node."""
    r, taken = trajectory, _taken(trajectory)
    nodes = taken.nodes
    return RunState(
        time=float(r.times[-1]), step=float(taken.grid[0, -1]), scheme=r.scheme,
        position=r.position[-1], velocity=r.velocity[-1], acceleration=r.acceleration[-1],
        multiplier=r.multiplier[-1], states=r.states[-1], state_rates=r.state_rates[-1],
        auxiliary=nodes.a.copy(), solver=(nodes.lu.copy(), nodes.level.copy()),
        earlier=earlier_nodes(
            r.start, 2, times=taken.tables.times, position=nodes.position, velocity=nodes.velocity,
            rate=nodes.rate,
        ),
    )  # fmt: skip


def run_from(
    system: TreeSystem, density: Array, times: Array, scheme: Scheme, start: tuple[Array, Array] | None
) -> TreeTrajectory:
    """`run` from a start at the first of `times`, None for the system's own, for runs without gradients."""
    return run(system, density, times, scheme, keep=False, start=start)


def _hardest_contact(system: TreeSystem, tables: TreeTables, work: TreeWork, nodes: TreeRun, at: int) -> str:
    """The contact that pushed hardest at the node that failed or the one before, where one did."""
    done = slice(at + 1)
    force, point = np.zeros((2, at + 1, len(tables.surface), 3))
    surface_histories(
        tables, work, nodes.position[done], nodes.velocity[done], nodes.rate[done], len(tables.column), force,
        point,
    )  # fmt: skip
    pushes = np.linalg.norm(force[-2:, : len(system.contacts)], axis=2)
    pushes = np.where(np.isfinite(pushes), pushes, 0.0).max(axis=0)
    if not pushes.any():
        return ""
    i = int(pushes.argmax())
    met = system.contacts[i]
    shape = type(met.shape).__name__.lower()
    return f": contacts[{i}] of '{met.a}' on '{met.b}' ({shape}) pushes hardest, {pushes[i]:.3g} N"


def _check_redundant(trajectory: TreeTrajectory) -> None:
    """Raises NotConverged where a condition that others implied at the start does not hold later."""
    gaps = np.abs(cut_gaps(trajectory)) * ~trajectory.parts.kept
    if gaps.max() > IMPLIED:
        node, row = np.unravel_index(int(gaps.argmax()), gaps.shape)
        raise NotConverged(
            f"{trajectory.parts.cut_rows.names[row]} followed from the others at the start only: at t = "
            f"{trajectory.times[node]:.6g} s it is open by {gaps.max():.3g} m or rad. The loop is "
            "over-constrained; take cut joints with fewer conditions",
            float(trajectory.times[node]),
        )


def _grid(parts: TreeCompiled, times: Array, start: RunState | None) -> Array:
    """(2, nodes) lengths of the steps, and the factor of the auxiliary acceleration before each."""
    return step_changes(times, joints=len(parts.cuts) > 0, before=None if start is None else start.step)


def _stretches(trajectory: TreeTrajectory, last: int) -> Iterator[tuple[int, tuple[Array, Array, Array]]]:
    """First node and tangents of stretches of nodes up to `last`, the latest first: kept, or evaluated
    again."""
    r, n, taken = trajectory, trajectory.parts.size, _taken(trajectory)
    nodes = taken.nodes
    least = 0 if r.start is None else 1  # a start that is given solves no equations
    if len(nodes.stiffness) == len(nodes.position):
        yield least, (nodes.stiffness[least:], nodes.damping[least:], nodes.factors[least:])
        return
    assert isinstance(r.scheme, GeneralisedAlpha)
    size = max(1, min(last + 1, int(STRETCH // (24 * n * n))))
    room = np.empty((3, size, n, n))
    for end in range(last + 1, least, -size):
        first = max(least, end - size)
        part = room[0, : end - first], room[1, : end - first], room[2, : end - first]
        tangents_again(
            taken.tables, r.work, r.parts.pattern, nodes, r.scheme.numbers, taken.grid, first, *part
        )
        yield first, part


def _sweep(trajectory: TreeTrajectory, seeds: NodeSeeds) -> Swept:
    """Back over the steps of generalised-alpha."""
    r, n, rows = trajectory, trajectory.parts.size, len(seeds.starts)
    assert isinstance(r.scheme, GeneralisedAlpha)
    entries = np.zeros((len(seeds.at), 3, n))
    entries[:, 0, : r.size], entries[:, 2, : r.size] = seeds.position, seeds.acceleration
    conditions = n - len(r.tables.cut)
    entries[:, 1, : r.size], entries[:, 1, r.size : conditions] = seeds.velocity, seeds.states
    entries[:, 2, conditions:] = seeds.multiplier
    taken = _taken(r)
    starts = taken.at[seeds.starts]
    at = np.column_stack([taken.at[seeds.at[:, 0]], seeds.at[:, 1]])
    last = int(starts.max(initial=0))
    mu, costate = np.empty((last + 1, rows, n)), np.zeros((rows, 4, n))
    mu[0] = 0.0
    for first, tangents in _stretches(r, last):
        sweep(
            taken.tables, r.work, r.parts.pattern, taken.nodes, r.scheme.numbers, taken.grid, first,
            *tangents, starts, at, entries, costate, np.empty((1, n)), mu,
        )  # fmt: skip
    if r.start is not None:
        for entry in np.flatnonzero(seeds.at[:, 0] == 0):
            costate[seeds.at[entry, 1], [0, 1, 3]] += entries[entry]
    elif conditions < n:  # at the start the kernel's rows of conditions are accelerations, without slopes
        by_q, by_v = acceleration_slopes(r)
        costate[:, 0, : r.size] += mu[0, :, conditions:] @ by_q
        costate[:, 1, : r.size] += mu[0, :, conditions:] @ by_v
    return Swept(taken.tables, taken.nodes, starts, mu, costate[:, :2])
