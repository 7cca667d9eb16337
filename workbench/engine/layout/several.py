"""Several objectives: anchors, pay-off table, weighted exponential sum and evenly spaced fronts.

Every objective is a `LayoutProblem` over the same members and budgets. Anchors minimise one each; their
values in all objectives are the pay-off table with the utopia point G° (its diagonal) and the estimate G^max
(its column maxima). (7.16) asks for the maximum over the whole feasible set, which nobody solves; the table
stands in.

Ways through the middle of a front: `formulation.combined`.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from .formulation.combined import (
    boundary_problem,
    check_objectives,
    normal_constraint_problem,
    weighted_problem,
)
from .formulation.problem import InvalidLayout, LayoutProblem
from .optimise import optimise_layout
from .pareto import hypervolume, knee_point, pareto_filter

__all__ = ["Front", "front", "simplex_points"]

Array = NDArray[np.float64]

_EXTREME = 100.0  # times its own optimum: an anchor that ruins another objective says nothing about its range
_CARE = 1e-3  # weight of the other objectives, in units of their optima, at such an anchor


@dataclass(frozen=True, slots=True, kw_only=True)
class Front:
    """values (points, objectives)    densities (points, members)    weights: the X or w of each point
    pay_off (objectives, objectives): row i holds the values of anchor i    utopia, nadir (objectives,)
    kept (points,): not dominated    knee: index    covered: hypervolume up to the nadir over that of the box
    evaluations: of all objectives together.
    """

    values: Array
    densities: Array
    weights: Array
    pay_off: Array
    utopia: Array
    nadir: Array
    kept: NDArray[np.bool_]
    knee: int
    covered: float
    evaluations: int

    @property
    def spacing(self) -> Array:
        """Distances of neighbours along a front of two objectives, ranges scaled to 1, over their mean."""
        v = (self.values[self.kept] - self.utopia) / (self.nadir - self.utopia)
        v = v[np.argsort(v[:, 0])]
        steps = np.linalg.norm(np.diff(v, axis=0), axis=1)
        if len(steps) == 0:
            return steps
        return np.asarray(steps / steps.mean())


def simplex_points(objectives: int, points: int) -> Array:
    """At least `points` evenly spaced points of the simplex (Das and Dennis), the anchors first.

    >>> simplex_points(2, 3)
    array([[1. , 0. ],
           [0. , 1. ],
           [0.5, 0.5]])
    """
    steps = 1
    while _count(steps, objectives) < points:
        steps += 1
    grid = np.array([
        p for p in itertools.product(range(steps + 1), repeat=objectives) if sum(p) == steps
    ], dtype=float) / steps  # fmt: skip
    corner = grid.max(axis=1) == 1
    return np.vstack([np.eye(objectives), grid[~corner]])


def _count(steps: int, objectives: int) -> int:
    count = 1
    for k in range(1, objectives):
        count = count * (steps + k) // k
    return count


def front(
    objectives: Sequence[LayoutProblem],
    *,
    points: int = 15,
    method: Literal["boundary", "normal_constraint", "weighted"] = "boundary",
    power: float = 1.0,
    max_evaluations: int = 25,
    tolerance: float = 1e-5,
    progress: Callable[[int, Array], None] | None = None,
) -> Front:
    """A front of layouts, each point warm-started from its nearest finished neighbour.

    points: anchors included.
    max_evaluations: per point.
    progress: called with the index and the values.

    Raises InvalidLayout when the objectives do not share members and budgets, or do not conflict.
    """
    check_objectives(objectives)
    if method not in ("boundary", "normal_constraint", "weighted"):
        raise InvalidLayout(
            f"method needs to be 'boundary', 'normal_constraint' or 'weighted', got '{method}'"
        )
    k = len(objectives)
    if points < k + 1:
        raise InvalidLayout(f"a front of {k} objectives needs at least {k + 1} points, got {points}")
    used, densities = 0, []
    for problem in objectives:
        result = optimise_layout(problem, max_evaluations=2 * max_evaluations, tolerance=tolerance, probes=0)
        used += result.evaluations
        densities.append(result.density)
    pay_off = np.array([_values(objectives, a) for a in densities])
    used += k * k
    for i in range(k):
        if (pay_off[i] > _EXTREME * np.diag(pay_off)).any():
            densities[i], spent = _temperate(objectives, i, np.diag(pay_off), max_evaluations, tolerance)
            used += k * spent
            pay_off[i, np.arange(k) != i] = _values(objectives, densities[i])[np.arange(k) != i]
    utopia, nadir = np.diag(pay_off).copy(), pay_off.max(axis=0)
    span = nadir - utopia
    if (span <= 1e-9 * np.abs(utopia)).any():
        raise InvalidLayout("the objectives do not conflict: one layout is best for all of them")
    weights = simplex_points(k, points)
    values = [_values(objectives, a) for a in densities]
    for index in range(k, len(weights)):
        near = int(np.argmin(np.abs(weights[: len(densities)] - weights[index]).sum(axis=1)))
        if method == "boundary":
            # X on the simplex of the anchors: objective i has the value 1 - X_i there
            target = boundary_problem(objectives, utopia + (1 - weights[index]) * span, span)
        elif method == "normal_constraint":
            target = normal_constraint_problem(objectives, pay_off, weights[index])
        else:
            target = weighted_problem(objectives, weights[index], power=power, utopia=utopia, nadir=nadir)
        result = optimise_layout(
            replace(target, start=densities[near]), max_evaluations=max_evaluations, tolerance=tolerance,
            multi_start=False,
        )  # fmt: skip
        densities.append(result.density)
        values.append(_values(objectives, result.density))
        used += k * (result.evaluations + 1)
        if progress is not None:
            progress(index, values[-1])
    table = np.array(values)
    kept = pareto_filter(table)
    where = np.flatnonzero(kept)
    return Front(
        values=table,
        densities=np.array(densities),
        weights=weights,
        pay_off=pay_off,
        utopia=utopia,
        nadir=nadir,
        kept=kept,
        knee=int(where[knee_point(table[kept])]),
        covered=hypervolume(table, nadir) / float(np.prod(span)),
        evaluations=used,
    )


def _temperate(
    objectives: Sequence[LayoutProblem], i: int, best: Array, max_evaluations: int, tolerance: float
) -> tuple[Array, int]:
    """Anchor i with a little care for the others: alone it may leave no member that they need."""
    weights = np.full(len(objectives), _CARE)
    weights[i] = 1.0
    target = weighted_problem(objectives, weights, power=1.0, utopia=np.zeros(len(best)), nadir=best)
    result = optimise_layout(
        target, max_evaluations=2 * max_evaluations, tolerance=tolerance, multi_start=False
    )
    return result.density, result.evaluations


def _values(objectives: Sequence[LayoutProblem], density: Array) -> Array:
    return np.array([float(np.max(problem.checked(density).values)) for problem in objectives])
