"""How far a design is from a stationary point, and what a little more budget is worth.

    promise = max_j g_j - min over feasible x of max_j [ g_j + dg_j (x - alpha) ]  >= 0

the improvement that the linearised rows still promise anywhere in the feasible set. It is zero exactly at a
KKT point, has the unit of the objective whatever the scaling of the variables, and for convex rows it bounds
the distance to the optimum (the rows lie below the functions). Its linear programme (HiGHS; by sorting where
there is one row, which a hundred thousand members take no longer than a look) gives the shadow prices of the
budgets as multipliers, and what is reported as first-order error is the bound that follows from
these multipliers alone, term by term: the tolerance of the linear programme cannot make it look smaller.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import LayoutProblem
from .knapsack import continuous_knapsack
from .linear_programme import linear_programme

__all__ = ["Certificate", "certificate", "linear_promise"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """kkt: promise over |value|    shadow_prices (budgets,)    row_weights (rows,), their sum is 1
    constraint_prices (c,).
    """

    kkt: float
    shadow_prices: Array
    row_weights: Array
    constraint_prices: Array
    vertex: Array


def certificate(
    problem: LayoutProblem,
    density: Array,
    values: Array,
    gradients: Array,
    constraints: Array,
    constraint_gradients: Array,
) -> Certificate:
    """The linear programme of the linearised rows and constraints at a design.

    values (r,) and gradients (r, members) of the rows that may become the largest.
    """
    n, r, m = problem.members, len(values), problem.budgets
    top = float(values.max())
    if r == 1 and not len(constraints) and _parts_budgets(problem):
        return _by_sorting(problem, density, top, gradients[0])
    width = np.where(problem.free, problem.upper - problem.lower, 1.0)
    scale = max(float(np.abs(gradients * width).max()), 1e-300)
    slopes = np.vstack([problem.costs, constraint_gradients.reshape(-1, n)])
    size = np.maximum(np.abs(slopes * width).max(axis=1), 1e-300)
    # unknowns: the move of each density over its width, the change of the bound in units of the largest row
    matrix = np.vstack([
        np.hstack([gradients * width / scale, -np.ones((r, 1))]),
        np.hstack([slopes * width / size[:, None], np.zeros((len(size), 1))]),
    ])  # fmt: skip
    room = np.maximum(np.r_[problem.limits - problem.costs @ density, -constraints], 0.0)
    right = np.r_[(top - values) / scale, room / size]
    low, high = np.minimum(problem.lower - density, 0), np.maximum(problem.upper - density, 0)
    bounds = np.column_stack([np.r_[low / width, -np.inf], np.r_[high / width, np.inf]])
    solution = linear_programme(
        np.r_[np.zeros(n), 1.0], at_most=(matrix, right), bounds=bounds, near=np.zeros(n + 1)
    )
    if solution is None:
        return Certificate(
            kkt=np.inf, shadow_prices=np.zeros(m), row_weights=np.full(r, 1 / r),
            constraint_prices=np.zeros(len(constraints)), vertex=density,
        )  # fmt: skip
    weights = np.maximum(solution.prices[:r], 0.0)
    total = float(weights.sum())
    weights = weights / total if total > 0 else np.full(r, 1 / r)
    prices = np.maximum(solution.prices[r:], 0.0) * scale / size
    promise = linear_promise(
        problem, density, weights @ gradients + prices[m:] @ slopes[m:], prices[:m],
        top - float(weights @ values) + float(prices[m:] @ room[m:]),
    )  # fmt: skip
    return Certificate(
        kkt=max(0.0, promise) / max(abs(top), 1e-300),
        shadow_prices=prices[:m],
        row_weights=weights,
        constraint_prices=prices[m:],
        vertex=density + width * solution.x[:n],
    )


def _parts_budgets(problem: LayoutProblem) -> bool:
    """Whether every member stands in one budget at most, at no negative cost."""
    return bool((problem.costs >= 0.0).all() and ((problem.costs > 0.0).sum(axis=0) <= 1).all())


def _by_sorting(problem: LayoutProblem, density: Array, value: float, gradient: Array) -> Certificate:
    """The linear programme of one row, budget by budget."""
    low, high = np.minimum(problem.lower - density, 0.0), np.maximum(problem.upper - density, 0.0)
    move = np.where(gradient < 0.0, high, np.where(gradient > 0.0, low, 0.0))
    prices = np.zeros(problem.budgets)
    for j, cost in enumerate(problem.costs):
        inside = cost > 0.0
        room = max(float(problem.limits[j] - cost @ density), 0.0)
        found = continuous_knapsack(gradient[inside], cost[inside], room, low[inside], high[inside])
        assert found is not None  # staying is allowed
        move[inside], prices[j] = found
    promise = linear_promise(problem, density, gradient, prices)
    return Certificate(
        kkt=max(0.0, promise) / max(abs(value), 1e-300), shadow_prices=prices, row_weights=np.ones(1),
        constraint_prices=np.zeros(0), vertex=density + move,
    )  # fmt: skip


def linear_promise(
    problem: LayoutProblem, density: Array, gradient: Array, prices: Array, slack: float = 0.0
) -> float:
    """An upper bound of the promise from given multipliers, without a linear programme.

    gradient: weighted sum of the rows    prices: of the budgets    slack: value minus the weighted values
    """
    reduced = gradient + prices @ problem.costs
    moves = np.minimum(reduced * (problem.lower - density), reduced * (problem.upper - density)).sum()
    unused = prices @ np.maximum(problem.limits - problem.costs @ density, 0.0)
    return float(slack - moves + unused)
