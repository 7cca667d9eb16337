"""Compliances between two bounds, from their gradients alone.

For C(x) = f'u, K(x) u = f, K = sum x_i b_i b_i' with slopes -e_i^2, e = B u, the gradients seen so far give

    above   sum (x_i^k)^2 e_i^2 / x_i             complementary energy of the forces at the present design x^k
    below   c' (V' diag(x) V)^-1 c                 Galerkin's compliance in the span of past displacements

V (members, p) the elongations of that span, c_j = f'u_j. Both are convex, and both have the value and the
slopes of C at x^k; below is exact wherever a displacement was seen. Between them lies the model

    share * above + (1 - share) * below

with the share that recent moves had: (C - below)/(above - below). The signs of the elongations are those
that the model foretells, mended by `elongations.py`. The forces of one design work f'u on the displacement
of another, as Betti's theorem has it: displacements that miss it by more than a hundredth of above - C have
wrong signs, and are left out of the span. Unlike second-order models this one knows how a member's row grows
as the member vanishes, which decides how fast the end of a path is walked.

With all of the share above a step is one of descent, so that refusals come to an end. Sums and norms of
compliances fall and are homogeneous as well, but none of their designs fits the next by Betti's theorem.
By that they are told apart.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

from .barrier import ModelledRows
from .elongations import settled_signs

__all__ = ["ComplianceModel", "are_compliances"]

Array = NDArray[np.float64]

_EULER = 1e-5  # of the value: how far x'g may be from -C, which is homogeneous of degree -1
_RISING = 1e-9  # of the largest slope: a rising member of a compliance is rounding
_ABOVE = 1e-6  # of the value, by which a compliance may lie above its upper bound
_FIRST, _LEAST = 0.7, 1e-4  # share before any move, and at least
_RECENT, _MORE, _SLOWLY = 8, 1.2, 0.7  # moves that the share follows, its factor, and its fall in a step
_STIFFEN, _RELAX = 4.0, 0.5
_NOTHING = 1e-10  # of the value: bounds so near each other say nothing of the share
_FAR = 0.3  # share after which signs of before are not believed
_CROSSED, _KEPT = 0.01, 0.75  # share below zero by which signs are wrong, and what is kept of the table then
_DESIGNS, _NUMBERS, _FEWEST = 150, 2.5e6, 8  # in the table of a row, in those of all rows, and at least
_ALIKE = 1e-7  # part of a displacement that is new
_MOVES, _BETTI = 8, 5e-4  # so many in a row with such errors of work, of above - C: no compliance
_WORK = 1e-2  # error of work, of above - C, beyond which a displacement's signs are wrong
_ROUNDING = 1e-13  # of the value
_LIGHT = 1e-6  # of the largest weight: rows below it do not bend


def are_compliances(x: Array, values: Array, gradients: Array) -> bool:
    """Whether rows (r,) with gradients (r, members) may be compliances: falling, homogeneous of degree -1.

    >>> import numpy as np
    >>> x = np.array([1.0, 2.0])
    >>> [are_compliances(x, np.array([c]), -np.array([[1.0, 1.0]]) / x**2) for c in (1.5, 2.5)]  # sum 1/x
    [True, False]
    """
    if not (values > 0).all() or not (x >= 0).all():
        return False
    falling = gradients.max(axis=1) <= _RISING * np.abs(gradients).max(axis=1)
    return bool((falling & (np.abs(values + gradients @ x) <= _EULER * values)).all())


@dataclass(frozen=True, slots=True, kw_only=True)
class _Bounds:
    """At a design: two bounds, the lower one's elongations (members,), and W (p, members), its curvature."""

    above: float
    below: float
    elongation: Array
    factor: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class _Seen:
    """Of a row at a design x (members,): its value and elongations (members,)."""

    x: Array
    value: float
    elongation: Array


@dataclass(slots=True, kw_only=True)
class _Row:
    """table: what was seen, the present design last    seen: shares of recent moves
    works: errors of Betti's theorem at recent designs, of the one that fits best

    basis (members, p): elongations of displacements that are orthonormal in K(x^k), the first that of x^k
    forces_squared: (x^k e)^2
    """

    table: list[_Seen]
    share: float = _FIRST
    seen: list[float] = field(default_factory=list)
    works: list[float] = field(default_factory=list)
    value: float = 0.0
    basis: Array = field(default_factory=lambda: np.zeros((0, 0)))
    forces_squared: Array = field(default_factory=lambda: np.zeros(0))

    def place(self, x: Array, value: float, gradient: Array) -> None:
        table = settled_signs(np.array([entry.elongation for entry in self.table]))
        self.table = [replace(entry, elongation=e) for entry, e in zip(self.table, table, strict=True)]
        errors = _errors_of_work(self.table)
        if len(errors) > 1:
            self.works.append(float(errors[:-1].min()))
        scaled = (table[errors <= _WORK][::-1] * np.sqrt(x)).T
        size = np.linalg.norm(scaled, axis=0)
        directions, triangle = np.linalg.qr(scaled[:, size > 0] / size[size > 0])
        new = np.abs(triangle.diagonal()) > _ALIKE
        with np.errstate(divide="ignore", invalid="ignore"):
            basis = directions[:, new] * np.sign(triangle[0, 0]) / np.sqrt(x)[:, None]
        self.basis = np.where(x[:, None] > 0, basis, 0.0)
        self.value, self.forces_squared = value, x * x * np.maximum(-gradient, 0.0)

    def bounds(self, x: Array) -> _Bounds:
        L = np.linalg.cholesky((self.basis.T * x) @ self.basis)
        factor = scipy.linalg.solve_triangular(L, self.basis.T, lower=True, check_finite=False)
        first = scipy.linalg.solve_triangular(L, np.eye(len(L))[:, 0], lower=True, check_finite=False)
        elongation = np.sqrt(self.value) * (first @ factor)
        with np.errstate(divide="ignore", invalid="ignore"):
            above = float(np.where(x > 0, self.forces_squared / x, 0.0).sum())
        return _Bounds(
            above=above, below=self.value * float(first @ first), elongation=elongation,
            factor=np.sqrt(2.0) * elongation * factor,
        )  # fmt: skip

    def learn(self, bounds: _Bounds, seen: _Seen, *, taken: bool, most: int) -> bool:
        """Of a trial; False when the row is no compliance."""
        value = seen.value
        apart, room, share = bounds.above - bounds.below, bounds.above - value, 0.0
        if min(apart, room) > _NOTHING * value:
            share = (value - bounds.below) / apart
            self.seen = [*self.seen[1 - _RECENT :], share]
            self.share = float(np.clip(max(_MORE * max(self.seen), _SLOWLY * self.share), _LEAST, 1.0))
        if share < -_CROSSED:
            self.table = self.table[-max(3, int(_KEPT * len(self.table))) :]
        if share <= _FAR:
            self.table.insert(len(self.table) - (0 if taken else 1), seen)
        elif taken:
            self.table = [seen]
        del self.table[:-most]
        reciprocal = len(self.works) < _MOVES or min(self.works[-_MOVES:]) <= _BETTI
        return reciprocal and value <= bounds.above + _ABOVE * value


