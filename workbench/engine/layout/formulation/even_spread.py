"""The trivial layout that spends every budget: one share for all members, as large as each budget allows.

Shares rise together; where a budget is spent its members stay as they are and the others go on, until all
have stopped or are full (max-min fair filling, Bertsekas and Gallager, Data Networks, 1992, section 6.5.2).
Budgets over different members have each a share of their own, one budget has one for all its members, and a
member of two stops with the first that is spent.
"""

import numpy as np
from numpy.typing import NDArray

from .problem import LayoutProblem

__all__ = ["even_spread"]

Array = NDArray[np.float64]

_SPENT = 1e-12  # relative, of the rise that spends a budget: two that are spent at once stop together


def even_spread(problem: LayoutProblem) -> Array:
    """(members,): the lower bound and a share of the width of every member; all budgets are met.

    Members and law variables in no budget get the least share of the others, the whole width without any.

    >>> from workbench.engine.layout.formulation.problem import static_problem
    >>> ropes, springs = np.array([1.0, 1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0, 1.0])
    >>> problem = static_problem(lambda a: (0.0, 0 * a), start=np.zeros(4),
    ...                          budgets=[(ropes, 1.5), (springs, 0.5)])
    >>> even_spread(problem)
    array([0.75, 0.75, 0.25, 0.25])
    """
    width, bought = problem.upper - problem.lower, problem.costs > 0
    left, level = problem.limits - problem.costs @ problem.lower, 0.0
    budgeted = bought.any(axis=0) & (width > 0)
    share, rising = np.ones(problem.members), budgeted.copy()
    while rising.any():
        need = problem.costs @ np.where(rising, width, 0.0)
        until_spent = np.full(problem.budgets, np.inf)
        until_spent[need > 0] = np.maximum(left[need > 0], 0.0) / need[need > 0]
        rise = float(until_spent.min())
        if level + rise >= 1.0:
            break
        level, left = level + rise, left - rise * need
        stopped = rising & bought[until_spent <= rise * (1.0 + _SPENT)].any(axis=0)
        share[stopped], rising = level, rising & ~stopped
    share[~budgeted] = share[budgeted].min(initial=1.0)
    return problem.into_budgets(problem.lower + share * width)
