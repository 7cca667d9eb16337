"""Runs of trees with the explicit scheme of order 8, and their sweep backwards."""

from typing import Any

import numpy as np

from ..errors import NotConverged
from ..integration.dop853_tableau import STAGES, A, B, C
from ..integration.grids import step_lengths
from ..integration.outcome import Diagnosis
from ..integration.run_state import Course, RunState
from ..integration.schemes import RungeKutta8
from ..integration.seeds import NodeSeeds
from ._kernels.rk8 import march_rk8, sweep_rk8
from ._kernels.tables import tree_run, tree_work
from .compiled import tree_compiled, tree_on_grid
from .gradients import Swept, adjoints_of
from .system import TreeSystem
from .trajectory import TreeTrajectory

__all__ = ["run_explicit"]

Array = np.ndarray[Any, Any]

ROW = STAGES + 1  # points of a step: its node, then its stages


def run_explicit(
    system: TreeSystem,
    density: Array,
    times: Array,
    scheme: RungeKutta8,
    *,
    start: tuple[Array, Array] | RunState | None = None,
    course: Course | None = None,
) -> TreeTrajectory:
    """Run a tree with order 8; for smooth forces and steps that resolve the fastest motion.

    Raises NotConverged where the run leaves all bounds or a joint moves nothing that has mass.
    """
    parts = tree_compiled(system)
    steps, lengths = len(times) - 1, _lengths(times, course)
    grid = (times[:-1, None] + lengths[1:, None] * np.append(0.0, C)).ravel()
    tables = tree_on_grid(parts, density, np.append(grid, times[-1]))
    work = tree_work(tables, len(parts.states))
    begin = (
        (start.position, np.append(start.velocity, start.states)) if isinstance(start, RunState) else start
    )
    points = tree_run(parts.start if begin is None else begin, ROW * steps + 1, keep=False)
    failed = march_rk8(
        tables, work, parts.pattern, points, A, B, lengths, steps, np.zeros((STAGES, parts.size))
    )
    if failed:
        time = float(times[abs(failed)])
        why = (
            "the state left all bounds: the steps are too long for the forces. Take more, or GeneralisedAlpha"
            if failed > 0
            else "the mass leaves a motion undetermined: a joint moves nothing that has mass"
        )
        raise NotConverged(f"order 8 stopped before t = {time:.6g} s: {why}", time)
    nodes = tree_run((points.position[0], points.velocity[0]), len(times), keep=False)._replace(
        **{name: getattr(points, name)[::ROW].copy() for name in ("position", "velocity", "rate", "move")}
    )
    return TreeTrajectory(
        system=system, density=np.asarray(density, float), scheme=scheme, times=times,
        tables=tree_on_grid(parts, density, times), nodes=nodes, adjoints=adjoints_of(_sweep),
        points=(tables, points), course=course, last=_last,
        diagnosis=Diagnosis(
            newton_iterations=0, factorisations=STAGES * steps, redundant_rows=(),
            reason="joint coordinates, order 8 in a chart about every node",
        ),
    )  # fmt: skip


def _lengths(times: Array, course: Course | None) -> Array:
    """(steps + 1,) lengths of the steps."""
    return step_lengths(times, None if course is None or course.start is None else course.start.step)


def _last(trajectory: TreeTrajectory) -> RunState:
    """What a run leaves at its last node: places, velocities and states are all that order 8 looks at."""
    r = trajectory
    return RunState(
        time=float(r.times[-1]), step=float(_lengths(r.times, r.course)[-1]), scheme=r.scheme,
        position=r.position[-1], velocity=r.velocity[-1], acceleration=r.acceleration[-1],
        multiplier=r.multiplier[-1], states=r.states[-1], state_rates=r.state_rates[-1],
        auxiliary=np.zeros(0), earlier={"times": r.times[-1:]}, solver=(),
    )  # fmt: skip


def _sweep(trajectory: TreeTrajectory, seeds: NodeSeeds) -> Swept:
    """Back over the stages, row by row."""
    r, n, rows = trajectory, trajectory.parts.size, len(seeds.starts)
    assert r.points is not None
    tables, points = r.points
    last = int(seeds.starts.max(initial=0))
    mu = np.zeros((ROW * last + 1, rows, n))
    costate, lengths = np.zeros((rows, 2, n)), _lengths(r.times, r.course)
    for row in range(rows):
        dense = seeds.dense(row)
        entries = np.zeros((len(r.times), 3, n))
        entries[:, 0, : r.size], entries[:, 2, : r.size] = dense.position, dense.acceleration
        entries[:, 1, : r.size], entries[:, 1, r.size :] = dense.velocity, dense.states
        own = np.zeros((ROW * last + 1, n))
        sweep_rk8(
            tables, r.work, r.parts.pattern, points, A, B, lengths, dense.last, entries, costate[row, 0],
            costate[row, 1], np.zeros((STAGES, 2, n)), np.zeros((7, n)), own,
        )  # fmt: skip
        mu[:, row] = own
    return Swept(tables, points, ROW * seeds.starts, mu, costate)
