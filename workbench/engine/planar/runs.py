"""Runs of planar systems: which loop takes which scheme, and the trajectory it leaves."""

import logging
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.grids import is_even, step_changes, step_lengths
from ..integration.independent import CONSISTENT
from ..integration.loops import alpha_loop, bdf2_loop
from ..integration.outcome import Diagnosis
from ..integration.redundancy import Redundancy, redundancy
from ..integration.run_state import Course, RunState, checked_start, earlier_nodes, earlier_times
from ..integration.schemes import (
    BDF2,
    GeneralisedAlpha,
    IndependentAlpha,
    RungeKutta8,
    Scheme,
    VelocityVerlet,
)
from ._kernels.alpha import SINGULAR, alpha_forward
from ._kernels.tables import (
    SpringTables,
    Tables,
    Work,
    listed,
    work_space,
)
from .adjoint import COMPILED, LOOP
from .compiled import Compiled, acting_tables, compiled, on_grid
from .equations import SampledEquations
from .independent import independent_alpha
from .runge_kutta import runge_kutta
from .start import accelerations_from, check_start, initial_accelerations, proximal
from .system import System
from .trajectory import Tangents, Trajectory

__all__ = ["run", "run_from"]

Array = np.ndarray[Any, Any]
LOG = logging.getLogger("workbench.engine")

KEEP = 32e6  # bytes of tangents that a run keeps for its adjoint; beyond, the adjoint evaluates them again
PREDICTED = 8  # nodes that a step looks at: extrapolation over six, that of the system's start left out
STATE_ARRAYS = ("position", "velocity", "acceleration", "multiplier", "states", "state_rates")
UNDAMPED = 0.99  # above it the alternation of the joint forces may grow: eigenvalue -1, twice, at rho = 1


def run(
    system: System, alpha: Array, times: Array, scheme: Scheme, *, start: RunState | None = None
) -> Trajectory:
    """Run a planar system over the nodes `times`; alpha: (N,) densities.

    start: what an earlier run left, which goes on.
    Raises AssemblyError when the start violates the joints, NotConverged when a step cannot be solved,
    NotSupported when the scheme cannot treat the system.
    """
    parts = compiled(system)
    course = Course(start=start, until=partial(run, system, alpha, scheme=scheme, start=start))
    n = len(parts.start[0])
    sizes = n, n, len(parts.row_names), len(parts.arrays["state_pair"])
    if isinstance(scheme, RungeKutta8):
        checked_start(start, scheme, sizes)
        if not parts.fused:
            raise NotSupported(
                "RungeKutta8 runs the engine's own laws only; use GeneralisedAlpha for a UserLaw"
            )
        return runge_kutta(parts, alpha, times, course)
    jointed = len(parts.row_names) > 0
    if isinstance(scheme, IndependentAlpha):
        if jointed:
            checked_start(start, scheme, sizes)
            return independent_alpha(parts, alpha, times, scheme, course, reason="IndependentAlpha as asked")
        scheme = GeneralisedAlpha(
            rho=scheme.rho, tolerance=scheme.tolerance, iterations=scheme.iterations
        )  # no joints: every coordinate is independent
    if isinstance(scheme, GeneralisedAlpha) and scheme.rho > UNDAMPED and jointed and parts.fused:
        if not system.has_states:
            instead = IndependentAlpha(
                rho=scheme.rho, tolerance=scheme.tolerance, iterations=scheme.iterations
            )
            reason = (
                f"independent coordinates: at rho={scheme.rho:g} the joint forces of the index-3 form would "
                "alternate undamped"
            )
            checked_start(start, instead, sizes)
            return independent_alpha(parts, alpha, times, instead, course, reason=reason)
    checked_start(start, scheme, sizes)
    return _implicit(parts, alpha, times, scheme, course)


def run_from(
    system: System, alpha: Array, times: Array, scheme: GeneralisedAlpha, start: tuple[Array, Array] | None
) -> Trajectory:
    """Run over `times` by generalised-alpha from q and v at the first of them, None for the system's own.

    Joints are not checked at a start that is given. Raises as `run`.
    """
    parts = compiled(system)
    if system.has_states:
        raise NotSupported(
            "a run from a start of its own does not carry states of force elements in the plane"
        )
    if len(parts.row_names) and scheme.rho > UNDAMPED:
        raise NotSupported(
            f"a run from a start of its own needs rho <= {UNDAMPED} with joints, got {scheme.rho}"
        )
    return _implicit(parts, alpha, times, scheme, None, start)


