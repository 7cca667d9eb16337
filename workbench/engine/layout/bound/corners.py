"""Starts that differ in what the response sees: corners of the feasible set along the modes of the rows.

Many random densities look alike to a rigid body (their sums agree); these corners do not.
"""

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation, LayoutProblem
from ..outcome.linear_programme import linear_programme
from .probing import spread

__all__ = ["corner_starts"]

Array = NDArray[np.float64]

_MODES = 4  # singular vectors that give starts, two signs each


def corner_starts(problem: LayoutProblem, evaluation: Evaluation) -> list[Array]:
    """Feasible densities that differ in what the response sees, from the modes of the rows' Jacobian."""
    values = np.atleast_2d(evaluation.values)
    stride = max(1, values.size // 40)
    rows = np.arange(stride - 1, values.size, stride)
    factors = evaluation.factors(rows)
    table = evaluation.gradients(rows) if factors is None else factors.reshape(-1, problem.members)
    if evaluation.limit_rows:
        table = np.vstack([table, evaluation.constraint_gradients])
    strength, modes = np.linalg.svd(table, full_matrices=False)[1:]
    even = spread(problem)
    starts = []
    for mode in modes[:_MODES][strength[:_MODES] > 1e-2 * max(strength[0], 1e-300)]:
        for sign in (1.0, -1.0):
            corner = linear_programme(
                sign * mode / np.abs(mode).max(),
                at_most=(problem.costs, problem.limits),
                bounds=np.column_stack([problem.lower, problem.upper]),
            )
            if corner is not None:
                starts.append(problem.into_budgets(0.5 * (even + corner.x)))
    return starts
