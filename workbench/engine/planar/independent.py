"""Planar systems in independent coordinates: `IndependentAlpha`, and order 8 with joints."""

from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.changes import Multipliers, multipliers
from ..integration.dop853_tableau import A, B, C
from ..integration.independent import (
    IndependentEquations,
    March,
    Pulled,
    independent_state,
    march,
    march_rk8,
    notices,
    point_times,
    pulled_alpha,
    pulled_rk8,
)
from ..integration.outcome import Diagnosis
from ..integration.redundancy import redundancy
from ..integration.run_state import Course, RunState, earlier_times
from ..integration.schemes import IndependentAlpha, RungeKutta8
from ..integration.seeds import Seeds, row_by_row
from ._kernels import chart_answers  # noqa: F401  (answers the chart's questions by type)
from ._kernels.tables import Tables, work_space
from .compiled import Compiled, compiled, on_grid
from .equations import chart_of, rates_of
from .parameters import adjoints_of
from .start import check_start
from .trajectory import Trajectory

__all__ = ["independent_alpha", "jointed_rk8"]

Array = np.ndarray[Any, Any]


def _refuse(parts: Compiled, scheme: str) -> None:
    if not parts.fused:
        raise NotSupported(
            f"{scheme} with joints runs the engine's own laws only; use GeneralisedAlpha(rho=0.99) or less"
        )
    if parts.system.has_states:
        raise NotSupported(
            f"{scheme} with joints does not carry the states of force elements, as the damage of bushings; "
            "use GeneralisedAlpha(rho=0.99) or less"
        )


def independent_equations(
    parts: Compiled, tables: Tables, start: RunState | None = None
) -> IndependentEquations:
    """Work space and arrays for runs on the grid of `tables`, with the Jacobian at the system's start."""
    _, _, phi_q = _checked(parts, np.zeros(len(parts.order)), tables, start)
    return IndependentEquations(
        tables=tables,
        work=work_space(tables),
        rates=rates_of(parts, tables.times),
        chart=chart_of(tables, phi_q),
        row_names=parts.row_names,
    )


def independent_alpha(
    parts: Compiled, alpha: Array, times: Array, scheme: IndependentAlpha, course: Course, *, reason: str
) -> Trajectory:
    """Run a system with joints. Raises AssemblyError, NotConverged or NotSupported."""
    _refuse(parts, "IndependentAlpha")
    tables = on_grid(parts, alpha, times)
    q0, v0, _ = _checked(parts, alpha, tables, course.start)
    marched = tables if course.start is None else on_grid(parts, alpha, earlier_times(course.start, times))
    equations = independent_equations(parts, marched, course.start)
    run = march(equations, scheme, times, q0, v0, course.start)
    return _record(parts, alpha, times, scheme, tables, run, reason, course)


def _checked(
    parts: Compiled, alpha: Array, tables: Tables, start: RunState | None
) -> tuple[Array, Array, Array]:
    """q, v and Phi_q at the system's own start, which is that at 0 s."""
    return check_start(parts, tables if start is None else on_grid(parts, alpha, np.zeros(1)))


def jointed_rk8(parts: Compiled, alpha: Array, times: Array, course: Course) -> Trajectory:
    """Run a system with joints by order 8. Raises AssemblyError, NotConverged or NotSupported."""
    _refuse(parts, "RungeKutta8")
    run, _ = _rk8(parts, alpha, times, course.start)
    tables = on_grid(parts, alpha, times)
    return _record(parts, alpha, times, RungeKutta8(), tables, run, "RungeKutta8 as asked", course)


def _rk8(
    parts: Compiled, alpha: Array, times: Array, start: RunState | None
) -> tuple[March, tuple[IndependentEquations, Any]]:
    tables = on_grid(parts, alpha, point_times(times, C))
    q0, v0, _ = _checked(parts, alpha, tables, start)
    equations = independent_equations(parts, tables, start)
    run, sq, sv = march_rk8(equations, (A, B), times, q0, v0, start)
    return run, (equations, (sq, sv))


def _record(
    parts: Compiled, alpha: Array, times: Array, scheme: IndependentAlpha | RungeKutta8, tables: Tables,
    run: March, reason: str, course: Course,
) -> Trajectory:  # fmt: skip
    states = np.zeros((len(times), len(tables.state_pair)))
    _, _, phi_q = _checked(parts, alpha, tables, course.start)
    lost = redundancy(parts.row_names, phi_q).rows
    return Trajectory(
        system=parts.system, density=alpha, scheme=scheme, times=times, position=run.position,
        velocity=run.velocity, acceleration=run.acceleration, multiplier=run.multiplier, states=states,
        state_rates=states.copy(), tables=tables, splits=run.splits, adjoints=INDEPENDENT, course=course,
        last=lambda r: independent_state(run, r.times, scheme, course.start),
        diagnosis=Diagnosis(
            newton_iterations=run.evaluations, factorisations=run.evaluations,
            redundant_rows=lost, reason=reason, notices=notices(type(scheme).__name__, run, lost, times),
        ),
    )  # fmt: skip


def _pulled(trajectory: Trajectory, seeds: Seeds, *, joints: bool) -> tuple[Pulled, Array, Array, Array]:
    """The backward sweep, exact for the run's own result, and times, places and velocities of its points.

    Order 8 runs its stages again. joints: adjoints of the joints too.
    """
    r, parts = trajectory, compiled(trajectory.system)
    if isinstance(r.scheme, IndependentAlpha):
        assert r.splits is not None
        equations = independent_equations(parts, r.tables, r.start)
        found = pulled_alpha(
            equations, r.scheme, r.step, r.nodes, r.splits, seeds, joints=joints, given=r.start is not None
        )
        return found, r.nodes.times, r.nodes.position, r.nodes.velocity
    times = r.nodes.times
    run, (equations, points) = _rk8(parts, r.density, times, r.start)
    found = pulled_rk8(equations, (A, B), times, run, points, seeds, joints=joints)
    return found, np.append(times[0], point_times(times, C)), *points


def _told(trajectory: Trajectory, seeds: Seeds) -> tuple[Array, Multipliers]:
    found, *points = _pulled(trajectory, seeds, joints=True)
    return found.gradient, multipliers(found, *points)


INDEPENDENT = adjoints_of(
    lambda r, seeds: row_by_row(r, seeds, lambda r, s: _pulled(r, s, joints=False)[0].gradient),
    lambda r, seeds: _told(r, seeds.dense(0)),
)
