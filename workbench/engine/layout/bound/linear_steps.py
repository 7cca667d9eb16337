"""Many further limits: steps by linear programmes in logarithms of the densities, inside a trust region.

    min over (z, t, s)  t + rho s    subject to   g_j + dg_j D z <= t,   c_l + dc_l D z <= s,   s >= 0,
                                                  A D z <= h - A x,   |z| <= radius,   D = diag(x - lower + e)

z is the change of log(x - lower + e): a member may shrink by the same share in every step, so that it can
vanish, and a stress that behaves like force over area bends little. A step is taken when the merit
max g + rho max(0, c) falls (exact penalty, Fletcher 1989); rho follows the multipliers. Where as many limits
as members are active, as in trusses with limited stresses, the steps converge like Newton's. A short step
that brings less than a quarter of its promise is corrected: the programme is solved again with what the
limits came to at its end, c(x') + dc_l D (z - z'), and the better of both is the step (second-order
correction). Limits that are far from active stay out of the programme until a step would break them. The
margin keeps iterates on the feasible side: it follows what the last step broke.
"""

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import local_peaks
from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.history import FEASIBLE, Recorder
from ..outcome.linear_programme import linear_programme
from ..outcome.result import FIRST_ORDER

__all__ = ["linear_steps"]

Array = NDArray[np.float64]

_RADIUS, _LARGEST, _SMALLEST = 0.7, 2.0, 1e-7
_CLEARANCE = 1e-6  # e, as a share of the width
_FAR = 0.5  # limits below -_FAR enter the programme only when a step would break them
_MARGIN = 1e-9  # least margin, in the unit of the limits
_POOR = 0.25  # of the promise: the step is corrected, the radius reduced
_CLOSE = 0.15  # radius of short steps; of longer ones the region is what is wrong
_QUIET = 8  # steps in a row that bring less than the tolerance


