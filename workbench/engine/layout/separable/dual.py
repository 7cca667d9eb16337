"""The dual of the separable subproblem, (7.9) and (7.10), safeguarded.

    maximise over 0 <= l <= cap of  min over the box of  f~_0(x) + sum_j l_j f~_j(x)

(7.9) prints l_j > 0; an idle budget has l_j = 0. The cap is the price of elastic variables (f~_j <= z_j at
the cost cap z_j): an infeasible subproblem then has a solution, and says that it is elastic. One constraint:
a bracketed root. Several: where the dual has kinks, or there are many variables, an interior point and Newton
steps on its active set; else projected Newton on the concave dual; each stands in for the other. A linear
model is a linear programme: by sorting where constraints share no variable, else by HiGHS.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from ..outcome.knapsack import continuous_knapsack
from ..outcome.linear_programme import linear_programme
from .interior import interior_point
from .model import SeparableModel

__all__ = ["SubproblemSolution", "kkt_residual", "solve_subproblem"]

Array = NDArray[np.float64]

_BARRIERS = 1e-11, 1e-18  # of the interior point before Newton steps on the active set
_MANY = 2000  # variables from which a look at the dual takes longer than a step of the interior point
_POLISHING = 6  # Newton steps on the active set
_EXACT, _GOOD = 1e-11, 1e-9  # residual of an optimum, and one for which the dual is not asked
_FEASIBLE = 1e-12  # of a constraint, in units of the change its gradient can make in the box


@dataclass(frozen=True, slots=True, kw_only=True)
class SubproblemSolution:
    """x (n,), multipliers (m,), model values (m + 1,) at x, elastic: True when a constraint could not be
    met."""

    x: Array
    multipliers: Array
    values: Array
    elastic: bool


def solve_subproblem(model: SeparableModel, *, cap: float = 1e6) -> SubproblemSolution:
    """Minimise the model's objective under its constraints in its box.

    cap: largest multiplier, in units of (largest objective gradient)/(largest gradient of the constraint).

    >>> import numpy as np
    >>> w, one = np.array([1.0, 4.0]), np.ones(2)
    >>> model = SeparableModel.build(one, np.array([5.0, 0.0]), np.vstack([-w, one]), lower=0.01 * one,
    ...                              upper=9 * one, distances=1.0, exponents=np.array([[-1.0], [1.0]]))
    >>> solve_subproblem(model).x.round(6)            # sqrt(w), scaled to the sum 2
    array([0.666667, 1.333333])
    """
    part = model.within_reach()
    found = _in_unit_box(part, cap)
    if part is model:
        return found
    shut = ((found.x <= part.lower) & (part.lower > model.lower)) | (
        (found.x >= part.upper) & (part.upper < model.upper)
    )
    return _in_unit_box(model, cap) if shut.any() else found


def _in_unit_box(model: SeparableModel, cap: float) -> SubproblemSolution:
    unit = model.in_unit_box()
    inside = _solved(unit, cap)
    x = np.clip(model.lower + inside.x * (model.upper - model.lower), model.lower, model.upper)
    return replace(inside, x=np.where(inside.x >= unit.upper, model.upper, x))


def _solved(model: SeparableModel, cap: float) -> SubproblemSolution:
    m = model.constraints
    if m == 0:
        x, _ = model.minimiser(np.ones(1))
        return _solution(model, x, np.zeros(0))
    dead = (model.gradients[1:] == 0).all(axis=1) & (model.curvatures[1:] == 0).all(axis=1)
    if dead.any():  # no variable can change these
        rest = _solved(model.without(np.flatnonzero(dead)), cap)
        prices = np.zeros(m)
        prices[~dead] = rest.multipliers
        found = _solution(model, rest.x, prices)
        return replace(found, elastic=rest.elastic or bool((model.values[1:][dead] > 0).any()))
    reach = np.abs(model.gradients) @ (model.upper - model.lower)
    size = np.where(reach[1:] > 0, reach[1:], np.maximum(np.abs(model.values[1:]), 1.0))
    caps = cap * max(float(reach[0]), float(size.max()) * 1e-12, 1e-300) / size
    if model.is_linear:
        return _linear(model, caps, size)
    if m == 1 and len(model.point) < _MANY:
        return _one_constraint(model, float(caps[0]), float(size[0]))
    seen = (model.gradients[1:] != 0) | (model.curvatures[1:] != 0)
    apart = bool(seen.sum(axis=0).max() <= 1)
    if len(model.point) >= _MANY or not apart:
        together = _several(model, caps, size, also_by_dual=not apart)
        if together is not None:
            return together
    return _apart(model, caps, size, seen)


def _solution(model: SeparableModel, x: Array, multipliers: Array) -> SubproblemSolution:
    values, _ = model.at(x)
    reach = np.abs(model.gradients[1:]) @ (model.upper - model.lower)
    elastic = bool((values[1:] > 1e-7 * np.maximum(reach, 1e-300)).any())
    return SubproblemSolution(x=x, multipliers=multipliers, values=values, elastic=elastic)


def _linear(model: SeparableModel, caps: Array, size: Array) -> SubproblemSolution:
    m, n = model.constraints, len(model.point)
    sorted_ = _by_sorting(model)
    if sorted_ is not None:
        return sorted_
    unit = max(float(np.abs(model.gradients[0]).max()), 1e-300)
    rows = model.gradients[1:] / size[:, None]
    solved = linear_programme(
        np.r_[model.gradients[0] / unit, caps * size / unit],
        at_most=(np.hstack([rows, -np.eye(m)]), rows @ model.point - model.values[1:] / size),
        bounds=np.column_stack([np.r_[model.lower, np.zeros(m)], np.r_[model.upper, np.full(m, np.inf)]]),
    )
    tried = []
    if solved is not None:
        x = np.clip(solved.x[:n], model.lower, model.upper)
        tried.append(_solution(model, x, solved.prices * unit / size))
    if solved is None or kkt_residual(model, tried[0], caps) > _EXACT:  # HiGHS leaves rows by up to 1e-7
        x, prices = interior_point(model, caps)
        tried += [_solution(model, *one) for one in ((x, prices), *_polished(model, x, prices, size, caps))]
    return min(tried, key=lambda one: kkt_residual(model, one, caps))


def _by_sorting(model: SeparableModel) -> SubproblemSolution | None:
    """A linear model whose constraints share no variable and grow with all of theirs; None for others, and
    where a constraint cannot be met."""
    slopes = model.gradients[1:]
    if (slopes < 0).any() or ((slopes > 0).sum(axis=0) > 1).any():
        return None
    gradient, at = model.gradients[0], model.point
    low, high = model.lower - at, model.upper - at
    move = np.where(gradient < 0, high, np.where(gradient > 0, low, np.clip(0.0, low, high)))
    prices = np.zeros(model.constraints)
    for j, (slope, value) in enumerate(zip(slopes, model.values[1:], strict=True)):
        inside = slope > 0
        found = continuous_knapsack(gradient[inside], slope[inside], -value, low[inside], high[inside])
        if found is None:
            return None
        move[inside], prices[j] = found
    return _solution(model, np.clip(at + move, model.lower, model.upper), prices)


def _one_constraint(model: SeparableModel, cap: float, size: float) -> SubproblemSolution:
    def minimiser(price: float) -> Array:
        return model.minimiser(np.array([1.0, price]))[0]

    def constraint(price: float) -> float:
        return float(model.at(minimiser(price))[0][1])

    if constraint(0.0) <= 0:
        return _solution(model, minimiser(0.0), np.zeros(1))
    met = _FEASIBLE * size
    low, high = 0.0, cap * 1e-6  # the cap is in units of 1e6 typical prices
    while constraint(high) > 0:
        low, high = high, high * 8
        if low >= cap:
            return _solution(model, minimiser(cap), np.array([cap]))
    low, high = _bracket(constraint, low, high, met)
    inside = minimiser(high)
    if model.at(inside)[0][1] < -met:
        # where the Lagrangian is flat the minimiser jumps at the price; every mixture of both sides
        # minimises it
        outside = minimiser(low)
        move = inside - outside
        share = _bracket(lambda a: float(model.at(outside + a * move)[0][1]), 0.0, 1.0, 0.0)[1]
        inside = outside + share * move
    return _solution(model, inside, np.array([high]))


def _apart(model: SeparableModel, caps: Array, size: Array, seen: NDArray[np.bool_]) -> SubproblemSolution:
    """Constraints that share no variable (budgets of domains, (7.18)): one root each."""
    x = model.minimiser(np.r_[1.0, np.zeros(model.constraints)])[0]
    prices = np.zeros(model.constraints)
    for j in range(model.constraints):
        one = _one_constraint(model.part(j, seen[j]), float(caps[j]), float(size[j]))
        x[seen[j]] = one.x
        prices[j] = one.multipliers[0]
    return _solution(model, x, prices)


def _bracket(
    function: Callable[[float], float], low: float, high: float, enough: float
) -> tuple[float, float]:
    """Shrink function(low) > 0 >= function(high) to neighbouring numbers, or until -enough <= function(high).

    Regula falsi with the Illinois rule, and halving where it lags.
    """
    at_low, at_high = function(low), function(high)
    if at_low <= 0:
        return low, low
    for count in range(250):
        if count % 3 == 2:
            middle = np.sqrt(low * high) if low > 0 and high > 4 * low else 0.5 * (low + high)
        else:
            middle = low + (high - low) * at_low / (at_low - at_high)
        if not low < middle < high:
            middle = 0.5 * (low + high)
            if not low < middle < high:
                break
        value = function(middle)
        if value > 0:
            low, at_low = middle, value
            at_high *= 0.5 if count % 3 == 1 else 1.0
        else:
            high, at_high = middle, value
            at_low *= 0.5 if count % 3 == 1 else 1.0
            if value >= -enough:
                break
    return low, high


def _several(
    model: SeparableModel, caps: Array, size: Array, *, also_by_dual: bool
) -> SubproblemSolution | None:
    """From inside, and by the dual; None where the dual is not asked and the inside is not exact."""
    tried: list[tuple[float, SubproblemSolution]] = []

    def exact(x: Array, prices: Array) -> bool:
        found = _solution(model, x, prices)
        tried.append((kkt_residual(model, found, caps), found))
        return tried[-1][0] <= _EXACT

    def inside(last: float, *, missed: bool = False) -> bool:
        x, prices = interior_point(model, caps, last=last, missed=missed)
        return exact(x, prices) or any(exact(*one) for one in _polished(model, x, prices, size, caps))

    def by_dual() -> bool:
        prices = _projected_newton(model, caps, size)
        return exact(model.minimiser(np.r_[1.0, prices])[0], prices)

    first, last = _BARRIERS
    ways: list[Callable[[], bool]] = [
        partial(inside, first),
        partial(inside, last),
        partial(inside, last, missed=True),
    ]
    if len(model.point) < _MANY and not _has_kinks(model):
        ways[0] = by_dual
    elif also_by_dual:
        ways.append(by_dual)
    for count, way in enumerate(ways):
        if (count > 1 and min(one[0] for one in tried) <= _GOOD) or way():
            break
    residual, found = min(tried, key=lambda one: one[0])
    return found if also_by_dual or residual <= _EXACT else None


def _has_kinks(model: SeparableModel) -> bool:
    """Whether a variable enters linearly all that sees it, constraints among them: it jumps at a price."""
    straight = ((model.exponents == 1.0) & (model.curvatures == 0.0)).all(axis=0)
    return bool((straight & (model.gradients[1:] != 0.0).any(axis=0)).any())


def _polished(
    model: SeparableModel, x: Array, prices: Array, size: Array, caps: Array
) -> Iterator[tuple[Array, Array]]:
    """Newton steps on the active set, which begins as the interior point found it: the last digits.

    First of all variables together, then of the prices alone with each curved variable where they put it."""
    curved = ((model.exponents != 1.0) | (model.curvatures != 0.0)).any(axis=0)
    for exactly in (False, True):
        one = x.copy(), prices.copy()
        for _ in range(_POLISHING):
            if exactly:
                one = _put(model, *one, curved), one[1]
                yield one
            moved = _newton_step(model, *one, size, caps)
            if moved is None:
                break
            one = moved
            yield one
        yield _put(model, *one, curved), one[1]


def _put(model: SeparableModel, x: Array, prices: Array, curved: NDArray[np.bool_]) -> Array:
    return np.where(curved, model.minimiser(np.r_[1.0, prices])[0], x)


def _newton_step(
    model: SeparableModel, x: Array, prices: Array, size: Array, caps: Array
) -> tuple[Array, Array] | None:
    values, gradients = model.at(x)
    weights = np.r_[1.0, prices]
    total = weights @ gradients
    free = (model.lower < model.upper) & np.where(
        x <= model.lower, total < 0, (x < model.upper) | (total > 0)
    )
    active = np.flatnonzero((prices > 0) & (prices < caps))
    if not free.any():
        return None
    bend = model.bend(weights, x)[free]
    typical = float((weights @ np.abs(gradients)).max() / (model.upper - model.lower).max())
    bend = np.maximum(bend, 1e-8 * max(float(bend.max(initial=0)), typical, 1e-290))
    J = gradients[1 + active][:, free]
    slope = total[free]
    weighted = J / bend
    unit = size[active]
    schur = (weighted @ J.T) / unit[:, None] / unit
    right = (values[1 + active] - weighted @ slope) / unit
    change = np.linalg.lstsq(schur, right, rcond=1e-14)[0] / unit if active.size else np.zeros(0)
    new, priced = x.copy(), prices.copy()
    new[free] = np.clip(x[free] - (slope + change @ J) / bend, model.lower[free], model.upper[free])
    priced[active] = np.clip(prices[active] + change, 0.0, caps[active])
    return new, priced


def _projected_newton(model: SeparableModel, caps: Array, size: Array) -> Array:
    prices = np.zeros(model.constraints)
    _, dual, h, H = _dual(model, prices)
    for _ in range(60):
        residual = _projected(prices, h, caps) / size
        if np.abs(residual).max() <= _FEASIBLE:
            break
        moving = residual != 0
        stiff = H[np.ix_(moving, moving)]
        damping = 1e-12 * float(np.trace(stiff)) + 1e-300
        step = np.zeros_like(prices)
        step[moving] = np.linalg.solve(stiff + damping * np.eye(int(moving.sum())), h[moving])
        length = 1.0
        for _ in range(30):
            trial = np.clip(prices + length * step, 0, caps)
            new = _dual(model, trial)
            if new[1] >= dual + 1e-4 * float(h @ (trial - prices)) - 1e-15 * abs(dual):
                break
            length *= 0.4
        else:
            break
        if np.array_equal(trial, prices):
            break
        prices, (_, dual, h, H) = trial, new
    return prices


def _dual(model: SeparableModel, prices: Array) -> tuple[Array, float, Array, Array]:
    weights = np.r_[1.0, prices]
    x, curvature = model.minimiser(weights)
    values, gradients = model.at(x)
    inverse = np.where(curvature > 0, 1 / np.where(curvature > 0, curvature, 1.0), 0.0)
    return x, float(weights @ values), values[1:], (gradients[1:] * inverse) @ gradients[1:].T


def _projected(prices: Array, h: Array, caps: Array) -> Array:
    """Gradient of the dual without the parts that point out of 0 <= l <= cap."""
    return np.where(((prices <= 0) & (h < 0)) | ((prices >= caps) & (h > 0)), 0.0, h)


def kkt_residual(model: SeparableModel, solution: SubproblemSolution, caps: Array | None = None) -> float:
    """Largest scaled violation of the optimality conditions of the subproblem.

    Stationarity by coordinate (projected on the box, times the box width, over the objective's reach),
    feasibility and complementarity over the reach of each constraint. caps (m,): the prices of the elastic
    variables; a constraint at its cap may be missed.
    """
    values, gradients = model.at(solution.x)
    weights = np.r_[1.0, solution.multipliers]
    total = weights @ gradients
    width = model.upper - model.lower
    size = np.maximum(np.abs(gradients), np.abs(model.gradients))  # at the solution they may all vanish
    scale = float((weights @ size) @ width) + 1e-300
    on_lower, on_upper = solution.x <= model.lower, solution.x >= model.upper
    off = np.where(on_lower, np.minimum(total, 0), np.where(on_upper, np.maximum(total, 0), total))
    reach = np.maximum(size[1:] @ width, 1e-300)
    short = values[1:]
    if caps is not None:
        short = np.where(solution.multipliers >= caps, np.minimum(short, 0.0), short)
    violation = np.maximum(short, 0) / reach
    products = solution.multipliers * np.abs(short) / scale
    return float(max((np.abs(off) * width).max() / scale, violation.max(initial=0), products.max(initial=0)))
