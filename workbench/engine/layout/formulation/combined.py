"""Several objectives as one layout problem: a min-max, the normal constraints, a weighted sum.

    weighted    U = sum_i w_i [ (G_i - G_i°)/(G_i^max - G_i°) ]^p      (7.15) with (7.16) inside the power
    boundary    min t  subject to  (G_i - G_i°)/(G_i^max - G_i°) <= X_i + t       X on the simplex
                of the anchors
    normal      min G_k  subject to  (G^k - G^i).(G - X) <= 0 for every other anchor i, all normalised

The second is normal boundary intersection (Das and Dennis 1998) with inequalities: a min-max over rows, so
the peaks of all objectives enter with their neighbours, and non-convex parts of a front are reached. The
third is the normalised normal constraint (Messac, Ismail-Yahaya and Mattson 2003), whose planes stand on the
anchors' plane; each objective enters with its largest row. For two objectives both cut the same front.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .problem import Evaluation, InvalidLayout, LayoutProblem, LimitRow, TabulatedRows

__all__ = ["boundary_problem", "check_objectives", "normal_constraint_problem", "weighted_problem"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stacked:
    """Rows of several evaluations, shifted and scaled: (g - shift)/scale."""

    parts: tuple[Evaluation, ...]
    shift: Array
    scale: Array
    values: Array
    constraints: Array
    constraint_gradients: Array
    limit_rows: tuple[LimitRow, ...] = ()

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
    check_objectives(objectives)

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
            limit_rows=tuple(row for p in parts for row in p.limit_rows),
        )

    return replace(objectives[0], evaluate=evaluate, convex=all(p.convex for p in objectives))


def normal_constraint_problem(
    objectives: Sequence[LayoutProblem], pay_off: Array, weights: Array
) -> LayoutProblem:
    """Minimise the last objective behind planes that stand on the anchors' plane at X = weights' pay-off.

    pay_off: (k, k) row i holds the values of anchor i    weights: (k,) on the simplex
    Values are normalised by the pay-off table, so that its diagonal is 0 and its column maxima are 1.
    """
    check_objectives(objectives)
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
    check_objectives(objectives)
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


def check_objectives(objectives: Sequence[LayoutProblem]) -> None:
    """Raise InvalidLayout unless there are two objectives at least, with the same members and budgets."""
    """Raise InvalidLayout unless there are two objectives at least, with the same members and budgets."""
    if len(objectives) < 2:
        raise InvalidLayout(f"several objectives need at least 2, got {len(objectives)}")
    first = objectives[0]
    for number, other in enumerate(objectives[1:], start=1):
        for name in ("lower", "upper", "costs", "limits"):
            if not np.array_equal(getattr(first, name), getattr(other, name)):
                raise InvalidLayout(
                    f"objective {number} has other {name} than objective 0; they need to agree"
                )
