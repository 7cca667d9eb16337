"""Many further limits: steps by linear programmes in logarithms of the densities, inside a trust region.

    min over (z, t, s)  t + rho s    subject to   g_j + dg_j D z <= t,   c_l + dc_l D z <= s,   s >= 0,
                                                  A D z <= h - A x,   |z| <= radius,   D = diag(x - lower + e)

z is the change of log(x - lower + e), of log x where the lower bound is small but not zero: a member may
shrink by the same share in every step, so that it can vanish, and a stress that behaves like force over area
bends little. A step is taken when the merit max g + sum_l w_l max(0, c_l) falls (exact penalty of sums,
Fletcher 1989). w_l follows the multiplier of each limit, down as well as up: a limit without a price, of a
member that is nearly gone, say, costs next to nothing to mend, and must not refuse a step. Where as many
limits as members are active, as in trusses with limited stresses, the steps converge like Newton's. A short
step that brings less than a quarter of its promise is corrected: the programme is solved again with what the
limits came to at its end, c(x') + dc_l D (z - z'), and the better of both is the step (second-order
correction). Limits that are far from active stay out of the programme until a step would break them. Each
limit has a margin, by which the last step missed it, so that the next ends on the feasible side; where three
steps in a row do not, all limits get the largest of them.
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
_CLEARANCE = 1e-6  # e at most, as a share of the width
_FAR = 0.5  # limits below -_FAR enter the programme only when a step would break them
_MARGIN = 1e-9  # least margin, in the unit of the limits
_OUTSIDE = 3  # steps in a row that end outside the limits: all get the same margin
_POOR = 0.25  # of the promise: the step is corrected, the radius reduced
_CLOSE = 0.15  # radius of short steps; of longer ones the region is what is wrong
_PRICED = 2.0  # penalty of a limit over its multiplier
_KEPT = 0.5  # of a penalty, at least, from one step to the next
_LEAST = 0.05  # penalty of a limit without a price, of the sum of all multipliers
_RISE = 4.0  # of rho, at most, where the programme leaves limits broken: prices are its own penalty then
_QUIET = 8  # steps in a row that bring less than the tolerance


def linear_steps(
    problem: LayoutProblem, recorder: Recorder, *, max_evaluations: int, tolerance: float
) -> bool:
    """Search from the start of the problem; True when the last programmes promised next to nothing."""
    x = problem.into_budgets(problem.start)
    evaluation = problem.checked(x)
    recorder.add(x, evaluation)
    radius, rho, quiet, outside = _RADIUS, 0.0, 0, 0
    margin, penalties = np.full(evaluation.constraints.size, _MARGIN), np.zeros(evaluation.constraints.size)
    while recorder.evaluations < max_evaluations and radius > _SMALLEST:
        step = _programme(problem, x, evaluation, radius, rho, margin)
        if step is None:
            radius *= 0.5
            continue
        move, predicted, left, prices = step
        unit = max(abs(float(np.max(evaluation.values))), 1e-300)
        rho, penalties = _penalties(
            rho, penalties, prices, 1e-3 * unit, broken=left.max(initial=0.0) > FEASIBLE
        )
        merit = _merit(evaluation, penalties, margin)
        promise = merit - (predicted + float(penalties @ left))
        if promise <= 1e-3 * tolerance * unit:
            if margin.max(initial=0.0) > 2 * _MARGIN:
                margin = np.maximum(_MARGIN, 0.1 * margin)
                continue
            return _violation(evaluation) <= FEASIBLE
        trial = problem.into_budgets(move)
        tried = problem.tried(trial)
        if tried is None:
            recorder.fail(trial, radius=radius)
            radius *= 0.3
            continue
        ratio = (merit - _merit(tried, penalties, margin)) / promise
        if ratio < _POOR and radius < _CLOSE and recorder.evaluations + 1 < max_evaluations:
            again = _programme(problem, x, evaluation, radius, rho, margin, came_to=(trial, tried))
            other = None if again is None else problem.into_budgets(again[0])
            found = None if other is None else problem.tried(other)
            if other is not None and found is None:
                recorder.fail(other, radius=radius)
            elif other is not None and found is not None:
                corrected = (merit - _merit(found, penalties, margin)) / promise
                if corrected > ratio:
                    trial, tried, other, found, ratio = other, found, trial, tried, corrected
                recorder.add(other, found, radius=radius, accepted=False)
        taken = ratio > 1e-4
        recorder.add(trial, tried, radius=radius, accepted=taken)
        quiet = quiet + 1 if promise <= tolerance * unit else 0
        if taken:
            x, evaluation = trial, tried
            outside = 0 if _violation(tried) <= FEASIBLE else outside + 1
            margin = _margins(margin, tried, 0.02 * radius, alike=outside >= _OUTSIDE)
        if ratio > 0.75:
            radius = min(1.5 * radius, _LARGEST)
        elif ratio < _POOR:
            radius *= 0.4
        if quiet >= _QUIET:
            return _violation(evaluation) <= FIRST_ORDER
    return False


def _clearance(problem: LayoutProblem) -> Array:
    """e of each density: the lower bound where it is small, so that z is the change of log x.

    Members that hang on a node alone carry what their ratios say, however light they are: with e above them
    a short step in z would change them by a multiple of what they are.
    """
    most = _CLEARANCE * (problem.upper - problem.lower)
    return np.where(problem.lower > 0, np.minimum(problem.lower, most), most)


def _margins(margin: Array, tried: Evaluation, most: float, *, alike: bool) -> Array:
    """Margin of each limit: by how much the last step missed it, up to `most`, or a third of what it was.

    alike: all get the largest of them
    """
    missed = tried.constraints + margin
    if alike:
        missed = np.full_like(missed, missed.max(initial=0.0))
    return np.maximum(np.clip(missed, _MARGIN, max(most, _MARGIN)), 0.3 * margin)


def _violation(evaluation: Evaluation) -> float:
    return float(np.max(evaluation.constraints, initial=0.0))


def _penalties(
    rho: float, penalties: Array, prices: Array, least: float, *, broken: bool
) -> tuple[float, Array]:
    """Penalties of the largest violation and of each limit, from the prices of a programme.

    broken: the programme could not meet the limits    least: rho at least
    """
    total = _PRICED * float(prices.sum())
    wanted = max(rho, min(total, _RISE * rho)) if broken else total
    wanted = max(wanted, least)
    follow = _PRICED * prices * min(1.0, wanted / max(total, 1e-300))
    return wanted, np.maximum(np.maximum(follow, _KEPT * penalties), _LEAST * wanted / _PRICED)


def _merit(evaluation: Evaluation, penalties: Array, margin: Array) -> float:
    return float(np.max(evaluation.values) + penalties @ np.maximum(evaluation.constraints + margin, 0.0))


def _programme(
    problem: LayoutProblem, x: Array, evaluation: Evaluation, radius: float, rho: float, margin: Array, *,
    came_to: tuple[Array, Evaluation] | None = None,
) -> tuple[Array, float, Array, Array] | None:  # fmt: skip
    """Next design, predicted largest row, and of each limit what stays broken and its price.

    came_to: a trial and its evaluation, by which the limits are corrected.
    """
    n = problem.members
    width = problem.upper - problem.lower
    e = _clearance(problem)
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
    prices = np.zeros(len(c))
    prices[chosen] = np.maximum(solved.prices[r : r + k], 0.0) * unit
    move = np.clip(problem.lower - e + D * np.exp(z), problem.lower, problem.upper)
    return move, float((top + slopes @ z).max()), np.maximum(c + dc @ z, 0.0), prices
