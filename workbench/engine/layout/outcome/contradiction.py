"""Proof that no design meets the constraints: a Farkas vector of their linearisations.

For convex constraints each linearisation c_k + dc_k (x - x_k) lies below its constraint, so that

    sum_k y_k [ c_k + dc_k (x - x_k) ] + p' (A x - h) > 0    for all x within the bounds,    y, p >= 0

rules every design out. A linear programme proposes y and p; what is believed is the smallest value of the sum
within the bounds, computed from them term by term. Constraints that nobody promised to be convex count as
linear when three evaluations or more had the same gradients to the last bit; otherwise nothing is proved.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import LayoutProblem
from .history import Cut
from .linear_programme import linear_programme
from .result import Contradiction

__all__ = ["contradiction", "look_linear"]

Array = NDArray[np.float64]

_ROUNDING = 1e-9  # of the terms that the sum consists of
_LOOKS = 3  # evaluations with equal gradients that make a constraint linear


def look_linear(cuts: Sequence[Cut]) -> bool:
    """True when all of several evaluations at different designs had the same gradients.

    >>> import numpy as np
    >>> c, dc = np.zeros(1), np.ones((1, 2))
    >>> one = [Cut(density=np.full(2, x), constraints=c, gradients=dc) for x in range(3)]
    >>> look_linear(one), look_linear(one[:2])
    (True, False)
    """
    designs = {cut.density.tobytes() for cut in cuts}
    return len(designs) >= _LOOKS and all(np.array_equal(c.gradients, cuts[0].gradients) for c in cuts)


def contradiction(problem: LayoutProblem, cuts: Sequence[Cut]) -> Contradiction | None:
    """The certificate, or None where the linearisations do not contradict each other or prove nothing."""
    if not cuts or not (problem.convex_constraints or look_linear(cuts)):
        return None
    n, width = problem.members, np.where(problem.free, problem.upper - problem.lower, 1.0)
    slopes = np.vstack([cut.gradients for cut in cuts])
    at_lower = np.concatenate([c.constraints + c.gradients @ (problem.lower - c.density) for c in cuts])
    size = np.maximum(np.abs(slopes) @ width, 1e-300)
    spent = np.maximum(problem.costs @ width, 1e-300)
    # least s with  (c + dc (x - x_k))/size <= s  under the budgets; positive where they contradict
    rows = np.vstack([
        np.hstack([slopes * width / size[:, None], -np.ones((len(size), 1))]),
        np.hstack([problem.costs * width / spent[:, None], np.zeros((problem.budgets, 1))]),
    ])  # fmt: skip
    room = (problem.limits - problem.costs @ problem.lower) / spent
    solved = linear_programme(
        np.r_[np.zeros(n), 1.0],
        at_most=(rows, np.r_[-at_lower / size, room]),
        bounds=[*((0.0, float(free)) for free in problem.free), (None, None)],
    )
    if solved is None:
        return None
    y, p = (
        np.maximum(solved.prices[: len(size)], 0.0) / size,
        np.maximum(solved.prices[len(size) :], 0) / spent,
    )
    if y.sum() <= 0:
        return None
    p, y = p / y.sum(), y / y.sum()
    reduced = (y @ slopes + p @ problem.costs) * (problem.upper - problem.lower)
    parts = np.concatenate([
        y * at_lower, p * (problem.costs @ problem.lower - problem.limits), np.minimum(reduced, 0.0)
    ])  # fmt: skip
    least = float(parts.sum())
    if least <= _ROUNDING * float(np.abs(parts).sum()):
        return None
    kept = np.flatnonzero(y > 0)
    count = len(cuts[0].constraints)
    return Contradiction(
        weights=y[kept], constraints=kept % count, budgets=p, least=least,
        designs=np.array([cuts[int(k) // count].density for k in kept]),
    )  # fmt: skip
