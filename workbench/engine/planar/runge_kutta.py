"""The explicit scheme of order 8 for smooth systems.

With joints the run is made in independent coordinates (`independent`).
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.changes import Multipliers
from ..integration.dop853_tableau import (
    STAGES,
    A,
    B,
    C,
)
from ..integration.grids import step_lengths
from ..integration.outcome import Diagnosis
from ..integration.run_state import Course, RunState
from ..integration.schemes import RungeKutta8
from ..integration.seeds import Seeds, row_by_row
from ._kernels.equations import evaluate
from ._kernels.runge_kutta import rk8_adjoint, rk8_forward
from ._kernels.tables import Tables, Work, work_space
from .compiled import Compiled, compiled, on_grid
from .independent import jointed_rk8
from .parameters import adjoints_of
from .trajectory import Trajectory

__all__ = ["runge_kutta", "with_node"]

Array = np.ndarray[Any, Any]


def stage_times(times: Array) -> Array:
    """(12 steps,) the times of all stages."""
    return np.asarray((times[:-1, None] + np.diff(times)[:, None] * C).ravel())


def refuse(parts: Compiled) -> None:
    """Raise NotSupported for systems the explicit scheme cannot treat."""
    if parts.system.has_states:
        raise NotSupported(
            "explicit Runge-Kutta does not carry the states of force elements, as the damage of bushings; "
            "use GeneralisedAlpha"
        )


def runge_kutta(parts: Compiled, alpha: Array, times: Array, course: Course) -> Trajectory:
    """Integrate over the nodes `times`, equal or not."""
    refuse(parts)
    if len(parts.arrays["row"]):
        return jointed_rk8(parts, alpha, times, course)
    tables = on_grid(parts, alpha, times)
    start = course.start
    run = _run(parts, alpha, times, *(parts.start if start is None else (start.position, start.velocity)))
    q, v, w = run.position, run.velocity, run.acceleration
    if not np.isfinite(q).all():
        bad = int(np.flatnonzero(~np.isfinite(q).all(axis=1))[0])
        raise NotConverged(
            f"RungeKutta8 blew up before t = {times[bad]:.6g} s: the step {times[1] - times[0]:.3g} s "
            "is beyond its stability. Take more steps, or GeneralisedAlpha for stiff systems",
            float(times[bad]),
        )
    states = np.zeros((len(times), len(tables.state_pair)))
    return Trajectory(
        system=parts.system, density=alpha, scheme=RungeKutta8(), times=times, position=q, velocity=v,
        acceleration=w, multiplier=np.zeros((len(times), 0)),
        states=states, state_rates=states.copy(), tables=tables, adjoints=STAGEWISE,
        diagnosis=Diagnosis(
            newton_iterations=0, factorisations=0, redundant_rows=(), reason="RungeKutta8 as asked",
        ),
        memo={"stages": run}, course=course, last=_last,
    )  # fmt: skip


def _last(trajectory: Trajectory) -> RunState:
    """What a run leaves at its last node: places and velocities are all that order 8 looks at."""
    r, start = trajectory, trajectory.start
    lengths = step_lengths(r.times, None if start is None else start.step)
    return RunState(
        time=float(r.times[-1]), step=float(lengths[-1]), scheme=r.scheme,
        position=r.position[-1], velocity=r.velocity[-1], acceleration=r.acceleration[-1],
        multiplier=r.multiplier[-1], states=r.states[-1], state_rates=r.state_rates[-1],
        auxiliary=np.zeros(0), earlier={"times": r.times[-1:]}, solver=(),
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


class _Swept(NamedTuple):
    """Slopes by scale in segment order, adjoints of the stages and costates at the start."""

    stages: _Stages
    gradient: Array  # (N,)
    mu: Array  # (12 steps up to the last seed, n)
    costate: Array  # (2, n)


def _sweep(trajectory: Trajectory, seeds: Seeds) -> _Swept:
    """Sum of (dF/dscale)^T mu over the stages, exact for the scheme's own result, without joints."""
    # accelerations are functions of the state, w = -M^-1 F, not states of their own
    if seeds.acceleration.any():
        raise NotSupported(
            "objectives of the acceleration have no adjoint under RungeKutta8; use GeneralisedAlpha"
        )
    r, parts, last = trajectory.nodes, compiled(trajectory.system), seeds.last
    gradient = np.zeros(len(trajectory.density))
    n, times = r.position.shape[1], r.times[: last + 1].copy()
    run = trajectory.memo.get("stages")
    if run is None:
        start = r.position[0].copy(), r.velocity[0].copy()
        run = _run(parts, trajectory.density, times, *start, trajectory.work)
    mu, costate = np.zeros((STAGES * last, n)), np.zeros((2, n))
    rk8_adjoint(
        run.tables, trajectory.work, A, B, times, last, run.stage_position, run.stage_velocity,
        seeds.position, seeds.velocity,
        costate, np.zeros((STAGES, n)), np.zeros((STAGES, n)), mu, gradient,
    )  # fmt: skip
    return _Swept(run, gradient, mu, costate)


def _told(trajectory: Trajectory, seeds: Seeds) -> tuple[Array, Multipliers]:
    """Slopes by scale, and what all stages up to the last seed tell."""
    run, gradient, mu, costate = _sweep(trajectory, seeds)
    count = len(mu)
    q, v = run.stage_position[:count], run.stage_velocity[:count]
    return gradient, Multipliers(
        times=run.tables.times[:count], q=q, v=v, w=_accelerations(run.tables, trajectory.work, q, v),
        lam=np.zeros((count, 0)), mu=mu, nu=np.zeros((count, 3, 0)), by_q=costate[0], by_v=costate[1],
        whole=True,
    )  # fmt: skip


def _accelerations(tables: Tables, work: Work, q: Array, v: Array) -> Array:
    """(stages, n) accelerations at the stages."""
    out, none = np.empty_like(q), np.zeros(0)
    for at in range(len(q)):
        evaluate(tables, work, at, q[at], v[at], none, work.z, work.zdot, 0.0, False)
        out[at] = -work.force / tables.mass
    return out


STAGEWISE = adjoints_of(
    lambda r, seeds: row_by_row(r, seeds, lambda r, s: _sweep(r, s).gradient),
    lambda r, seeds: _told(r, seeds.dense(0)),
)


def with_node(parts: Compiled, r: Trajectory, keep: Array, time: float) -> Trajectory:
    """The nodes `keep` of a run without joints and one more at `time`, integrated from the node before."""
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

    states = np.zeros((len(times), r.states.shape[1]))
    return replace(
        r, times=times, tables=tables, position=with_it(r.position, run.position),
        velocity=with_it(r.velocity, run.velocity), acceleration=with_it(r.acceleration, run.acceleration),
        multiplier=np.zeros((len(times), 0)), states=states, state_rates=states.copy(),
        memo={"work": r.work},
    )  # fmt: skip
