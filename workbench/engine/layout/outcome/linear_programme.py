"""Linear programmes by HiGHS, with a small typed answer; many variables under few rows are sifted."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from .sifting import sifted

__all__ = ["LinearSolution", "linear_programme"]

Array = NDArray[np.float64]

_MANY, _FEW = 10_000, 30  # variables from which, and rows up to which, a programme is sifted


@dataclass(frozen=True, slots=True, kw_only=True)
class LinearSolution:
    """x (n,), value, prices (inequalities,) >= 0: what one unit of each right-hand side would gain."""

    x: Array
    value: float
    prices: Array


def linear_programme(
    cost: Array,
    *,
    bounds: Any,
    at_most: tuple[Array, Array] | None = None,
    equal: tuple[Array, Array] | None = None,
    vertex: bool = False,
    near: Array | None = None,
) -> LinearSolution | None:
    """Minimise cost' x with A x <= b (`at_most`) and A x = b (`equal`) in the box; None when there is no x.

    bounds: (n, 2), infinite or None where there is none.    vertex: use the dual simplex, which ends at a
    vertex.    near (n,): an x that meets the rows and may be nearly the optimum; of many variables it is then
    found to 1e-7 of the terms that the cost is the sum of.

    >>> import numpy as np
    >>> one = linear_programme(np.array([-1.0, -2.0]), bounds=[(0, 1)] * 2,
    ...                        at_most=(np.ones((1, 2)), np.array([1.5])))
    >>> one.x, one.prices
    (array([0.5, 1. ]), array([1.]))
    """
    n = len(cost)
    rows, right = at_most if at_most is not None else (np.zeros((0, n)), np.zeros(0))
    same, value = equal if equal is not None else (np.zeros((0, n)), np.zeros(0))
    count, box = len(right), np.array(bounds, dtype=float).reshape(n, 2)
    lower = np.where(np.isnan(box[:, 0]), -np.inf, box[:, 0])
    upper = np.where(np.isnan(box[:, 1]), np.inf, box[:, 1])

    def solve(
        cost: Array, table: Array, right: Array, lower: Array, upper: Array
    ) -> tuple[Array, Array] | None:
        solver: Any = linprog
        found = solver(
            cost,
            A_ub=table[:count] if count else None,
            b_ub=right[:count] if count else None,
            A_eq=table[count:] if len(right) > count else None,
            b_eq=right[count:] if len(right) > count else None,
            bounds=np.column_stack([lower, upper]),
            method="highs-ds" if vertex else "highs",
        )
        if found.x is None:
            return None
        marginals = [
            np.asarray(part.marginals, dtype=float)
            for part, there in ((found.ineqlin, count), (found.eqlin, len(right) - count))
            if there
        ]
        return np.asarray(found.x, dtype=float), -np.concatenate([np.zeros(0), *marginals])

    problem = cost, np.vstack([rows, same]), np.r_[right, value], lower, upper
    answer = None
    if n >= _MANY and len(problem[2]) <= _FEW:
        answer = sifted(*problem, solve, near)
    if answer is None:
        answer = solve(*problem)
    if answer is None:
        return None
    x, prices = answer
    return LinearSolution(x=x, value=float(cost @ x), prices=prices[:count] + 0.0)
