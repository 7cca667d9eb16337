"""Sequences of separable approximations: evaluate, build the model of a preset, solve its dual, repeat.

Globalised (the default) a step is accepted by a filter: it must improve the objective or the violation
against the pairs before it, of which one may dominate it on the first trial (Fletcher and Leyffer 2002; non-
monotone after Gould and Toint). A refused step adds curvature to the rows that the model underestimated, as
conservative approximations do (Svanberg 2002), or draws the move box in when the iterate is infeasible, and
is solved again. When the objective is the largest of several rows a further variable t bounds them. Budgets
are linear and met by every iterate; the recorder keeps the best feasible one. Without globalisation the
presets run as published, and every design that the model can stand is a step: to refuse those that raise the
rows a thousandfold takes from asymptotes the turns that they learn from.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import local_peaks
from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import Recorder
from ..outcome.optimality import linear_promise
from .dual import solve_subproblem
from .model import SeparableModel
from .presets import Point, Preset

__all__ = ["Sequence", "approximation_sequence"]

Array = NDArray[np.float64]

_STIFFEN, _RELAX, _SHRINK = 4.0, 0.1, 0.4
_MEMORY = 6  # pairs that the filter looks back on
_REFUSALS = 30
_MET = 1e-9  # constraint, in units of its reach, that a point meets but for rounding
_STILL = 1e-7  # of the width; a smaller step is rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Sequence:
    """How a sequence ended: density, converged, elastic (the last subproblem could not meet its
    constraints)."""

    density: Array
    converged: bool
    elastic: bool


def approximation_sequence(
    problem: LayoutProblem,
    recorder: Recorder,
    preset: Preset,
    *,
    max_evaluations: int,
    tolerance: float,
    globalised: bool,
    all_rows: bool,
) -> Sequence:
    """Run a preset from the start of the problem.

    all_rows: the bound formulation over all static rows; otherwise the largest row alone is the objective.
    """
    start = problem.into_budgets(problem.start)
    evaluation = problem.checked(start)
    bound = all_rows and np.size(evaluation.values) > 1
    here = _point(problem, start, evaluation, bound)
    recorder.add(start, evaluation)
    points, filter_ = [here], [_pair(here, bound)]
    stiff = np.zeros(len(here.values))
    refusals, share, elastic = 0, 1.0, False
    while recorder.evaluations < max_evaluations:
        lower, upper = _bounds(problem, here, bound)
        model = _drawn_in(preset.model(points, lower, upper), share)
        if bound:
            model = _free_bound(model)
        scale = np.abs(here.gradients).max(axis=1, keepdims=True) / np.maximum(upper - lower, 1e-300)
        if bound:
            scale[:, -1] = 0.0
        solution = solve_subproblem(model.stiffened(stiff[:, None] * scale) if stiff.any() else model)
        elastic = solution.elastic
        density = problem.into_budgets(solution.x[: problem.members])
        promise = _promise(problem, here, solution.multipliers, bound)
        unit = max(abs(float(np.max(evaluation.values))), 1e-300)
        if promise <= tolerance * unit and _violation(here, bound) <= 1e-9:
            return Sequence(density=here.x[: problem.members], converged=True, elastic=False)
        moved = np.abs(density - here.x[: problem.members]) / np.maximum(
            problem.upper - problem.lower, 1e-300
        )
        if moved.max() <= _STILL and (globalised or moved.max() == 0):
            break
        radius = float(np.max((model.upper - model.lower) / np.maximum(upper - lower, 1e-300)))
        trial_evaluation = problem.tried(density)
        if (
            trial_evaluation is None
        ):  # a design that the model cannot stand: a shorter step, whatever the preset
            recorder.fail(density, radius=radius)
            refusals, share = refusals + 1, _SHRINK * share
            if refusals > _REFUSALS:
                break
            continue
        trial = _point(problem, density, trial_evaluation, bound)
        pair = _pair(trial, bound)
        accept = not globalised or _acceptable(pair, filter_, patient=refusals == 0)
        recorder.add(density, trial_evaluation, kkt=promise / unit, radius=radius, accepted=accept)
        if accept:
            points, here, evaluation = [*points, trial], trial, trial_evaluation
            filter_.append(pair)
            stiff = np.where(stiff > 1e-3, stiff * _RELAX, 0.0)
            refusals, share = 0, min(1.0, 2 * share)
            continue
        refusals += 1
        if refusals > _REFUSALS:
            break
        if _violation(here, bound) > 1e-9:  # curvature would empty the feasible set: draw the box in instead
            share *= _SHRINK
            continue
        predicted = model.at(trial.x)[0]
        under = trial.values > predicted + 1e-12 * np.abs(trial.values)
        if not under.any():
            under[:] = True
        stiff = np.where(under, np.maximum(stiff * _STIFFEN, 0.5), stiff)
    return Sequence(density=here.x[: problem.members], converged=False, elastic=elastic)


def _point(problem: LayoutProblem, density: Array, evaluation: Evaluation, bound: bool) -> Point:
    """Objective (or the bound variable), rows, budgets and further constraints as one table."""
    values = np.atleast_2d(evaluation.values)
    rows = local_peaks(values) if bound and values.shape[1] > 1 else np.arange(values.size)
    if not bound:
        rows = np.array([int(values.argmax())])
    gradients = problem.checked_gradients(evaluation, rows)
    f = values.ravel()[rows]
    budget = problem.costs @ density - problem.limits
    followed = _followed(evaluation)
    others = np.r_[budget, evaluation.constraints[followed]]
    slopes = evaluation.constraint_gradients.reshape(-1, problem.members)
    table = np.vstack([problem.costs, slopes[followed]])
    if not bound:
        return Point(x=density, values=np.r_[f, others], gradients=np.vstack([gradients, table]))
    t = float(f.max())
    n = problem.members
    top = np.zeros((1, n + 1))
    top[0, -1] = 1.0
    rows_t = np.hstack([gradients, -np.ones((len(f), 1))])
    table_t = np.hstack([table, np.zeros((len(others), 1))])
    return Point(
        x=np.r_[density, t], values=np.r_[t, f - t, others], gradients=np.vstack([top, rows_t, table_t]),
        rows=len(f),
    )  # fmt: skip


def _followed(evaluation: Evaluation) -> NDArray[np.intp]:
    """The constraints that the approximations carry: of each limit in each run the peak that is worst.

    Peaks come and go from design to design, and two-point models and curvatures need the same rows at each.
    """
    worst: dict[tuple[int, int], int] = {}
    for k, row in enumerate(evaluation.limit_rows):
        of = (row.limit, row.scenario)
        if of not in worst or evaluation.constraints[k] > evaluation.constraints[worst[of]]:
            worst[of] = k
    if not evaluation.limit_rows:
        return np.arange(len(evaluation.constraints))
    return np.array([worst[of] for of in sorted(worst)], dtype=np.intp)


def _bounds(problem: LayoutProblem, here: Point, bound: bool) -> tuple[Array, Array]:
    if not bound:
        return problem.lower, problem.upper
    t = abs(here.x[-1]) + 1e-300
    return np.r_[problem.lower, -1e3 * t], np.r_[problem.upper, 1e3 * t]


def _free_bound(model: SeparableModel) -> SeparableModel:
    """The bound variable enters linearly whatever the preset, in a box no wider than its rows need.

    Convex rows fall by no more than their slopes say, and where the point meets all constraints the bound
    need not rise. A wide box would set the unit of the subproblem far above what single members bring.
    """
    p, q = model.exponents.copy(), model.curvatures.copy()
    p[:, -1], q[:, -1] = 1.0, 0.0
    rows = model.gradients[:, -1] < 0
    reach = np.abs(model.gradients[rows, :-1]) @ (model.upper - model.lower)[:-1]
    room = 0.1 * float(reach.max()) + 1e-9 * abs(float(model.point[-1])) + 1e-300
    lower, upper = model.lower.copy(), model.upper.copy()
    lower[-1] = model.point[-1] + float((model.values[rows] - reach).max()) - room
    size = np.abs(model.gradients[1:]) @ (model.upper - model.lower)
    if (model.values[1:] <= _MET * size).all():
        upper[-1] = min(upper[-1], model.point[-1] + room)
    return SeparableModel.build(
        model.point, model.values, model.gradients, lower=lower, upper=upper,
        distances=model.distances, exponents=p, curvatures=q,
    )  # fmt: skip


def _violation(point: Point, bound: bool) -> float:
    others = point.values[1:]
    if bound:  # rows are measured by the objective
        others = others[np.abs(point.gradients[1:, -1]) == 0]
    return float(np.maximum(others, 0).max(initial=0.0))


def _pair(point: Point, bound: bool) -> tuple[float, float]:
    return float(point.values[0]), _violation(point, bound)


def _acceptable(pair: tuple[float, float], filter_: list[tuple[float, float]], *, patient: bool) -> bool:
    value, violation = pair
    dominating = sum(
        value >= f - 1e-10 * abs(f) and violation >= 0.999 * h - 1e-12 for f, h in filter_[-_MEMORY:]
    )
    last_f, last_h = filter_[-1]
    if last_h <= 1e-9 and violation <= 1e-9:
        return value < last_f  # feasible to feasible: descent
    return dominating <= (1 if patient else 0)


def _drawn_in(model: SeparableModel, share: float) -> SeparableModel:
    if share == 1.0:
        return model
    return replace(
        model,
        lower=model.point + share * (model.lower - model.point),
        upper=model.point + share * (model.upper - model.point),
    )


def _promise(problem: LayoutProblem, here: Point, prices: Array, bound: bool) -> float:
    if bound:
        rows = np.flatnonzero(here.gradients[1:, -1] != 0)
        total = float(prices[rows].sum())
        if total <= 0:
            return np.inf
        weights = prices[rows] / total
        prices = prices / total
        gradient = weights @ here.gradients[1 + rows, :-1]
        below = -float(weights @ here.values[1 + rows])  # of the largest row
        others = np.setdiff1d(np.arange(len(prices)), rows)
    else:
        gradient, below = here.gradients[0].copy(), 0.0
        others = np.arange(len(prices))
    further = others[problem.budgets :]
    slack = float(prices[further] @ np.maximum(-here.values[1 + further], 0)) if further.size else 0.0
    if further.size:
        gradient = gradient + prices[further] @ here.gradients[1 + further, : problem.members]
    return linear_promise(
        problem, here.x[: problem.members], gradient, prices[others[: problem.budgets]], slack + below
    )
