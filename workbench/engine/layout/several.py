"""Several objectives: anchors, pay-off table, weighted exponential sum and evenly spaced fronts.

Every objective is a `LayoutProblem` over the same members and budgets. Anchors minimise one each; their
values in all objectives are the pay-off table with the utopia point G° (its diagonal) and the estimate G^max
(its column maxima). (7.16) asks for the maximum over the whole feasible set, which nobody solves; the table
stands in.

    weighted    U = sum_i w_i [ (G_i - G_i°)/(G_i^max - G_i°) ]^p      (7.15) with (7.16) inside the power
    boundary    min t  subject to  (G_i - G_i°)/(G_i^max - G_i°) <= X_i + t       X on the simplex
                of the anchors
    normal      min G_k  subject to  (G^k - G^i).(G - X) <= 0 for every other anchor i, all normalised

The second is normal boundary intersection (Das and Dennis 1998) with inequalities: a min-max over rows, so
the peaks of all objectives enter with their neighbours, and non-convex parts of a front are reached. The
third is the normalised normal constraint (Messac, Ismail-Yahaya and Mattson 2003), whose planes stand on the
anchors' plane; each objective enters with its largest row. For two objectives both cut the same front.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from .formulation.problem import (
    Evaluation,
    InvalidLayout,
    LayoutProblem,
    TabulatedRows,
)
from .optimise import optimise_layout
from .pareto import hypervolume, knee_point, pareto_filter

__all__ = [
    "Front", "boundary_problem", "front", "normal_constraint_problem", "simplex_points", "weighted_problem",
]  # fmt: skip

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stacked:
    """Rows of several evaluations, shifted and scaled: (g - shift)/scale."""

    parts: tuple[Evaluation, ...]
    shift: Array
    scale: Array
    values: Array
    constraints: Array
    constraint_gradients: Array

    def _each(self, rows: Rows) -> list[tuple[int, Rows, Rows]]:
        nodes = self.values.shape[1]
        found, first = [], 0
        scenario = rows // nodes
        for i, part in enumerate(self.parts):
            count, own = np.atleast_2d(part.values).shape
            where = np.flatnonzero((scenario >= first) & (scenario < first + count))
            node = np.minimum(rows[where] % nodes, own - 1)  # padded nodes repeat the last one
            found.append((i, where, (scenario[where] - first) * own + node))
            first += count
        return found

    def gradients(self, rows: Rows) -> Array:
        table: list[Array | None] = [None] * len(rows)
        for i, where, own in self._each(rows):
            if len(own):
                for at, g in zip(where, self.parts[i].gradients(own) / self.scale[i], strict=True):
                    table[at] = g
        return np.array(table)

    def factors(self, rows: Rows) -> Array | None:
        table: list[Array | None] = [None] * len(rows)
        for i, where, own in self._each(rows):
            found = self.parts[i].factors(own)
            if found is None:
                return None
            for at, w in zip(where, found / np.sqrt(self.scale[i]), strict=True):
                table[at] = w
        if not table:
            return np.zeros((0, 1, 0))
        rank = max(len(w) for w in table if w is not None)
        return np.array([np.pad(w, ((0, rank - len(w)), (0, 0))) for w in table if w is not None])

    def model(self, step: Array) -> Array | None:
        models = [part.model(step) for part in self.parts]
        if any(m is None for m in models):
            return None
        return _stack([np.atleast_2d(m) for m in models if m is not None], self.shift, self.scale)


def _stack(tables: Sequence[Array], shift: Array, scale: Array) -> Array:
    nodes = max(t.shape[1] for t in tables)
    return np.vstack([
        np.pad((t - a) / b, ((0, 0), (0, nodes - t.shape[1])), mode="edge")
        for t, a, b in zip(tables, shift, scale, strict=True)
    ])  # fmt: skip


def boundary_problem(objectives: Sequence[LayoutProblem], shift: Array, scale: Array) -> LayoutProblem:
    """Minimise max over objectives of (G_i - shift_i)/scale_i."""
    _check(objectives)

    def evaluate(density: Array) -> Evaluation:
        parts = tuple(problem.evaluate(density) for problem in objectives)
        n = objectives[0].members
        return _Stacked(
            parts=parts,
            shift=shift,
            scale=scale,
            values=_stack([np.atleast_2d(p.values) for p in parts], shift, scale),
            constraints=np.concatenate([p.constraints for p in parts]),
            constraint_gradients=np.vstack([p.constraint_gradients.reshape(-1, n) for p in parts]),
        )

    return replace(objectives[0], evaluate=evaluate, convex=all(p.convex for p in objectives))


def normal_constraint_problem(
    objectives: Sequence[LayoutProblem], pay_off: Array, weights: Array
) -> LayoutProblem:
    """Minimise the last objective behind planes that stand on the anchors' plane at X = weights' pay-off.

    pay_off: (k, k) row i holds the values of anchor i    weights: (k,) on the simplex
    Values are normalised by the pay-off table, so that its diagonal is 0 and its column maxima are 1.
    """
    _check(objectives)
    utopia = np.diag(pay_off).copy()
    span = np.maximum(pay_off.max(axis=0) - utopia, 1e-300)
    anchors = (pay_off - utopia) / span
    on_plane = weights @ anchors
    normals = anchors[-1] - anchors[:-1]
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)

    def evaluate(density: Array) -> Evaluation:
        values, slopes = [], []
        for problem, low, width in zip(objectives, utopia, span, strict=True):
            part = problem.evaluate(density)
            row = np.array([int(np.argmax(part.values))])
            values.append((float(np.ravel(part.values)[row[0]]) - low) / width)
            slopes.append(part.gradients(row)[0] / width)
        table = np.array(slopes)
        return TabulatedRows(
            values=np.array([[values[-1]]]),
            gradient_table=table[-1:],
            constraints=normals @ (np.array(values) - on_plane),
            constraint_gradients=normals @ table,
        )

    return replace(objectives[0], evaluate=evaluate, convex=False, times=None)


def weighted_problem(
    objectives: Sequence[LayoutProblem], weights: Any, *, power: float, utopia: Array, nadir: Array
) -> LayoutProblem:
    """The weighted exponential sum (7.15) of the normalised objectives (7.16): one row.

    The normalisation stands inside the power. An objective below the utopia point counts as there.
    Raises InvalidLayout for weights that are not positive or a power below 1.
    """
    _check(objectives)
    w = np.asarray(weights, dtype=float)
    if w.shape != (len(objectives),) or (w <= 0).any():
        raise InvalidLayout(f"weights need a positive number for each of the {len(objectives)} objectives")
    if power < 1:
        raise InvalidLayout(f"power needs to be >= 1, got {power}")
    span = np.maximum(nadir - utopia, 1e-300)

    def evaluate(density: Array) -> Evaluation:
        total, gradient, bends = 0.0, np.zeros(len(density)), []
        for problem, share, low, width in zip(objectives, w, utopia, span, strict=True):
            part = problem.evaluate(density)
            row = np.array([int(np.argmax(part.values))])
            g = max((float(np.ravel(part.values)[row[0]]) - low) / width, 1e-12)
            slope = part.gradients(row)[0] / width
            total += share * g**power
            gradient += share * power * g ** (power - 1) * slope
            inner = part.factors(row)
            bends.append(
                None if inner is None else np.sqrt(share * power * g ** (power - 1) / width) * inner[0]
            )
            if power > 1:
                bends.append(np.sqrt(share * power * (power - 1) * g ** (power - 2)) * slope[None])
        known = [b for b in bends if b is not None]
        return TabulatedRows(
            values=np.array([[total]]),
            gradient_table=gradient[None],
            factor_table=np.vstack(known)[None] if len(known) == len(bends) else None,
            constraint_gradients=np.zeros((0, len(density))),
        )

    one_row = all(np.size(p.evaluate(p.into_budgets(p.start)).values) == 1 for p in objectives)
    return replace(
        objectives[0], evaluate=evaluate, convex=one_row and all(p.convex for p in objectives), times=None
    )


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
    _check(objectives)
    if method not in ("boundary", "normal_constraint", "weighted"):
        raise InvalidLayout(
            f"method needs to be 'boundary', 'normal_constraint' or 'weighted', got '{method}'"
        )
    k = len(objectives)
    if points < k + 1:
        raise InvalidLayout(f"a front of {k} objectives needs at least {k + 1} points, got {points}")
    used, densities = 0, []
    for problem in objectives:
        result = optimise_layout(problem, max_evaluations=2 * max_evaluations, tolerance=tolerance)
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


def _check(objectives: Sequence[LayoutProblem]) -> None:
    if len(objectives) < 2:
        raise InvalidLayout(f"several objectives need at least 2, got {len(objectives)}")
    first = objectives[0]
    for number, other in enumerate(objectives[1:], start=1):
        for name in ("lower", "upper", "costs", "limits"):
            if not np.array_equal(getattr(first, name), getattr(other, name)):
                raise InvalidLayout(
                    f"objective {number} has other {name} than objective 0; they need to agree"
                )
