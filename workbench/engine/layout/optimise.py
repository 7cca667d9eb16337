"""optimise_layout: choose how to solve, solve, compare with trivial layouts, and say why it stopped.

The default `gsao` picks by what the objective can tell:

| the objective | what is done |
|---|---|
| convex rows with second derivatives, budgets only | Newton steps along the central path |
| convex rows with gradients only, budgets only | the same path, curvature learnt from the gradients |
| a history in time, several rows, or second-order factors; budgets only | min-max trust region, corners |
| one smooth row | two-point separable approximations, globalised by a filter |
| further constraints, fewer than members | the same, then linear steps from where it leaves off |
| further constraints, as many as members or more | linear programmes in logarithms of the densities |
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .bound.binding import is_by_scenario
from .bound.binding_starts import by_binding_scenarios
from .bound.equivalent_loads import VARIANTS, equivalent_static_loads
from .bound.linear_steps import linear_steps
from .bound.min_max import min_max
from .bound.probing import probes_by_default
from .formulation.aggregate import aggregated
from .formulation.even_spread import even_spread
from .formulation.law_variables import values_at
from .formulation.problem import FAILURES, Evaluation, InvalidLayout, LayoutProblem
from .formulation.remembered import remembering
from .formulation.transient import Scenario, transient_problem
from .outcome.contradiction import contradiction
from .outcome.first_order import first_order
from .outcome.history import Recorder
from .outcome.limits import limit_outcomes
from .outcome.optimality import Certificate
from .outcome.result import FIRST_ORDER, HistoryEntry, LayoutResult, LayoutStatus, LimitOutcome
from .outcome.verdicts import verdicts
from .paths.central_path import has_interior
from .paths.secant_path import follow_paths, follow_secant_path
from .separable.presets import (
    ConvexLinearisation,
    DiagonalQuadratic,
    LinearProgramme,
    MovingAsymptotes,
    OptimalityCriteria,
    Preset,
    TwoPoint,
)  # fmt: skip
from .separable.sequence import approximation_sequence

__all__ = ["METHODS", "RUNS_ONLY", "as_layout_problem", "optimise_layout"]

Array = NDArray[np.float64]
Peaks = Literal["all", "single", "ks", "p_norm"]
Scenarios = Literal["all", "binding"]

_PRESETS: dict[str, tuple[Preset, bool]] = {  # preset, globalised
    "gsao_two_point": (TwoPoint(), True),
    "oc": (OptimalityCriteria(), False),
    "conlin": (ConvexLinearisation(), False),
    "mma": (MovingAsymptotes(), False),
    "gcmma": (MovingAsymptotes(), True),
    "slp": (LinearProgramme(), True),
    "dsqp": (DiagonalQuadratic(), True),
}
METHODS = ("gsao", *_PRESETS, "central_path", "secant_path", "trust_region", "linear_steps")
RUNS_ONLY = tuple(VARIANTS)  # methods that a problem without runs of moving systems does not have

_SETTLED = 1e-5  # first-order error below which a run at its limit of evaluations has converged
_MANY = 10  # further constraints from which as many as members are active, as like as not
_BLIND = 1e-13  # of the value: what all densities together may change in a row that does not see them
_SAME = 1e-9  # of the bounds' width: designs that are no further apart differ by rounding


def as_layout_problem(record: Any) -> LayoutProblem:
    """A study's record (system, objective, t_end, steps, density, budget) as a layout problem."""
    if isinstance(record, LayoutProblem):
        return record
    missing = [
        name for name in ("system", "objective", "t_end", "steps", "density") if not hasattr(record, name)
    ]
    if missing:
        raise InvalidLayout(
            f"problem needs to be a LayoutProblem or a study's record; {type(record).__name__} has no "
            + ", ".join(missing)
        )
    density = np.asarray(record.density, dtype=float)
    return transient_problem(
        [Scenario(
            system=record.system, objective=record.objective, t_end=record.t_end, steps=record.steps,
            scheme=getattr(record, "scheme", None),
        )],
        start=density, budgets=[(np.ones(len(density)), getattr(record, "budget", float(density.sum())))],
        lower=getattr(record, "lower", 1e-4), upper=getattr(record, "upper", 1.0),
    )  # fmt: skip


