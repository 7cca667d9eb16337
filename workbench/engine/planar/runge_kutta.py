"""The explicit scheme of order 8 for smooth systems, and a grid with a node on the peak.

With joints the run is made in independent coordinates (`planar_independent`).
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.dop853_tableau import (
    STAGES,
    A,
    B,
    C,
)
from ..integration.schemes import RungeKutta8
from ..objectives.reductions import Maximum, Minimum
from ._kernels.equations import evaluate
from ._kernels.runge_kutta import rk8_adjoint, rk8_forward
from ._kernels.tables import Tables, Work, work_space
from .compiled import Compiled, compiled, on_grid
from .independent import jointed_rk8
from .trajectory import Diagnosis, Trajectory

__all__ = ["locate_peak", "runge_kutta", "runge_kutta_adjoint"]

Array = np.ndarray[Any, Any]

PEAK_STEPS = 8  # secant steps on dg/dt = 0; three suffice from the Hermite start
NEAR = 1e-6  # of the interval: the last step, not evaluated again


def stage_times(times: Array) -> Array:
    """(12 steps,) the times of all stages."""
    return np.asarray((times[:-1, None] + np.diff(times)[:, None] * C).ravel())


def refuse(parts: Compiled) -> None:
    """Raise NotSupported for systems the explicit scheme cannot treat."""
    if any(b.breakable for b in parts.system.bushings):
        raise NotSupported("explicit Runge-Kutta does not carry the damage of bushings; use GeneralisedAlpha")


def runge_kutta(parts: Compiled, alpha: Array, times: Array) -> Trajectory:
    """Integrate over the nodes `times`, equal or not."""
    refuse(parts)
    if len(parts.arrays["row"]):
        return jointed_rk8(parts, alpha, times)
    tables = on_grid(parts, alpha, times)
    run = _run(parts, alpha, times, *parts.start)
    q, v, w = run.position, run.velocity, run.acceleration
    if not np.isfinite(q).all():
        bad = int(np.flatnonzero(~np.isfinite(q).all(axis=1))[0])
        raise NotConverged(
            f"RungeKutta8 blew up before t = {times[bad]:.6g} s: the step {times[1] - times[0]:.3g} s "
            "is beyond its stability. Take more steps, or GeneralisedAlpha for stiff systems",
            float(times[bad]),
        )
    bushings = np.zeros((len(times), len(tables.bushing_pair)))
    return Trajectory(
        system=parts.system, density=alpha, scheme=RungeKutta8(), times=times, position=q, velocity=v,
        acceleration=w, multiplier=np.zeros((len(times), 0)),
        damage=bushings, damage_rate=bushings.copy(), tables=tables,
        diagnosis=Diagnosis(
            newton_iterations=0, factorisations=0, redundant_rows=(), reason="RungeKutta8 as asked",
        ),
        memo={"stages": run},
    )  # fmt: skip


class _Stages(NamedTuple):
    """States at the nodes and at all stages of a run, and the tables sampled at the stages."""

    position: Array  # (steps + 1, n)
    velocity: Array
    acceleration: Array
    stage_position: Array  # (12 steps, n)
    stage_velocity: Array
    tables: Tables


def _run(
    parts: Compiled, alpha: Array, times: Array, q0: Array, v0: Array, work: Work | None = None
) -> _Stages:
    tables = on_grid(parts, alpha, np.append(stage_times(times), times[-1]))
    n, steps = len(q0), len(times) - 1
    q, v, w = np.zeros((steps + 1, n)), np.zeros((steps + 1, n)), np.zeros((steps + 1, n))
    q[0], v[0] = q0, v0
    stage_q, stage_v = np.zeros((STAGES * steps, n)), np.zeros((STAGES * steps, n))
    work, none = work_space(tables) if work is None else work, np.zeros(0)
    rk8_forward(tables, work, A, B, times, q, v, w, stage_q, stage_v, np.zeros((STAGES, n)))
    evaluate(tables, work, STAGES * steps, q[-1], v[-1], none, work.z, work.zdot, 0.0, False)
    w[-1] = -work.force / tables.mass
    return _Stages(q, v, w, stage_q, stage_v, tables)


def runge_kutta_adjoint(trajectory: Trajectory, last: int, seed_q: Array, seed_v: Array) -> Array:
    """(N,) sum of (dF/dscale)^T mu in segment order, exact for the scheme's own result, without joints."""
    r, parts = trajectory, compiled(trajectory.system)
    gradient = np.zeros(len(r.density))
    if last == 0:
        return gradient
    n, times = r.position.shape[1], r.times[: last + 1].copy()
    run = r.memo.get("stages")
    if run is None:
        run = _run(parts, r.density, times, r.position[0].copy(), r.velocity[0].copy(), r.work)
    rk8_adjoint(
        run.tables, r.work, A, B, times, last, run.stage_position, run.stage_velocity,
        seed_q, seed_v,
        np.zeros((2, n)), np.zeros((STAGES, n)), np.zeros((STAGES, n)), np.zeros(n), gradient,
    )  # fmt: skip
    return gradient