def _errors_of_work(table: list[_Seen]) -> Array:
    """Of the work of each design's forces on the last displacement, or the other way round, against that of
    the loads: in units of above - C, less rounding."""
    last = table[-1]
    E = np.array([entry.elongation for entry in table])
    X = np.array([entry.x for entry in table])
    values = np.array([entry.value for entry in table])
    forces, force = X * E, last.x * last.elongation
    with np.errstate(divide="ignore", invalid="ignore"):
        upon_last = np.where(last.x > 0, forces**2 / last.x, 0.0).sum(axis=1) - last.value
        upon_each = np.where(X > 0, force**2 / X, 0.0).sum(axis=1) - values
    rounding = _ROUNDING * values.max()
    errors = [
        np.maximum(np.abs(work) - rounding, 0.0) / np.maximum(apart, rounding)
        for work, apart in (
            (forces @ last.elongation - last.value, upon_last),
            (E @ force - values, upon_each),
        )
    ]
    return np.r_[np.maximum(*errors)[:-1], 0.0]


@dataclass(slots=True, kw_only=True)
class ComplianceModel:
    """Rows that are compliances, at the design where it was placed. free (members,): those that may change.

    stiff: factor of all shares, above 1 after refused steps.
    """

    free: NDArray[np.bool_]
    rows: list[_Row] = field(default_factory=list)
    stiff: float = 1.0
    x: Array = field(default_factory=lambda: np.zeros(0))

    def place(self, x: Array, values: Array, gradients: Array, weights: Array) -> None:
        """At a design (members,): values (r,) and gradients (r, members) there."""
        if not self.rows:
            self.rows = [
                _Row(table=[_Seen(x=x, value=float(v), elongation=np.sqrt(np.maximum(-g, 0.0)))])
                for v, g in zip(values, gradients, strict=True)
            ]
        self.x = x
        for row, value, gradient in zip(self.rows, values, gradients, strict=True):
            row.place(x, float(value), gradient)

    def at(self, step: Array, weights: Array) -> ModelledRows:
        """After a step (n,) of the free members, and the curvature of the sum with weights (r,)."""
        x, n = self._moved(step), len(step)
        values, slopes, diagonal, columns = [], [], np.zeros(n), [np.zeros((n, 0))]
        for row, weight in zip(self.rows, weights, strict=True):
            share, bounds = min(1.0, self.stiff * row.share), row.bounds(x)
            straight = row.forces_squared[self.free] / x[self.free] ** 2
            values.append(share * bounds.above + (1 - share) * bounds.below)
            slopes.append(-share * straight - (1 - share) * bounds.elongation[self.free] ** 2)
            diagonal += weight * share * 2 * straight / x[self.free]
            if weight > _LIGHT * weights.max() and share < 1:
                columns.append(np.sqrt(weight * (1 - share)) * bounds.factor[:, self.free].T)
        return ModelledRows(
            values=np.array(values), slopes=np.array(slopes), diagonal=diagonal, columns=np.hstack(columns)
        )

    def _moved(self, step: Array) -> Array:
        x = self.x.copy()
        x[self.free] += step
        return x

    def learn(self, trial: Array, values: Array, gradients: Array, *, taken: bool) -> bool:
        """From a trial design (members,); False when its rows are no compliances."""
        if not are_compliances(trial, values, gradients):
            return False
        most = int(min(_DESIGNS, max(_FEWEST, _NUMBERS / len(trial) / len(self.rows))))
        fits = True
        for row, value, gradient in zip(self.rows, values, gradients, strict=True):
            try:
                bounds = row.bounds(trial)
            except np.linalg.LinAlgError:
                row.table = row.table[-1:]
                continue
            elongation = np.copysign(np.sqrt(np.maximum(-gradient, 0.0)), bounds.elongation)
            seen = _Seen(x=trial, value=float(value), elongation=elongation)
            fits &= row.learn(bounds, seen, taken=taken, most=most)
        return fits

    def stiffen(self) -> bool:
        """Nearer to the upper bounds; False when all rows were there."""
        there = all(self.stiff * row.share >= 1 for row in self.rows)
        self.stiff *= _STIFFEN
        return not there

    def relax(self) -> None:
        """Half of the way back."""
        self.stiff = max(1.0, _RELAX * self.stiff)