def optimise_layout(
    problem: Any,
    method: str | Preset = "gsao",
    *,
    max_evaluations: int = 50,
    tolerance: float = 1e-6,
    peaks: Peaks = "all",
    multi_start: bool = True,
    compare: bool = True,
    probes: int | None = None,
    scenarios: Scenarios = "all",
    progress: Callable[[HistoryEntry, Array], None] | None = None,
    keep_iterates: bool = False,
) -> LayoutResult:
    """Find a layout that makes the largest row small within its budgets, (7.4).

    Args:
        problem: a `LayoutProblem`, or a study's record with system, objective, density, budget and times.
        method: one of `METHODS` or `RUNS_ONLY`, or a preset with its own move limits
            (`MovingAsymptotes(move=0.3)`).
        max_evaluations: of values with gradients, trivial layouts included.
        tolerance: relative improvement that is worth another step.
        peaks: "all" rows, the "single" largest, or a smooth aggregate; presets see the single largest peak
            of a history unless aggregated, and every row of a static problem with several.
        multi_start: also search from corners of the response where several peaks compete, and from
            layouts of single scenarios where those that bind are searched with.
        compare: spend evaluations on the trivial layouts, so that the result is no worse than they are.
        probes: runs without gradients, beside the evaluations, that may look for starts and correct steps
            of the trust region where several peaks compete on a long window; None: 20 per evaluation from 200
            evaluations on, with several starts, where slopes are carried forward beside a run.
        scenarios: "all" are run at every step, or those that are "binding", where the objective is the
            histories of eleven scenarios at least and there are no further constraints.
        progress: called with each history entry and density.

    Returns a `LayoutResult`; its design meets every budget. Raises InvalidLayout for unusable problems.

    >>> import numpy as np
    >>> from workbench.engine.layout.formulation.problem import static_problem
    >>> w = np.array([1.0, 4.0, 9.0])
    >>> problem = static_problem(lambda a: (float((w / a).sum()), -w / a**2), start=np.full(3, 0.3),
    ...                          lower=0.01, budgets=[(np.ones(3), 1.0)])
    >>> optimise_layout(problem).density.round(4)
    array([0.1667, 0.3333, 0.5   ])
    """
    problem = as_layout_problem(problem)
    if max_evaluations < 1:
        raise InvalidLayout(f"max_evaluations needs to be >= 1, got {max_evaluations}")
    if isinstance(method, str) and method not in (*METHODS, *RUNS_ONLY):
        raise InvalidLayout(f"method needs to be one of {', '.join((*METHODS, *RUNS_ONLY))}, got '{method}'")
    if peaks not in ("all", "single", "ks", "p_norm"):
        raise InvalidLayout(f"peaks needs to be 'all', 'single', 'ks' or 'p_norm', got '{peaks}'")
    if scenarios not in ("all", "binding"):
        raise InvalidLayout(f"scenarios needs to be 'all' or 'binding', got '{scenarios}'")
    able = method in ("gsao", "trust_region")
    if probes is not None and (probes < 0 or (probes and not able)):
        raise InvalidLayout(f"probes needs to be >= 0, and 0 unless 'gsao' chooses, got {probes}, {method!r}")
    if peaks in ("ks", "p_norm"):
        problem = aggregated(problem, peaks)  # type: ignore[arg-type]
    problem = replace(problem, evaluate=remembering(problem.evaluate))
    recorder = Recorder(problem, progress=progress, keep=keep_iterates)
    start = problem.into_budgets(problem.start)
    first = problem.checked(start)
    if _blind(problem, first):
        recorder.add(start, first)
        start, first = _elsewhere(problem, recorder, start, first, max_evaluations)
        if _blind(problem, first):
            return _result(problem, recorder, LayoutStatus.ZERO_SENSITIVITY, "none: nothing to follow", {})
        problem = replace(problem, start=start)
    if probes is None:
        probes = probes_by_default(first, max_evaluations) if able and multi_start else 0
    alone = not compare or problem.convex or first.constraints.size > 0
    trivial = {} if alone else _trivial(problem, start, max_evaluations)
    allowed = max(1, max_evaluations - len(trivial))
    converged, strategy = _solve(
        problem, recorder, method, first, allowed, tolerance, peaks, multi_start, probes, scenarios
    )
    if recorder.best_density is None and recorder.evaluations < max_evaluations:
        _another_look(problem, recorder)
    baselines = _compare(problem, recorder, trivial)
    status = LayoutStatus.CONVERGED if converged else LayoutStatus.STALLED
    if recorder.evaluations >= max_evaluations and not converged:
        status = LayoutStatus.LIMIT
    elif any(recorder.best == value for value in baselines.values()):
        status = LayoutStatus.TRIVIAL
    return _result(problem, recorder, status, strategy, baselines)


