"""The barrier step: the minimiser of modelled rows with the barrier of bounds, budgets and rows.

At a fixed mu it is

    min over (d, t)  t - mu [ sum log(d - lo) + sum log(hi - d) + sum log s ],
    rows(d) + s = t,   A d + s = room,   s > 0

found by primal-dual Newton steps (`bound/quadratic.py`). What models the rows says what they are
at a step d, and how their weighted sum bends there.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from ..bound.quadratic import BoundState, NewtonSystem

__all__ = ["ModelledRows", "RowsModel", "barrier_function", "barrier_minimum"]

Array = NDArray[np.float64]

_NEWTON, _SETTLED = 60, 1e-3
_TO_BOUNDARY = 0.9


@dataclass(frozen=True, slots=True, kw_only=True)
class ModelledRows:
    """At a step: values (r,), slopes (r, n), and the Hessian diag(diagonal) + columns diag(signs) columns' of
    their weighted sum, (n,), (n, k), (k,). slope (n,): of what bends the sum without being in the slopes.
    """

    values: Array
    slopes: Array
    diagonal: Array
    columns: Array
    signs: Array | None = None
    slope: Array | None = None


class RowsModel(Protocol):
    """What a path believes of rows: it is placed at a design, asked at steps, and learns from trials."""

    def place(self, x: Array, values: Array, gradients: Array, weights: Array) -> None:
        """At the design (members,) with the rows' values (r,) and gradients (r, members)."""

    def at(self, step: Array, weights: Array) -> ModelledRows:
        """At a step (n,) of the free members. Raises LinAlgError where the model has no answer."""

    def learn(self, trial: Array, values: Array, gradients: Array, *, taken: bool) -> bool:
        """From a trial; False when the rows are not of the kind that the model takes them for."""

    def stiffen(self) -> bool:
        """Trust what is not known less, after a refused step; False when there is no more to be done."""

    def relax(self) -> None:
        """Trust it more again, after an accepted one."""


def barrier_minimum(
    model: RowsModel, state: BoundState, A: Array, room: Array, lo: Array, hi: Array, mu: float
) -> BoundState | None:
    """The minimiser from a state whose d is the step so far; None where the model has no answer."""
    r = len(state.y) - len(A)
    now = BoundState(
        d=np.zeros_like(lo), t=state.t, s=state.s.copy(), y=state.y.copy(), zl=state.zl, zu=state.zu
    )
    for _ in range(_NEWTON):
        try:
            rows = model.at(now.d, now.y[:r])
        except np.linalg.LinAlgError:
            return None
        residual = np.r_[rows.values - now.t, A @ now.d - room] + now.s
        system = NewtonSystem(
            now, lo, hi, rows.columns, np.vstack([rows.slopes, A]), r, residual,
            diagonal=rows.diagonal, signs=rows.signs, slope=rows.slope,
        )  # fmt: skip
        off = max(
            float(np.abs((now.d - lo) * system.dual_residual).max()),
            float(np.abs(now.y * residual).max()),
            float(np.abs(now.y * now.s - mu).max()),
            float(np.abs(now.zl * (now.d - lo) - mu).max()),
            float(np.abs(now.zu * (hi - now.d) - mu).max()),
        )
        if off <= _SETTLED * mu:
            break
        step = system.direction(mu)
        if not np.isfinite(step.d).all():
            break  # rounding has the last word
        primal, dual = system.lengths(step)
        now.add(step, *(_TO_BOUNDARY * length if length < 1 else 1.0 for length in (primal, dual)))
    return now if np.isfinite(now.d).all() and np.isfinite(now.y).all() else None


def barrier_function(
    x: Array, values: Array, mu: float, lower: Array, upper: Array, A: Array, limits: Array
) -> float:
    """The largest row with the barrier of bounds and budgets; infinite outside."""
    inside = np.concatenate([x - lower, upper - x, limits - A @ x])
    if (inside <= 0).any():
        return np.inf
    return float(values.max() - mu * np.log(inside).sum())
