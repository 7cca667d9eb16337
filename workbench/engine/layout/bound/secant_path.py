"""Convex layouts from gradients alone: barrier steps with a Hessian learnt on the way.

For convex rows without second derivatives the central path is followed with models: at the present design the
rows are linear, their common curvature comes from the gradients seen so far (`secant.py`), and the barrier

    min over (x, t)  t + (x - x^k)' H (x - x^k)/2 - mu [ sum log(x - lower) + sum log(upper - x) + sum log s ]

with s the slacks of rows and budgets is solved to its end before the next evaluation. As the barrier itself
is exact, an imperfect H costs digits, not the balance of slacks and multipliers: a primal-dual step with such
an H runs into the bounds and stays there. mu falls as fast as the model deserves: by the part of the
stationarity that the true gradients leave at the new design. A step that does not lower the barrier function
is not taken, but its gradient is learnt, and the curvature is raised. Every iterate is a feasible design.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import Recorder
from ..outcome.optimality import linear_promise
from .central_path import follow_central_path, strictly_inside
from .quadratic import BoundState, NewtonSystem
from .secant import Curvature, SecantMemory

__all__ = ["follow_paths", "follow_secant_path"]

Array = NDArray[np.float64]

_FIRST = 0.1  # gap aimed at first, in units of the value's reach
_MISFIT, _FALL = (0.6, 1.5, 3.0), (0.5, 0.8, 1.0)  # stationarity left, in units of mu -> factor of mu
_NEWTON, _SETTLED = 40, 1e-3
_STIFFEN, _RELAX = 4.0, 0.5  # of the curvature after a refused and after an accepted step
_REFUSALS = 15


def follow_paths(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> tuple[bool, str]:
    """Newton steps along the central path, then barrier steps from the best where they come no further.

    A Newton step takes no look at what it makes of the value. Returns whether it ended, and what was done.
    """
    done = follow_central_path(problem, recorder, max_evaluations=max_evaluations, tolerance=tolerance)
    said = "Newton steps along the central path"
    if done or recorder.evaluations >= max_evaluations or recorder.best_density is None:
        return done, said
    best = replace(problem, start=recorder.best_density)
    done = follow_secant_path(best, recorder, max_evaluations=max_evaluations, tolerance=tolerance)
    return done, f"{said}, then barrier steps with curvature from gradients"


def follow_secant_path(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> bool:
    """Evaluate until the linearised rows promise less than the tolerance; True when they do."""
    free = problem.free
    lower, upper, A = problem.lower[free], problem.upper[free], problem.costs[:, free]
    limits = problem.limits - problem.costs[:, ~free] @ problem.lower[~free]
    n, m = int(free.sum()), problem.budgets
    x = strictly_inside(problem)
    evaluation = problem.checked(x)
    recorder.add(x, evaluation)
    values, G = _rows(problem, evaluation, free)
    r = len(values)
    scale = float((np.abs(G) * (x[free] - lower)).max(0).sum()) + 1e-300
    mu = _FIRST * scale / n
    t = float(values.max() + 0.05 * abs(values.max()) + 1e-300)
    state = BoundState(
        d=np.zeros(n), t=t, s=np.r_[t - values, limits - A @ x[free]],
        y=np.r_[np.full(r, 1 / r), np.full(m, scale) / np.maximum(limits - A @ lower, 1e-300)],
        zl=mu / (x[free] - lower), zu=mu / (upper - x[free]),
    )  # fmt: skip
    memory, stiff, refusals = SecantMemory(), 1.0, 0
    while recorder.evaluations < max_evaluations:
        here = x[free]
        weights = np.maximum(state.y[:r], 1e-9)
        model = memory.curvature(here - lower, G, weights, stiffness=stiff)
        jacobian, room = np.vstack([G, A]), limits - A @ here
        solved = _barrier_step(state, values, jacobian, model, room, lower - here, upper - here, mu)
        if not np.isfinite(solved.d).all():
            return False
        trial = x.copy()
        trial[free] = np.clip(here + solved.d, lower, upper)
        trial_evaluation = problem.tried(trial)
        if trial_evaluation is None:
            recorder.fail(trial)
            stiff, refusals = stiff * _STIFFEN, refusals + 1
            if refusals > _REFUSALS:
                return False
            continue
        trial_values, trial_G = _rows(problem, trial_evaluation, free)
        memory.add(here - lower, G, trial[free] - lower, trial_G)
        gradient = np.zeros(problem.members)
        gradient[free] = solved.y[:r] @ trial_G / solved.y[:r].sum()
        top = float(trial_values.max())
        slack = top - float(solved.y[:r] @ trial_values / solved.y[:r].sum())
        promise = linear_promise(problem, trial, gradient, solved.y[r:], slack)
        taken = _barrier(trial[free], trial_values, mu, lower, upper, A, limits) < _barrier(
            here, values, mu, lower, upper, A, limits
        )
        recorder.add(trial, trial_evaluation, kkt=promise / max(abs(top), 1e-300), accepted=taken)
        if promise <= tolerance * abs(top):
            return True
        if not taken:
            stiff, refusals = stiff * _STIFFEN, refusals + 1
            if refusals > _REFUSALS:
                return False
            continue
        left = solved.y[:r] @ trial_G + solved.y[r:] @ A - solved.zl + solved.zu
        misfit = float(np.abs((trial[free] - lower) * left).sum()) / (n * mu)
        x, values, G = trial, trial_values, trial_G
        t = max(solved.t, top + mu)
        state = BoundState(
            d=np.zeros(n), t=t, s=np.r_[np.maximum(t - values, 1e-3 * mu), solved.s[r:]], y=solved.y,
            zl=solved.zl, zu=solved.zu,
        )  # fmt: skip
        mu *= float(np.interp(misfit, _MISFIT, _FALL))
        stiff, refusals = max(1.0, _RELAX * stiff), 0
    return False


def _barrier_step(
    state: BoundState, values: Array, jacobian: Array, model: Curvature, room: Array, lo: Array, hi: Array,
    mu: float,
) -> BoundState:  # fmt: skip
    """The minimiser of the model with its barrier, by primal-dual Newton steps at a fixed mu."""
    r = len(values)
    now = BoundState(
        d=np.zeros_like(lo), t=state.t, s=state.s.copy(), y=state.y.copy(), zl=state.zl, zu=state.zu
    )
    offset = np.r_[values, -room]
    for _ in range(_NEWTON):
        residual = offset + jacobian @ now.d + now.s
        residual[:r] -= now.t
        system = NewtonSystem(
            now, lo, hi, model.columns, jacobian, r, residual,
            diagonal=model.diagonal, signs=model.signs, slope=model.times(now.d),
        )  # fmt: skip
        off = max(
            float(np.abs((now.d - lo) * system.dual_residual).max()),
            float(np.abs(now.y * residual).max()),
            float(np.abs(now.y * now.s - mu).max()),
            float(np.abs(now.zl * (now.d - lo) - mu).max()),
            float(np.abs(now.zu * (hi - now.d) - mu).max()),
        )
        if off <= _SETTLED * mu:
            break
        step = system.direction(mu)
        if not np.isfinite(step.d).all():
            break  # rounding has the last word
        primal, dual = system.lengths(step)
        now.add(step, 0.95 * primal if primal < 1 else 1.0, 0.95 * dual if dual < 1 else 1.0)
    return now


def _barrier(
    x: Array, values: Array, mu: float, lower: Array, upper: Array, A: Array, limits: Array
) -> float:
    """The largest row with the barrier of bounds and budgets; infinite outside."""
    inside = np.concatenate([x - lower, upper - x, limits - A @ x])
    if (inside <= 0).any():
        return np.inf
    return float(values.max() - mu * np.log(inside).sum())


def _rows(problem: LayoutProblem, evaluation: Evaluation, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    values = np.atleast_2d(evaluation.values)
    gradients = problem.checked_gradients(evaluation, np.arange(values.size))
    return values.ravel(), gradients[:, free]