def _solve(
    problem: LayoutProblem, recorder: Recorder, method: str | Preset, first: Evaluation, allowed: int,
    tolerance: float, peaks: str, multi_start: bool, probes: int, scenarios: str,
) -> tuple[bool, str]:  # fmt: skip
    values = np.atleast_2d(first.values)
    budgets_only = first.constraints.size == 0
    curved = first.factors(np.array([0], dtype=np.intp)) is not None
    if method == "gsao":
        if problem.convex and curved and budgets_only and values.shape[1] == 1 and has_interior(problem):
            method, why = "central_path", "convex rows with second derivatives"
        elif problem.convex and budgets_only and values.shape[1] == 1 and has_interior(problem):
            method, why = "secant_path", "convex rows with gradients only"
        elif first.limit_rows:
            method, why = (
                "trust_region",
                f"{len({row.name for row in first.limit_rows})} limits along the runs",
            )
        elif budgets_only and (values.size > 1 or curved) and peaks != "single":
            method, why = "trust_region", f"{values.size} rows compete"
        elif first.constraints.size >= max(problem.members, _MANY):
            method, why = "linear_steps", f"{first.constraints.size} further constraints"
        elif budgets_only:
            method, why = "gsao_two_point", "one smooth row"
        else:
            return _few_limits(problem, recorder, allowed, tolerance, peaks == "all" and values.shape[1] == 1)
    else:
        why = "as asked"
    if isinstance(method, str) and method in VARIANTS:
        done = equivalent_static_loads(
            problem, recorder, difference=VARIANTS[method], max_evaluations=allowed, tolerance=tolerance
        )
        return done, f"equivalent static loads{' of differences' if VARIANTS[method] else ''}: as asked"
    limited = method == "trust_region" and first.limit_rows
    if method in ("central_path", "secant_path", "trust_region") and not budgets_only and not limited:
        raise InvalidLayout(
            f"method '{method}' takes budgets only; use 'gsao' or a preset for further constraints"
        )
    if method == "central_path":
        if not curved or values.shape[1] > 1 or not has_interior(problem):
            raise InvalidLayout(
                "method 'central_path' needs static rows with second derivatives and room above the bounds"
            )
        done, said = follow_paths(problem, recorder, max_evaluations=allowed, tolerance=tolerance)
        return done, f"{said}: {why}"
    if method == "secant_path":
        if values.shape[1] > 1 or not problem.convex or not has_interior(problem):
            raise InvalidLayout(
                "method 'secant_path' needs convex static rows (convex=True) and room above the bounds"
            )
        done = follow_secant_path(problem, recorder, max_evaluations=allowed, tolerance=tolerance)
        return done, f"barrier steps with curvature from gradients: {why}"
    few = scenarios == "binding" and budgets_only and is_by_scenario(problem, first)
    if method == "trust_region" and few:
        done, starts = by_binding_scenarios(problem, recorder, allowed, tolerance, several=multi_start)
        return done, f"min-max trust region over peaks of the scenarios that bind{starts}: {why}"
    if method == "trust_region":
        run = min_max(
            problem, recorder, max_evaluations=allowed, tolerance=tolerance, multi_start=multi_start,
            probes=probes if budgets_only and problem.budgets else 0,
        )  # fmt: skip
        return run.finished, f"min-max trust region over peaks and scenarios: {why}"
    if method == "linear_steps":
        done = linear_steps(problem, recorder, max_evaluations=allowed, tolerance=tolerance)
        return done, f"linear programmes in logarithms of the densities: {why}"
    preset, globalised = _PRESETS[method] if isinstance(method, str) else (method, True)
    sequence = approximation_sequence(
        problem, recorder, preset, max_evaluations=allowed, tolerance=tolerance, globalised=globalised,
        all_rows=peaks == "all" and values.shape[1] == 1,
    )  # fmt: skip
    name = type(preset).__name__
    return sequence.converged, f"separable approximations {name}: {why}"