def locate_peak(trajectory: Trajectory, objective: Maximum | Minimum) -> Trajectory:
    """The same run with one more node, exactly on the objective's highest peak (Newton on dg/dt = 0).

    The cubic Hermite between nodes is of order 4; with steps as long as order 8 allows it would be the
    largest error. Returns the trajectory unchanged when the peak is at an end or the quantity has no rate.
    """
    r = trajectory
    if not isinstance(r.scheme, RungeKutta8):
        raise NotSupported(
            "locate_peak is for RungeKutta8 trajectories; GeneralisedAlpha's peaks are refined already"
        )
    if r.splits is not None:
        raise NotSupported("locate_peak is for systems without joints; take more steps near the peak instead")
    peak = objective.peaks(r)[0]
    if peak.at_end or not objective.quantity.has_rates:
        return r
    parts = compiled(r.system)
    a = int(np.searchsorted(r.times, peak.time, side="right") - 1)
    low, high = float(r.times[a]), float(r.times[a + 1])

    def rate(time: float) -> float:
        # a short run is enough: the start (quantities may refer to it) and the step with the peak
        nodes = np.array([a, a + 1] if a == 0 else [0, a, a + 1])
        local = _with_node(parts, r, nodes, time)
        return float(objective.quantity.rates(local, np.array([len(nodes) - 1]))[0])

    time, here = peak.time, rate(peak.time)
    ga, gb = objective.quantity.values(r)[[a, a + 1]]
    da, db = objective.quantity.rates(r, np.array([a, a + 1]))
    s, h = (time - low) / (high - low), high - low
    # curvature of the cubic for the first step, secants after it
    slope = ((6 - 12 * s) * (gb - ga) / h - (4 - 6 * s) * da - (2 - 6 * s) * db) / h
    for _ in range(PEAK_STEPS):
        move = -here / slope if slope != 0.0 else 0.0
        if not low < time + move < high:
            break
        if abs(move) < NEAR * h:  # what is left is this move times the one before
            time += move
            break
        there = rate(time + move)
        if abs(there) >= abs(here):
            break
        slope = (there - here) / move
        time, here = time + move, there
    return _with_node(parts, r, np.arange(len(r.times)), time)


def _with_node(parts: Compiled, r: Trajectory, keep: Array, time: float) -> Trajectory:
    """The nodes `keep` of a run, with one more at `time`, integrated from the node before it."""
    at = int(np.searchsorted(r.times[keep], time, side="right"))
    before = int(keep[at - 1])
    times = np.concatenate([r.times[keep[:at]], [time], r.times[keep[at:]]])
    run = _run(
        parts, r.density, times[at - 1 : at + 1].copy(), r.position[before].copy(), r.velocity[before].copy(),
        r.work,
    )  # fmt: skip
    tables = on_grid(parts, r.density, times)

    def with_it(kept: Array, new: Array) -> Array:
        return np.concatenate([kept[keep[:at]], new[1:], kept[keep[at:]]])

    bushings = np.zeros((len(times), r.damage.shape[1]))
    return replace(
        r, times=times, tables=tables, position=with_it(r.position, run.position),
        velocity=with_it(r.velocity, run.velocity), acceleration=with_it(r.acceleration, run.acceleration),
        multiplier=np.zeros((len(times), 0)), damage=bushings, damage_rate=bushings.copy(),
        memo={"work": r.work},
    )  # fmt: skip