def _implicit(
    parts: Compiled, alpha: Array, times: Array, scheme: GeneralisedAlpha | VelocityVerlet | BDF2,
    course: Course | None, start_at: tuple[Array, Array] | None = None,
) -> Trajectory:  # fmt: skip
    left = None if course is None else course.start
    tables = on_grid(parts, alpha, times)
    if isinstance(scheme, VelocityVerlet) and len(tables.row):
        raise NotSupported("velocity Verlet is explicit and cannot hold joints; use GeneralisedAlpha")
    first = tables if start_at is None and left is None else on_grid(parts, alpha, np.zeros(1))
    q0, v0, phi_q = check_start(parts, first)
    if start_at is not None:
        q0, v0 = start_at
    found = redundancy(parts.row_names, phi_q)
    redundant = len(found.rows) > 0
    marched = tables if left is None else on_grid(parts, alpha, earlier_times(left, times))
    if isinstance(scheme, BDF2) or not parts.fused:
        if parts.system.has_states:
            raise NotSupported(
                "states of force elements, as the damage of breakable bushings, need GeneralisedAlpha and "
                "the engine's own laws"
            )
        begin = (q0, v0, *_start_with_laws(parts, tables, q0, v0)) if left is None else left
        equations, few = SampledEquations(parts, marched), tables
        shift = proximal(tables, redundant=redundant)
        if isinstance(scheme, BDF2):
            nodes = bdf2_loop(equations, scheme, marched.times, begin, shift)
        else:
            nodes = alpha_loop(equations, scheme, marched.times, begin, shift)
        empty = np.zeros((len(times), len(tables.state_pair)))
        made = Run(
            q=nodes.position, v=nodes.velocity, w=nodes.acceleration, lam=nodes.multiplier, z=empty,
            zdot=empty.copy(), info=np.array([0, len(times) - 1, nodes.newton, 0, nodes.newton]),
            left=nodes.left,
        )  # fmt: skip
    else:
        few = acting_tables(marched)
        made = integrate(parts, few, scheme, q0, v0, redundant=redundant, left=left)
        if made.info[0] != 0 or not np.isfinite(made.q[-1]).all():
            raise _failure(parts, alpha, marched.times, scheme, made.info)
    return _agreeing(Trajectory(
        system=parts.system, density=alpha, scheme=scheme, times=times, position=made.q, velocity=made.v,
        acceleration=made.w, multiplier=made.lam, states=made.z, state_rates=made.zdot, tables=tables,
        adjoints=COMPILED if parts.fused and not isinstance(scheme, BDF2) else LOOP,
        tangents=made.tangents, memo=_memo(made, few, tables, marched), course=course,
        last=partial(_state, left=made.left),
        diagnosis=Diagnosis(
            newton_iterations=int(made.info[2]), factorisations=int(made.info[4]),
            redundant_rows=found.rows, reason=f"{type(scheme).__name__} as asked",
            notices=_told(found),
        ),
    ))  # fmt: skip


def _state(trajectory: Trajectory, *, left: tuple[Array, ...]) -> RunState:
    """What a run on all coordinates leaves at its last node: a, and the arrays of its Newton method."""
    r, start = trajectory, trajectory.start
    lengths = step_lengths(r.times, None if start is None else start.step)
    return RunState(
        time=float(r.times[-1]), step=float(lengths[-1]), scheme=r.scheme, position=r.position[-1],
        velocity=r.velocity[-1], acceleration=r.acceleration[-1], multiplier=r.multiplier[-1],
        states=r.states[-1], state_rates=r.state_rates[-1], auxiliary=left[0].copy(),
        solver=tuple(x.copy() for x in left[1:]),
        earlier=earlier_nodes(
            start, PREDICTED, times=r.times, position=r.position, velocity=r.velocity,
            acceleration=r.acceleration, multiplier=r.multiplier, states=r.states, state_rates=r.state_rates,
        ),
    )  # fmt: skip


