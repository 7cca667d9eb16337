"""From many fractional members to a handful, without a threshold.

Between rigid bodies the response sees the densities, to first order in the motion, only through the sums

    sum_i alpha_i k_i b_i b_i^T      over the members of each pair of bodies

b_i the unit force and moment of member i: 6 different numbers in the plane, 21 in space. A vertex of the
polytope {same sums, same use of every budget, lower <= alpha <= upper} has at most that many densities off
their bounds, one per equality row (Caratheodory). The vertex that a linear programme finds in the direction
of the gradient is simulated again: a drawing of all members above a threshold is another design, which
breaks its budget.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..formulation.law_variables import variables_held
from ..formulation.problem import InvalidLayout, LayoutProblem, MemberGeometry
from .linear_programme import linear_programme

__all__ = ["PurifiedLayout", "fractional_members", "purify", "rigid_body_sums"]

Array = NDArray[np.float64]

_FRACTIONAL = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class PurifiedLayout:
    """density (members,)    value: simulated again    before: value of the given density
    fractional, fractional_before: members off their bounds    excess: of the budgets    rows: equality rows
    kept accepted: False when the value got worse by more than the tolerance, or the vertex cannot be run;
    density is then the given one.
    """

    density: Array
    value: float
    before: float
    fractional: int
    fractional_before: int
    excess: float
    rows: int
    accepted: bool

    @property
    def loss(self) -> float:
        """Relative change of the value, positive when it got worse."""
        return (self.value - self.before) / abs(self.before)


def fractional_members(problem: LayoutProblem, density: Array) -> int:
    """Members whose density is more than 0.001 of the width away from both bounds."""
    free = problem.free
    free[problem.densities :] = False
    share = (density - problem.lower)[free] / (problem.upper - problem.lower)[free]
    return int(((share > _FRACTIONAL) & (share < 1 - _FRACTIONAL)).sum())


def rigid_body_sums(geometry: MemberGeometry) -> Array:
    """(rows, members): coefficients of the densities in the stiffness sums of every pair of bodies."""
    a, b = np.asarray(geometry.point_a, dtype=float), np.asarray(geometry.point_b, dtype=float)
    axis = b - a
    length = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = axis / np.where(length > 0, length, 1.0)
    centre = 0.5 * (a.mean(axis=0) + b.mean(axis=0))
    arm = a - centre
    if a.shape[1] == 2:
        moment = (arm[:, 0] * axis[:, 1] - arm[:, 1] * axis[:, 0])[:, None]
    else:
        moment = np.cross(arm, axis)
    B = np.hstack([axis, moment / max(float(np.abs(moment).max()), 1e-300)])
    i, j = np.triu_indices(B.shape[1])
    k = np.ones(len(a)) if geometry.stiffness is None else np.asarray(geometry.stiffness, dtype=float)
    products = (B[:, i] * B[:, j] * (k / k.max())[:, None]).T
    pairs = np.column_stack([geometry.body_a, geometry.body_b])
    rows = [products * (pairs == pair).all(axis=1) for pair in np.unique(pairs, axis=0)]
    table = np.vstack(rows)
    return np.asarray(table[np.abs(table).max(axis=1) > 1e-12])


def purify(
    problem: LayoutProblem, density: Array, *, sums: Array | None = None, tolerance: float = 1e-3
) -> PurifiedLayout:
    """Move a density to a vertex with the same rigid-body sums and budgets, and simulate it.

    sums: (rows, members) equality rows; by default those of the problem's geometry.
    Raises InvalidLayout when neither sums nor a geometry are given.
    """
    if sums is None:
        if problem.geometry is None:
            raise InvalidLayout(
                "purification needs the sums to keep: give `sums`, or a problem with a geometry"
            )
        sums = rigid_body_sums(problem.geometry)
    problem = variables_held(problem, density)
    sums = np.hstack([sums, np.zeros((len(sums), problem.members - sums.shape[1]))])
    evaluation = problem.checked(density)
    values = np.atleast_2d(evaluation.values)
    before = float(values.max())
    gradient = problem.checked_gradients(evaluation, np.array([int(values.argmax())]))[0]
    spent = (problem.costs > 0).any(axis=1)
    table = np.vstack([sums, problem.costs[spent]])
    solved = linear_programme(
        gradient / max(float(np.abs(gradient).max()), 1e-300),
        equal=(table, table @ density),
        bounds=np.column_stack([problem.lower, problem.upper]),
        vertex=True,
    )
    fractional_before = fractional_members(problem, density)
    vertex = density if solved is None else problem.into_budgets(solved.x)
    again = None if solved is None else problem.tried(vertex)
    value = before if again is None else float(np.max(again.values))
    accepted = again is not None and value <= before + tolerance * abs(before)
    kept = vertex if accepted else density
    return PurifiedLayout(
        density=kept,
        value=value if accepted else before,
        before=before,
        fractional=fractional_members(problem, kept),
        fractional_before=fractional_before,
        excess=problem.excess(kept),
        rows=len(table),
        accepted=accepted,
    )
