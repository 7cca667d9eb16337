"""Convex layouts along the central path: one evaluation per Newton step of an interior-point method.

For rows that are convex and bring their second derivative as factors (compliances of a truss: W is a by-
product of the factorised stiffness) the perturbed optimality conditions of

    min t   subject to   g_j(alpha) <= t,   A alpha <= h,   lower <= alpha <= upper

are followed by Newton steps on primal and dual variables. Staying away from the bounds is the point: a
member that a sequence of plain quadratic models drives to zero too early needs many steps to grow again (its
row behaves like 1/alpha), on the central path none vanishes before the others are settled. The products of
slack and multiplier are halved at best in a step, because near the end the rows of unused members bend
strongly. Budgets stay strictly met, so every iterate is a feasible design.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..bound.quadratic import BoundState, NewtonSystem
from ..formulation.problem import Evaluation, InvalidLayout, LayoutProblem
from ..outcome.history import Recorder
from ..outcome.optimality import linear_promise

__all__ = ["FreePart", "follow_central_path", "has_interior", "strictly_inside"]

Array = NDArray[np.float64]

_CENTRING = 0.5  # share of the mean product aimed at: halving is safe on strongly bending rows
_SHORTEST = 1e-3  # share of a Newton step below which a model that fails is given up
_PATIENCE = 12  # evaluations without a better design before rounding is taken for the cause


def has_interior(problem: LayoutProblem) -> bool:
    """True when the budgets leave room above the lower bounds."""
    free = problem.free
    floor = problem.costs @ problem.lower
    used = (problem.costs[:, free] > 0).any(axis=1)
    return bool((problem.limits[used] > floor[used] * (1 + 1e-9) + 1e-300).all())


def strictly_inside(problem: LayoutProblem) -> Array:
    """The start moved strictly inside bounds and budgets."""
    lower, upper, free = problem.lower, problem.upper, problem.free
    x = np.where(free, np.clip(problem.start, lower, upper), lower)
    width = upper - lower
    x = np.clip(x, lower + 1e-4 * width, upper - 1e-2 * width)
    for cost, limit in zip(problem.costs, problem.limits, strict=True):
        spent, least = cost @ x, cost @ lower
        if spent > 0.99 * limit + 0.01 * least:
            inside = cost > 0
            x[inside] = lower[inside] + (x[inside] - lower[inside]) * 0.99 * (limit - least) / (spent - least)
    return np.asarray(x)


@dataclass(frozen=True, slots=True, kw_only=True)
class FreePart:
    """The members that may change: free (members,), their bounds lower, upper (n,), their costs A (m, n), and
    limits (m,), what the others leave of the budgets."""

    free: NDArray[np.bool_]
    lower: Array
    upper: Array
    A: Array
    limits: Array

    @classmethod
    def of(cls, problem: LayoutProblem) -> "FreePart":
        """Of a problem."""
        free = problem.free
        spent = problem.costs[:, ~free] @ problem.lower[~free]
        return cls(
            free=free, lower=problem.lower[free], upper=problem.upper[free], A=problem.costs[:, free],
            limits=problem.limits - spent,
        )  # fmt: skip


def follow_central_path(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> bool:
    """Evaluate along the central path until the promise falls below the tolerance; True when it did."""
    part = FreePart.of(problem)
    free, lower, upper, A, limits = part.free, part.lower, part.upper, part.A, part.limits
    n, m = len(lower), len(limits)
    x = strictly_inside(problem)
    evaluation = problem.checked(x)
    values, G, W = _rows(problem, evaluation, free)
    r, q = len(values), len(values) + m
    recorder.add(x, evaluation)
    d = x[free]
    t = float(values.max() + 0.05 * abs(values.max()) + 1e-300)
    scale = float((np.abs(G) * (d - lower)).max(0).sum()) + 1e-300
    mu = 0.3 * scale / n
    y = np.r_[np.full(r, 1 / r), np.full(m, scale) / np.maximum(limits - A @ lower, 1e-300)]
    state = BoundState(
        d=d, t=t, s=np.r_[t - values, limits - A @ d], y=y, zl=mu / (d - lower), zu=mu / (upper - d)
    )
    idle = 0
    while recorder.evaluations < max_evaluations:
        heavy = state.y[:r] > 1e-9 * state.y[:r].max()
        columns = (np.sqrt(state.y[:r][heavy])[:, None, None] * W[heavy]).reshape(-1, n).T
        residual = np.r_[values - state.t, A @ state.d - limits] + state.s
        system = NewtonSystem(state, lower, upper, columns, np.vstack([G, A]), r, residual)
        count = q + 2 * n
        mu = state.complementarity(lower, upper) / count
        predictor = system.direction(0.0)
        primal, dual = system.lengths(predictor)
        trial = BoundState(d=state.d, t=state.t, s=state.s, y=state.y, zl=state.zl, zu=state.zu)
        trial.add(predictor, primal, dual)
        target = max((trial.complementarity(lower, upper) / count / mu) ** 3, _CENTRING) * mu
        step = system.direction(target, predictor)
        if not np.isfinite(step.d).all():
            return False
        primal, dual = system.lengths(step)
        short = max(0.9, 1 - mu * q / scale)
        state.add(step, short * primal, short * dual)
        x[free] = state.d
        tried = problem.tried(x)
        while tried is None and recorder.evaluations < max_evaluations and short > _SHORTEST:
            recorder.fail(x)
            state.add(step, -0.5 * short * primal, -0.5 * short * dual)  # half of the step that failed
            short *= 0.5
            x[free] = state.d
            tried = problem.tried(x)
        if tried is None:
            return False
        evaluation = tried
        values, G, W = _rows(problem, evaluation, free)
        state.s[:r] = np.maximum(state.s[:r], state.t - values)  # the curved rows may leave more room
        weights = state.y[:r] / state.y[:r].sum()
        gradient = np.zeros(problem.members)
        gradient[free] = weights @ G
        top = float(values.max())
        promise = linear_promise(problem, x, gradient, state.y[r:], top - float(weights @ values))
        better = recorder.add(x, evaluation, kkt=promise / max(abs(top), 1e-300))
        idle = 0 if better else idle + 1
        if promise <= tolerance * abs(top):
            return True
        if idle >= _PATIENCE:
            return False
    return False


def _rows(
    problem: LayoutProblem, evaluation: Evaluation, free: NDArray[np.bool_]
) -> tuple[Array, Array, Array]:
    values = np.atleast_2d(evaluation.values)
    rows = np.arange(values.size)
    factors = evaluation.factors(rows)
    if factors is None:
        raise InvalidLayout("the central path needs second derivatives; this objective has none")
    gradients = problem.checked_gradients(evaluation, rows)
    return values.ravel(), gradients[:, free], factors[:, :, free]