def _memo(made: "Run", few: Tables, tables: Tables, marched: Tables) -> dict[str, Any]:
    """Work arrays of a run, by the tables that they are for, and its grid."""
    if made.work is None:
        return {}
    memo: dict[str, Any] = {"grid": made.grid}
    if tables is marched:
        memo |= {"work": made.work} if few is tables else {"acting": (few, made.work)}
    return memo


def _told(found: Redundancy) -> tuple[str, ...]:
    """Say that joints are redundant: the run goes on, and shares their forces out evenly."""
    if not found.rows:
        return ()
    sentence = f"redundant joint rows share their forces in the least-squares sense: {'; '.join(found.rows)}"
    LOG.warning(sentence)
    return (sentence,)


def _agreeing(run: Trajectory) -> Trajectory:
    """A run whose redundant joints agreed along the motion. Raises NotConverged, by name, for others."""
    if not run.diagnosis.redundant_rows:
        return run
    off = np.abs(run.joint_residuals())
    if off.max() <= CONSISTENT:
        return run
    step = int(np.flatnonzero(off.max(axis=1) > CONSISTENT)[0])
    name = compiled(run.system).row_names[int(off[step].argmax())]
    raise NotConverged(
        f"redundant joints do not agree along the motion: from t = {run.times[step]:.6g} s '{name}' is "
        "off by "
        f"{off[step].max():.2g}. {'; '.join(run.diagnosis.redundant_rows)} were redundant at the start "
        "only: check "
        "their points and lengths, or remove them",
        float(run.times[step]),
    )


def _start_with_laws(parts: Compiled, tables: Tables, q0: Array, v0: Array) -> tuple[Array, Array]:
    """Consistent initial accelerations with the users' laws in the forces."""
    equations = SampledEquations(parts, tables)
    equations.look(0, q0, v0, np.zeros(len(tables.row)))
    return accelerations_from(parts, tables, equations.work)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Run:
    """Arrays of one integration, and the loop's account of it.

    q, v, w: (nodes, n).  lam: (nodes, m).  z, zdot: (nodes, states).
    info: (5,) status, step, Newton iterations, last update, factorisations.
    left: what the next step would look at, a of the alpha family first.
    grid: (2, nodes) lengths of the steps, and the factor of the auxiliary acceleration before each.
    """

    q: Array
    v: Array
    w: Array
    lam: Array
    z: Array
    zdot: Array
    info: Array
    left: tuple[Array, ...]
    tangents: Tangents | None = None
    work: Work | None = None
    grid: Array | None = None


def _tangents(nodes: int, n: int, m: int, states: int, *, springs: bool) -> Tangents:
    """Room for the tangents that a run keeps: none for large runs and for those with states."""
    # the adjoint of states needs more than the tangents
    small = states == 0 and 8 * nodes * n * (2 * n + m) <= KEEP
    kept = nodes if small else 0
    return Tangents(
        stiffness=np.empty((kept, n, n)), damping=np.empty((kept, n, n)), jacobian=np.empty((kept, m, n)),
        energy=np.empty(kept if springs else 0),
    )  # fmt: skip


