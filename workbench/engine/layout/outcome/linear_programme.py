"""Linear programmes by HiGHS, with a small typed answer."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

__all__ = ["LinearSolution", "linear_programme"]

Array = NDArray[np.float64]


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
) -> LinearSolution | None:
    """Minimise cost' x with A x <= b (`at_most`) and A x = b (`equal`) in the box; None when there is no x.

    bounds: (n, 2) or pairs with None.    vertex: use the dual simplex, which ends at a vertex.

    >>> import numpy as np
    >>> one = linear_programme(np.array([-1.0, -2.0]), bounds=[(0, 1)] * 2,
    ...                        at_most=(np.ones((1, 2)), np.array([1.5])))
    >>> one.x, one.prices
    (array([0.5, 1. ]), array([1.]))
    """
    A_ub, b_ub = at_most if at_most is not None and len(at_most[1]) else (None, None)
    A_eq, b_eq = equal if equal is not None and len(equal[1]) else (None, None)
    solver: Any = linprog
    found = solver(
        cost,
        A_ub=A_ub,
        b_ub=b_ub,
        A_eq=A_eq,
        b_eq=b_eq,
        bounds=bounds,
        method="highs-ds" if vertex else "highs",
    )
    if found.x is None:
        return None
    prices = -np.asarray(found.ineqlin.marginals, dtype=float) if A_ub is not None else np.zeros(0)
    return LinearSolution(x=np.asarray(found.x, dtype=float), value=float(found.fun), prices=prices + 0.0)
