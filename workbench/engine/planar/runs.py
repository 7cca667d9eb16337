"""Runs of planar systems: which loop takes which scheme, and the trajectory it leaves."""

import logging
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotConverged, NotSupported
from ..integration.grids import is_even, step_changes, step_lengths
from ..integration.independent import CONSISTENT
from ..integration.loops import alpha_loop, bdf2_loop
from ..integration.outcome import Diagnosis
from ..integration.redundancy import Redundancy, redundancy
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
UNDAMPED = 0.99  # above it the alternation of the joint forces may grow: eigenvalue -1, twice, at rho = 1


def run(system: System, alpha: Array, times: Array, scheme: Scheme) -> Trajectory:
    """Run a planar system over the nodes `times`; alpha: (N,) densities.

    Raises AssemblyError when the start violates the joints, NotConverged when a step cannot be solved,
    NotSupported when the scheme cannot treat the system.
    """
    parts = compiled(system)
    if isinstance(scheme, RungeKutta8):
        if not parts.fused:
            raise NotSupported(
                "RungeKutta8 runs the engine's own laws only; use GeneralisedAlpha for a UserLaw"
            )
        return runge_kutta(parts, alpha, times)
    jointed = len(parts.row_names) > 0
    if isinstance(scheme, IndependentAlpha):
        if jointed:
            return independent_alpha(parts, alpha, times, scheme, reason="IndependentAlpha as asked")
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
            return independent_alpha(parts, alpha, times, instead, reason=reason)
    return _implicit(parts, alpha, times, scheme)


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
    return _implicit(parts, alpha, times, scheme, start)


def _implicit(
    parts: Compiled, alpha: Array, times: Array, scheme: GeneralisedAlpha | VelocityVerlet | BDF2,
    start_at: tuple[Array, Array] | None = None,
) -> Trajectory:  # fmt: skip
    tables = on_grid(parts, alpha, times)
    if isinstance(scheme, VelocityVerlet) and len(tables.row):
        raise NotSupported("velocity Verlet is explicit and cannot hold joints; use GeneralisedAlpha")
    first = tables if start_at is None else on_grid(parts, alpha, np.zeros(1))
    q0, v0, phi_q = check_start(parts, first)
    if start_at is not None:
        q0, v0 = start_at
    found = redundancy(parts.row_names, phi_q)
    redundant = len(found.rows) > 0
    if isinstance(scheme, BDF2) or not parts.fused:
        if parts.system.has_states:
            raise NotSupported(
                "states of force elements, as the damage of breakable bushings, need GeneralisedAlpha and "
                "the engine's own laws"
            )
        start = (q0, v0, *_start_with_laws(parts, tables, q0, v0))
        equations, few = SampledEquations(parts, tables), tables
        shift = proximal(tables, redundant=redundant)
        if isinstance(scheme, BDF2):
            nodes = bdf2_loop(equations, scheme, times, start, shift)
        else:
            nodes = alpha_loop(equations, scheme, times, start, shift)
        empty = np.zeros((len(times), len(tables.state_pair)))
        made = Run(
            q=nodes.position, v=nodes.velocity, w=nodes.acceleration, lam=nodes.multiplier, z=empty,
            zdot=empty.copy(), info=np.array([0, len(times) - 1, nodes.newton, 0, nodes.newton]),
        )  # fmt: skip
    else:
        few = acting_tables(tables)
        made = integrate(parts, few, scheme, q0, v0, redundant=redundant)
        if made.info[0] != 0 or not np.isfinite(made.q[-1]).all():
            raise _failure(parts, alpha, times, scheme, made.info)
    return _agreeing(Trajectory(
        system=parts.system, density=alpha, scheme=scheme, times=times, position=made.q, velocity=made.v,
        acceleration=made.w, multiplier=made.lam, states=made.z, state_rates=made.zdot, tables=tables,
        adjoints=COMPILED if parts.fused and not isinstance(scheme, BDF2) else LOOP,
        tangents=made.tangents, memo=_memo(made.work, few, tables),
        diagnosis=Diagnosis(
            newton_iterations=int(made.info[2]), factorisations=int(made.info[4]),
            redundant_rows=found.rows, reason=f"{type(scheme).__name__} as asked",
            notices=_told(found),
        ),
    ))  # fmt: skip


def _memo(work: Work | None, few: Tables, tables: Tables) -> dict[str, Any]:
    """Work arrays of a run, by the tables that they are for."""
    if work is None:
        return {}
    return {"work": work} if few is tables else {"acting": (few, work)}


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
    """

    q: Array
    v: Array
    w: Array
    lam: Array
    z: Array
    zdot: Array
    info: Array
    tangents: Tangents | None = None
    work: Work | None = None


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
) -> Run:
    """Run the compiled loop from consistent initial accelerations."""
    nodes, n, m, states = len(tables.times), len(q0), len(tables.row), len(tables.state_pair)
    springs = isinstance(tables, SpringTables)
    work = work_space(tables)
    kept = _tangents(nodes, n, m, states, springs=springs)
    q, v, w = (np.zeros((nodes, n)) for _ in range(3))
    z, zdot = np.zeros((nodes, states)), np.zeros((nodes, states))
    run = Run(
        q=q, v=v, w=w, lam=np.zeros((nodes, m)), z=z, zdot=zdot, info=np.zeros(5), tangents=kept, work=work
    )
    q[0], v[0] = q0, v0
    w[0], run.lam[0] = initial_accelerations(parts, tables, work, q0, v0)
    zdot[0] = work.zdot
    total = n + m
    # 1: factors are kept from step to step until Newton slows down; forces alone are cheaper than tangents
    settings = np.array([
        scheme.tolerance, scheme.iterations, proximal(tables, redundant=redundant), 1.0,
        0.0 if springs else 1.0,
    ])  # fmt: skip
    alpha_forward(
        tables, work, scheme.numbers, step_changes(tables.times, joints=m > 0), q, v, w, run.lam, z, zdot,
        np.zeros(n), np.zeros((total, total)), np.zeros(total), np.zeros(total, np.int64),
        settings, run.info, kept.stiffness, kept.damping, kept.jacobian, kept.energy,
    )  # fmt: skip
    return run


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
