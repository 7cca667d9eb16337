"""Runs of trees, and the gradients of what was computed."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.outcome import Diagnosis
from ..integration.schemes import GeneralisedAlpha, RungeKutta8, Scheme
from ..integration.seeds import NodeSeeds
from ._kernels.alpha import march, tangents_again
from ._kernels.alpha_adjoint import sweep
from ._kernels.tables import tree_run, tree_work
from .compiled import tree_compiled, tree_on_grid
from .explicit import run_explicit
from .gradients import Swept, adjoints_of
from .system import TreeSystem
from .trajectory import TreeTrajectory

__all__ = ["run"]

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
    """Run a tree on the time grid `times`: generalised-alpha on the group, or order 8 in charts.

    keep: keep the tangents for gradients, where they are not too many; without them a gradient takes half
    again as long and a run a third less.  start: q and v (states behind the velocities) in place of those of
    the joints. Raises NotConverged, NotSupported for other schemes, ValueError for a wrong number of
    densities.
    """
    if isinstance(scheme, RungeKutta8):
        return run_explicit(system, density, times, scheme, start=start)
    if not isinstance(scheme, GeneralisedAlpha):
        raise NotSupported(f"trees run with GeneralisedAlpha or RungeKutta8, not {type(scheme).__name__}")
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
        nodes=nodes, adjoints=adjoints_of(_sweep),
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


def _sweep(trajectory: TreeTrajectory, seeds: NodeSeeds) -> Swept:
    """Back over the steps of generalised-alpha."""
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
    return Swept(r.tables, r.nodes, seeds.starts, mu, costate[:, :2])
