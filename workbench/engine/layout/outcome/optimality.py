"""How far a design is from a stationary point, and what a little more budget is worth.

    promise = max_j g_j - min over feasible x of max_j [ g_j + dg_j (x - alpha) ]  >= 0

the improvement that the linearised rows still promise anywhere in the feasible set. It is zero exactly at a
KKT point, has the unit of the objective whatever the scaling of the variables, and for convex rows it bounds
the distance to the optimum (the rows lie below the functions). Its linear programme (HiGHS) gives the shadow
prices of the budgets as multipliers.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import LayoutProblem
from .linear_programme import linear_programme

__all__ = ["Certificate", "certificate", "linear_promise"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Certificate:
    """kkt: promise over |value|    shadow_prices (budgets,)    row_weights (rows,), their sum is 1."""

    kkt: float
    shadow_prices: Array
    row_weights: Array
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
    n, r = problem.members, len(values)
    top = float(values.max())
    scale = max(float(np.abs(gradients).max()), 1e-300)
    # unknowns: the move of each density and the change of the bound, both in units of the largest row
    matrix = np.vstack([
        np.hstack([gradients / scale, -np.ones((r, 1))]),
        np.hstack([problem.costs, np.zeros((problem.budgets, 1))]),
        np.hstack([constraint_gradients.reshape(-1, n), np.zeros((len(constraints), 1))]),
    ])  # fmt: skip
    room = np.maximum(problem.limits - problem.costs @ density, 0.0)
    right = np.r_[(top - values) / scale, room, np.maximum(-constraints, 0.0)]
    bounds = np.column_stack([np.minimum(problem.lower - density, 0), np.maximum(problem.upper - density, 0)])
    solution = linear_programme(
        np.r_[np.zeros(n), 1.0], at_most=(matrix, right), bounds=[*bounds, (None, None)]
    )
    if solution is None:
        return Certificate(
            kkt=np.inf, shadow_prices=np.zeros(problem.budgets), row_weights=np.full(r, 1 / r), vertex=density
        )
    promise = max(0.0, -solution.value * scale)
    return Certificate(
        kkt=promise / max(abs(top), 1e-300),
        shadow_prices=solution.prices[r : r + problem.budgets] * scale,
        row_weights=solution.prices[:r],
        vertex=density + solution.x[:n],
    )


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
