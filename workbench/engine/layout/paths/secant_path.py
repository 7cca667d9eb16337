"""Convex layouts from gradients alone: barrier steps with models learnt on the way.

For convex rows without second derivatives the central path is followed with models. Compliances are modelled
between two bounds of theirs (`compliance.py`). Other rows are linear at the present design, their common
curvature learnt from the gradients seen so far (`secant.py`). The barrier step of the model (`barrier.py`) is
solved to its end before the next evaluation. As the barrier itself is exact, an imperfect model costs
digits, not the balance of slacks and multipliers: a primal-dual step with such a model runs into the bounds
and stays there. mu falls as fast as the model deserves: by the part of the stationarity that the true
gradients leave at the new design. A step that does not lower the barrier function is not taken, but learnt
from, and what is not known is trusted less. Every iterate is a feasible design.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..bound.quadratic import BoundState
from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import Recorder
from ..outcome.optimality import linear_promise
from .barrier import RowsModel, barrier_function, barrier_minimum
from .central_path import FreePart, follow_central_path, strictly_inside
from .compliance import ComplianceModel, are_compliances
from .secant import SecantMemory, SecantModel

__all__ = ["follow_paths", "follow_secant_path"]

Array = NDArray[np.float64]

_FIRST = 0.1  # gap aimed at first, in units of the value's reach
# stationarity left, in units of mu -> factor of mu
_MISFIT, _FALL = (0.02, 0.2, 0.6, 1.5, 3.0), (0.1, 0.25, 0.5, 0.8, 1.0)
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
    part = FreePart.of(problem)
    free, lower, upper, A, limits = part.free, part.lower, part.upper, part.A, part.limits
    n, m = len(lower), len(limits)
    x = strictly_inside(problem)
    evaluation = problem.checked(x)
    recorder.add(x, evaluation)
    values, gradients = _rows(problem, evaluation)
    r = len(values)
    scale = float((np.abs(gradients[:, free]) * (x[free] - lower)).max(0).sum()) + 1e-300
    mu = _FIRST * scale / n
    t = float(values.max() + 0.05 * abs(values.max()) + 1e-300)
    state = BoundState(
        d=np.zeros(n), t=t, s=np.r_[t - values, limits - A @ x[free]],
        y=np.r_[np.full(r, 1 / r), np.full(m, scale) / np.maximum(limits - A @ lower, 1e-300)],
        zl=mu / (x[free] - lower), zu=mu / (upper - x[free]),
    )  # fmt: skip
    memory, refusals = SecantMemory(), 0
    learnt = SecantModel(free=free, lower=problem.lower, memory=memory)
    model: RowsModel = ComplianceModel(free=free) if are_compliances(x, values, gradients) else learnt
    while recorder.evaluations < max_evaluations and refusals <= _REFUSALS:
        here = x[free]
        model.place(x, values, gradients, np.maximum(state.y[:r], 1e-9))
        solved = barrier_minimum(model, state, A, limits - A @ here, lower - here, upper - here, mu)
        trial, tried = x.copy(), None
        if solved is not None:
            trial[free] = np.clip(here + solved.d, lower, upper)
            tried = problem.tried(trial)
            if tried is None:
                recorder.fail(trial)
        if solved is None or tried is None:
            model, refusals = _stiffer(model, learnt), refusals + 1
            continue
        trial_values, trial_gradients = _rows(problem, tried)
        weights = solved.y[:r] / solved.y[:r].sum()
        top = float(trial_values.max())
        promise = linear_promise(
            problem, trial, np.where(free, weights @ trial_gradients, 0.0), solved.y[r:],
            top - float(weights @ trial_values),
        )  # fmt: skip
        taken = barrier_function(trial[free], trial_values, mu, lower, upper, A, limits) < barrier_function(
            here, values, mu, lower, upper, A, limits
        )
        recorder.add(trial, tried, kkt=promise / max(abs(top), 1e-300), accepted=taken)
        if promise <= tolerance * abs(top):
            return True
        memory.add(here - lower, gradients[:, free], trial[free] - lower, trial_gradients[:, free])
        if not model.learn(trial, trial_values, trial_gradients, taken=taken):
            model = learnt
        if not taken:
            model, refusals = _stiffer(model, learnt), refusals + 1
            continue
        left = solved.y[:r] @ trial_gradients[:, free] + solved.y[r:] @ A - solved.zl + solved.zu
        misfit = float(np.abs((trial[free] - lower) * left).sum()) / (n * mu)
        x, values, gradients = trial, trial_values, trial_gradients
        t = max(solved.t, top + mu)
        state = BoundState(
            d=np.zeros(n), t=t, s=np.r_[np.maximum(t - values, 1e-3 * mu), solved.s[r:]], y=solved.y,
            zl=solved.zl, zu=solved.zu,
        )  # fmt: skip
        mu *= float(np.interp(misfit, _MISFIT, _FALL))
        model.relax()
        refusals = 0
    return False


def _stiffer(model: RowsModel, learnt: RowsModel) -> RowsModel:
    """The model after a refused step: a stiffer one, or the learnt one where it cannot be."""
    return model if model.stiffen() else learnt


def _rows(problem: LayoutProblem, evaluation: Evaluation) -> tuple[Array, Array]:
    values = np.atleast_2d(evaluation.values)
    return values.ravel(), problem.checked_gradients(evaluation, np.arange(values.size))