def linear_steps(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> bool:
    """Search from the start of the problem; True when the last programmes promised next to nothing."""
    x = problem.into_budgets(problem.start)
    evaluation = problem.checked(x)
    recorder.add(x, evaluation)
    radius, rho, margin, quiet = _RADIUS, 0.0, _MARGIN, 0
    while recorder.evaluations < max_evaluations and radius > _SMALLEST:
        step = _programme(problem, x, evaluation, radius, rho, margin)
        if step is None:
            radius *= 0.5
            continue
        move, predicted, slack, price = step
        unit = max(abs(float(np.max(evaluation.values))), 1e-300)
        rho = max(rho, 2 * price, 1e-3 * unit)
        merit = _merit(evaluation, rho, margin)
        promise = merit - (predicted + rho * slack)
        if promise <= 1e-3 * tolerance * unit:
            if margin > 2 * _MARGIN:
                margin = max(_MARGIN, 0.1 * margin)
                continue
            return _violation(evaluation) <= FEASIBLE
        trial = problem.into_budgets(move)
        tried = problem.tried(trial)
        if tried is None:
            recorder.fail(trial, radius=radius)
            radius *= 0.3
            continue
        ratio = (merit - _merit(tried, rho, margin)) / promise
        if ratio < _POOR and radius < _CLOSE and recorder.evaluations + 1 < max_evaluations:
            again = _programme(problem, x, evaluation, radius, rho, margin, came_to=(trial, tried))
            other = None if again is None else problem.into_budgets(again[0])
            found = None if other is None else problem.tried(other)
            if other is not None and found is None:
                recorder.fail(other, radius=radius)
            elif other is not None and found is not None:
                corrected = (merit - _merit(found, rho, margin)) / promise
                if corrected > ratio:
                    trial, tried, other, found, ratio = other, found, trial, tried, corrected
                recorder.add(other, found, radius=radius, accepted=False)
        taken = ratio > 1e-4
        recorder.add(trial, tried, radius=radius, accepted=taken)
        broken = _violation(tried)
        quiet = quiet + 1 if promise <= tolerance * unit else 0
        if taken:
            x, evaluation = trial, tried
            margin = float(np.clip(broken, _MARGIN, max(0.3 * margin, 0.02 * radius)))
        if ratio > 0.75:
            radius = min(1.5 * radius, _LARGEST)
        elif ratio < _POOR:
            radius *= 0.4
        if quiet >= _QUIET:
            return _violation(evaluation) <= FIRST_ORDER
    return False


def _violation(evaluation: Evaluation) -> float:
    return float(np.max(evaluation.constraints, initial=0.0))


def _merit(evaluation: Evaluation, rho: float, margin: float) -> float:
    worst = float(np.max(evaluation.constraints + margin, initial=0.0))
    return float(np.max(evaluation.values)) + rho * worst


def _programme(
    problem: LayoutProblem, x: Array, evaluation: Evaluation, radius: float, rho: float, margin: float, *,
    came_to: tuple[Array, Evaluation] | None = None,
) -> tuple[Array, float, float, float] | None:  # fmt: skip
    """Next design, predicted largest row and violation, and the sum of the prices of the limits.

    came_to: a trial and its evaluation, by which the limits are corrected.
    """
    n = problem.members
    width = problem.upper - problem.lower
    e = _CLEARANCE * width
    D = x - problem.lower + e
    with np.errstate(divide="ignore"):
        low = np.where(width > 0, np.log(e / np.where(D > 0, D, 1.0)), 0.0)
        high = np.where(width > 0, np.log((width + e) / np.where(D > 0, D, 1.0)), 0.0)
    low, high = np.clip(low, -radius, 0.0), np.clip(high, 0.0, radius)
    values = np.atleast_2d(evaluation.values)
    rows = np.arange(values.size) if values.shape[1] == 1 else local_peaks(values)
    top = values.ravel()[rows]
    slopes = problem.checked_gradients(evaluation, rows) * D
    c = np.asarray(evaluation.constraints, dtype=float) + margin
    dc = np.asarray(evaluation.constraint_gradients, dtype=float).reshape(-1, n) * D
    if came_to is not None:
        there, found = came_to
        c = np.asarray(found.constraints, dtype=float) + margin
        c -= dc @ np.where(D > 0, np.log((there - problem.lower + e) / np.where(D > 0, D, 1.0)), 0.0)
    unit = max(float(np.abs(slopes).max()), 1e-300)
    weight = max(rho / unit, 1.0 if rho == 0 else 0.0) * 10.0
    room = np.maximum(problem.limits - problem.costs @ x, 0.0)
    inside = c > -_FAR
    for _ in range(6):
        chosen = np.flatnonzero(inside)
        r, k, m = len(rows), len(chosen), problem.budgets
        matrix = np.zeros((r + k + m, n + 2))
        matrix[:r, :n], matrix[:r, n] = slopes / unit, -1.0
        matrix[r : r + k, :n], matrix[r : r + k, n + 1] = dc[chosen], -1.0
        matrix[r + k :, :n] = problem.costs * D
        solved = linear_programme(
            np.r_[np.zeros(n), 1.0, weight], at_most=(matrix, np.r_[-top / unit, -c[chosen], room]),
            bounds=np.column_stack([np.r_[low, -np.inf, 0.0], np.r_[high, np.inf, np.inf]]),
        )  # fmt: skip
        if solved is None:
            return None
        z = solved.x[:n]
        broken = (c + dc @ z > float(solved.x[n + 1]) + 1e-9) & ~inside
        if not broken.any():
            break
        inside |= broken
    assert solved is not None
    prices = solved.prices[r : r + k]
    move = np.clip(problem.lower - e + D * np.exp(z), problem.lower, problem.upper)
    slack = max(0.0, float(np.max(c + dc @ z, initial=0.0)))
    return move, float((top + slopes @ z).max()), slack, float(prices.sum()) * unit