def _few_limits(
    problem: LayoutProblem, recorder: Recorder, allowed: int, tolerance: float, all_rows: bool
) -> tuple[bool, str]:
    """Separable approximations, and linear steps from where they leave off."""
    sequence = approximation_sequence(
        problem, recorder, TwoPoint(), max_evaluations=max(1, allowed // 2), tolerance=tolerance,
        globalised=True, all_rows=all_rows,
    )  # fmt: skip
    said = "separable approximations TwoPoint: a few further constraints"
    known = recorder.best_density is not None
    if sequence.converged and known and _first_order(problem, recorder).kkt <= _SETTLED:
        return True, said
    if recorder.evaluations >= allowed:
        return False, said
    left_off = recorder.nearest_density if recorder.best_density is None else recorder.best_density
    done = linear_steps(
        replace(problem, start=left_off), recorder, max_evaluations=allowed, tolerance=tolerance
    )
    return done, f"{said}, then linear programmes in logarithms of the densities"


def _blind(problem: LayoutProblem, evaluation: Evaluation) -> bool:
    values = np.atleast_2d(evaluation.values)
    rows = np.array([int(values.argmax())])
    free = problem.free
    reach = np.abs(problem.checked_gradients(evaluation, rows)[0]) * (problem.upper - problem.lower)
    return bool(reach[free].sum() <= _BLIND * abs(float(values.max())))


def _another_look(problem: LayoutProblem, recorder: Recorder) -> None:
    """One more design while none is feasible: it may be, and it tells whether constraints are linear."""
    density = problem.into_budgets(problem.lower + 0.4 * (problem.upper - problem.lower))
    evaluation = problem.tried(density)
    if evaluation is not None:
        recorder.add(density, evaluation)


def _elsewhere(
    problem: LayoutProblem, recorder: Recorder, start: Array, first: Evaluation, max_evaluations: int
) -> tuple[Array, Evaluation]:
    """Another design, to tell a start that is stationary from an objective that sees nothing."""
    other = problem.into_budgets(problem.lower + 0.4 * (problem.upper - problem.lower))
    if np.array_equal(other, start):
        other = 0.5 * (problem.lower + start)
    evaluation = problem.tried(other) if max_evaluations > 1 else None
    if evaluation is None:
        return start, first
    better = recorder.add(other, evaluation)
    if _blind(problem, evaluation) and np.array_equal(evaluation.values, first.values):
        return start, first
    if better or first.constraints.size:
        return other, evaluation
    # the start is the better one and stationary: a little beside it there is something to follow
    return problem.into_budgets(start + 1e-3 * (other - start)), evaluation


def _trivial(problem: LayoutProblem, start: Array, max_evaluations: int) -> dict[str, Array]:
    """Feasible layouts that need no thought: every budget spread evenly, none, all."""
    width = problem.upper - problem.lower
    found = {"uniform": even_spread(problem), "none": problem.lower.copy()}
    if np.abs(found["uniform"] - problem.upper).max() <= _SAME * width.max():
        found["all"] = problem.upper.copy()
        del found["uniform"]
    found = {name: a for name, a in found.items() if np.abs(a - start).max() > _SAME * width.max()}
    return found if max_evaluations >= len(found) + 3 else {}


def _compare(problem: LayoutProblem, recorder: Recorder, trivial: dict[str, Array]) -> dict[str, float]:
    values = {}
    for name, density in trivial.items():
        recorder.start_index = -1
        try:
            evaluation = problem.checked(density)
        except FAILURES:
            continue  # a system without members may not even hold together
        values[name] = float(np.max(evaluation.values))
        recorder.add(density, evaluation)
    return values


def _result(
    problem: LayoutProblem,
    recorder: Recorder,
    status: LayoutStatus,
    strategy: str,
    baselines: dict[str, float],
) -> LayoutResult:
    density, proof = recorder.best_density, None
    kkt, prices, value = np.nan, np.zeros(problem.budgets), recorder.best
    limits: tuple[LimitOutcome, ...] = ()
    if density is None:
        density = recorder.nearest_density
        proof = contradiction(problem, recorder.cuts)
        status = LayoutStatus.NONE_FOUND if proof is None else LayoutStatus.INFEASIBLE
    elif status is not LayoutStatus.ZERO_SENSITIVITY:
        found = _first_order(problem, recorder)
        kkt, prices = found.kkt, found.shadow_prices
        limits = limit_outcomes(recorder.best_evaluation, found.constraint_prices)
        status = _confirmed(problem, density, value, status, found)
    evaluation = recorder.best_evaluation
    return LayoutResult(
        density=density,
        value=value,
        start_value=recorder.start_value,
        history=tuple(recorder.history),
        status=status,
        shadow_prices=prices,
        kkt=float(kkt),
        evaluations=recorder.evaluations,
        probes=recorder.probes,
        excess=recorder.nearest if evaluation is None else recorder.infeasibility(density, evaluation),
        strategy=strategy,
        verdicts=verdicts(problem, recorder, status, float(kkt), prices, baselines, proof, limits),
        optima=tuple(sorted(recorder.optima)),
        ends=tuple(recorder.ends),
        baselines=baselines,
        iterates=tuple(recorder.iterates),
        contradiction=proof,
        limits=limits,
        variables=values_at(problem, density),
    )


def _first_order(problem: LayoutProblem, recorder: Recorder) -> Certificate:
    assert recorder.best_evaluation is not None
    assert recorder.best_density is not None
    return first_order(problem, recorder.best_density, recorder.best_evaluation, enough=_SETTLED)


def _confirmed(
    problem: LayoutProblem, density: Array, value: float, status: LayoutStatus, found: Certificate
) -> LayoutStatus:
    """What the first-order error at the returned design lets one say, whatever the method believed."""
    unit = abs(value) / np.maximum(np.abs(problem.limits), 1e-300) if np.isfinite(value) else 0.0
    unpriced = (found.shadow_prices <= 1e-6 * unit) & (problem.usage(density) < 0.999)
    if problem.budgets and unpriced.all() and found.kkt <= FIRST_ORDER:  # far from an optimum none is priced
        return LayoutStatus.IDLE_BUDGET
    if found.kkt <= (_SETTLED if status is LayoutStatus.LIMIT else FIRST_ORDER):
        return LayoutStatus.CONVERGED
    return LayoutStatus.STALLED if status is LayoutStatus.CONVERGED else status