def integrate(
    parts: Compiled,
    tables: Tables,
    scheme: GeneralisedAlpha | VelocityVerlet,
    q0: Array,
    v0: Array,
    *,
    redundant: bool,
    left: RunState | None = None,
) -> Run:
    """Run the compiled loop from consistent initial accelerations, or from where an earlier run ended.

    tables: sampled at `earlier_times` of the run.
    """
    nodes, n, m, states = len(tables.times), len(q0), len(tables.row), len(tables.state_pair)
    springs = isinstance(tables, SpringTables)
    work = work_space(tables)
    kept = _tangents(nodes, n, m, states, springs=springs)
    q, v, w = (np.zeros((nodes, n)) for _ in range(3))
    lam, z, zdot = np.zeros((nodes, m)), np.zeros((nodes, states)), np.zeros((nodes, states))
    info, total, band = np.zeros(5), n + m, parts.saddle
    acc, matrix, pivot, carried = (
        np.zeros(n),
        np.zeros((total, total if band is None else 3 * band.width[0] + 1)),
        np.zeros(total, np.int64),
        np.zeros(7),
    )
    if left is None:
        known, grid = 1, step_changes(tables.times, joints=m > 0)
        q[0], v[0] = q0, v0
        w[0], lam[0] = initial_accelerations(parts, tables, work, q0, v0)
        zdot[0] = work.zdot
    else:
        known = left.known
        grid = step_changes(tables.times[known - 1 :], joints=m > 0, before=left.step)
        grid = np.concatenate([np.tile(grid[:, :1], known - 1), grid], axis=1)
        for series, name in zip((q, v, w, lam, z, zdot), STATE_ARRAYS, strict=True):
            series[:known] = left.earlier[name]
        acc[:] = left.auxiliary
        matrix[:], pivot[:], carried[:] = left.solver
    # 1: factors are kept from step to step until Newton slows down; forces alone are cheaper than tangents
    settings = np.array([
        scheme.tolerance, scheme.iterations, proximal(tables, redundant=redundant), 1.0,
        0.0 if springs else 1.0,
    ])  # fmt: skip
    alpha_forward(
        tables, work, band, listed(total if band is None else 0), scheme.numbers, grid, q, v, w, lam, z, zdot,
        acc, matrix, np.zeros((2, total)), pivot, settings, info, kept.stiffness, kept.damping,
        kept.jacobian, kept.energy, known, carried,
    )  # fmt: skip
    new = [x[known - 1 :] for x in (q, v, w, lam, z, zdot)]
    return Run(
        q=new[0], v=new[1], w=new[2], lam=new[3], z=new[4], zdot=new[5], info=info, work=work,
        left=(acc, matrix, pivot, carried), grid=np.ascontiguousarray(grid[:, known - 1 :]),
        tangents=Tangents(
            stiffness=kept.stiffness[known - 1 :], damping=kept.damping[known - 1 :],
            jacobian=kept.jacobian[known - 1 :], energy=kept.energy[known - 1 :],
        ),
    )  # fmt: skip


def _failure(
    parts: Compiled, alpha: Array, times: Array, scheme: GeneralisedAlpha | VelocityVerlet, info: Array
) -> NotConverged:
    """The message of a failed run, with a step that does work when one of a few halvings finds it."""
    step = int(info[1])
    h = float(step_lengths(times)[step])
    cause = (
        "the step's matrix is singular"
        if int(info[0]) == SINGULAR
        else f"{scheme.iterations} Newton steps left an acceleration update of {info[3]:.2g} "
        f"(tolerance {scheme.tolerance:.0e} relative)"
    )
    if isinstance(scheme, GeneralisedAlpha) and scheme.rho > UNDAMPED and parts.row_names:
        return NotConverged(
            f"GeneralisedAlpha stopped at t = {times[step]:.6g} s (step {h:.3g} s): {cause}. With joints "
            f"rho={scheme.rho:g} leaves the joint forces alternating undamped from step to step; take "
            f"rho <= {UNDAMPED}, which keeps the energy as well",
            float(times[step]),
        )
    if not is_even(times) or times[0] != 0.0:
        return NotConverged(
            f"{type(scheme).__name__} stopped at t = {times[step]:.6g} s (step {h:.3g} s): {cause}. Take "
            "shorter steps there, or look at the forces near that time",
            float(times[step]),
        )
    advice = f"No step down to {h / 64:.3g} s works: look at the forces near that time"
    for halvings in (1, 2, 3, 4, 5, 6):
        count = min(step + 5, len(times) - 1) * 2**halvings
        finer = np.linspace(0.0, times[min(step + 5, len(times) - 1)], count + 1)
        tables = on_grid(parts, alpha, finer)
        q0, v0, phi_q = check_start(parts, tables)
        lost = redundancy(parts.row_names, phi_q).rows
        trial = integrate(parts, tables, scheme, q0, v0, redundant=len(lost) > 0)
        if trial.info[0] == 0:
            advice = (
                f"A step of {h / 2**halvings:.3g} s passes this point: "
                f"use steps={(len(times) - 1) * 2**halvings}"
            )
            break
    return NotConverged(
        f"{type(scheme).__name__} stopped at t = {times[step]:.6g} s (step {h:.3g} s): {cause}. {advice}",
        float(times[step]),
    )
