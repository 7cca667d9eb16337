"""The first-order error of a design whose rows are histories: rows are added until it no longer falls.

A certificate (`optimality.py`) of few rows promises too much: its move may raise a row that it does not hold.
It begins with the highest peaks. While its error is worth a closer look, the change of all rows looked at is
predicted along the move that it found, and the peaks that rise above its bound join (cutting planes, Kelley
1960). More rows can only lower the promise, and every certificate on the way is a valid one. All nodes are
looked at where slopes were carried forward beside the run, the peaks and their neighbours where each row
takes its part of a sweep backwards.
"""

import numpy as np
from numpy.typing import NDArray

from ..formulation.peaks import local_peaks, neighbours, rows_with_neighbours
from ..formulation.problem import Evaluation, LayoutProblem
from .optimality import Certificate, certificate

__all__ = ["first_order"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_HIGH = 0.1  # below the largest value, as a share of it: the peaks that a certificate begins with
_ROUNDS = 30  # of rows that join
_ABOVE = 1e-7  # of the value, by which a row has to rise above the bound to join
_NUMBERS = 4_000_000  # in a table of gradients: nodes are looked at in equal strides that keep it as small


def first_order(
    problem: LayoutProblem, density: Array, evaluation: Evaluation, *, enough: float
) -> Certificate:
    """The certificate of a design (members,).

    enough: error, relative to the value, below which no rows are added.
    """
    values = np.atleast_2d(evaluation.values)
    flat, top = values.ravel(), float(values.max())
    constraints, slopes = evaluation.constraints, evaluation.constraint_gradients
    if values.shape[1] == 1:
        rows = np.arange(flat.size)
        return certificate(
            problem, density, flat, problem.checked_gradients(evaluation, rows), constraints, slopes
        )
    rows = local_peaks(values, above=top - _HIGH * abs(top))
    gradients = problem.checked_gradients(evaluation, rows)
    found = least = certificate(problem, density, flat[rows], gradients, constraints, slopes)
    if least.kkt <= enough:
        return least
    carried = evaluation.factors(rows[:1]) is not None
    looked = _rows_to_look_at(values, problem.members if carried else None)
    table = problem.checked_gradients(evaluation, looked)
    inside = np.isin(looked, rows)
    for _ in range(_ROUNDS):
        predicted = flat[looked] + table @ (found.vertex - density)
        bound = float(predicted[inside].max()) + _ABOVE * abs(top)
        raised = _peaks_of(looked // values.shape[1], predicted, above=bound) & ~inside
        if not raised.any():
            break
        inside |= raised
        found = certificate(problem, density, flat[looked[inside]], table[inside], constraints, slopes)
        if found.kkt < least.kkt:
            least = found
        if least.kkt <= enough:
            break
    return least


def _rows_to_look_at(values: Array, members: int | None) -> Rows:
    """All local peaks and their neighbours, and nodes in equal strides where `members` slopes are at hand.

    Nodes outside a window have the least value of their history and are none of the problem's rows: rows of
    that value are left out, which is safe.
    """
    chosen = np.zeros(values.shape, dtype=bool)
    chosen.ravel()[rows_with_neighbours(values, local_peaks(values), neighbours(values.shape[1]))] = True
    if members is not None:
        chosen[:, :: int(np.ceil(values.size * members / _NUMBERS))] = True
    chosen &= values > values.min(axis=1, keepdims=True)
    return np.flatnonzero(chosen.ravel())


def _peaks_of(scenario: Rows, predicted: Array, *, above: float) -> NDArray[np.bool_]:
    """(rows,): True at the local peaks of each scenario's predicted rows, in order of time."""
    before = np.r_[-np.inf, np.where(np.diff(scenario) == 0, predicted[:-1], -np.inf)]
    behind = np.r_[np.where(np.diff(scenario) == 0, predicted[1:], -np.inf), -np.inf]
    peak = (predicted >= before) & (predicted > behind) & (predicted > above)
    return np.asarray(peak)
