"""Responses over time, and how one becomes a number: a table of reductions, which the study schema reads."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.errors import EvaluationFailed

__all__ = ["REDUCTIONS", "History", "Reduction"]


@dataclass(frozen=True, slots=True, eq=False)
class History:
    """A response over time: two sequences of equal length, `time` rising; arrays in what a model answered."""

    time: Sequence[float] | np.ndarray
    values: Sequence[float] | np.ndarray

    @classmethod
    def of(cls, time: Any, values: Any) -> "History":
        """Of two sequences of numbers, as read-only arrays of doubles.

        Raises:
            TypeError, ValueError: one of them is no sequence of numbers.
        """
        return cls(_doubles(time), _doubles(values))

    def __eq__(self, other: object) -> bool:
        """Whether both have the same times and values."""
        if not isinstance(other, History):
            return NotImplemented
        return np.array_equal(self.time, other.time) and np.array_equal(self.values, other.values)

    __hash__ = None  # type: ignore[assignment]


def _doubles(sequence: Any) -> np.ndarray:
    """The numbers as a row of doubles that nobody changes any more."""
    given = np.asarray(sequence)
    if given.dtype.kind not in "fiub":  # objects, texts, complex numbers: one by one, as float() takes them
        given = np.array([float(v) for v in sequence])
    if given.ndim != 1:
        raise TypeError(f"a row of numbers is needed, got an array of shape {given.shape}")
    found = np.array(given, dtype=np.float64)
    found.flags.writeable = False
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class Reduction:
    """How a history becomes a number: a kind of REDUCTIONS, the time of "at", the order p of "norm".

    >>> Reduction(kind="max_abs").of(History([0, 1, 2], [0.5, -3, 1]))
    3.0
    """

    kind: str
    at: float | None = None
    p: float = 2.0

    def of(self, history: History) -> float:
        """The number; NaN where a time or a value is not finite.

        Raises:
            EvaluationFailed: lengths differ, the history is empty, or `at` lies outside its time.
        """
        t, y = np.asarray(history.time, dtype=float), np.asarray(history.values, dtype=float)
        if len(t) != len(y) or not len(y):
            raise EvaluationFailed(f"a history needs times and values alike, got {len(t)} and {len(y)}")
        if not (np.isfinite(t).all() and np.isfinite(y).all()):
            return float("nan")
        return float(REDUCTIONS[self.kind](self, t, y))


def _at(rule: Reduction, t: np.ndarray, y: np.ndarray) -> float:
    """The value at a time, between two nodes on the straight line."""
    assert rule.at is not None
    at = rule.at
    if not t[0] <= at <= t[-1]:
        raise EvaluationFailed(
            f"the history runs from {t[0]:g} to {t[-1]:g}, its value at {at:g} does not exist"
        )
    if len(t) == 1:
        return float(y[0])
    k = max(1, int(np.searchsorted(t, at)))
    share = (at - t[k - 1]) / (t[k] - t[k - 1]) if t[k] > t[k - 1] else 1.0
    return float(y[k - 1] + share * (y[k] - y[k - 1]))


def _mean(_rule: Reduction, t: np.ndarray, y: np.ndarray) -> float:
    """1/T int y dt."""
    return float(np.trapezoid(y, t) / (t[-1] - t[0]) if t[-1] > t[0] else y[0])


def _norm(rule: Reduction, t: np.ndarray, y: np.ndarray) -> float:
    """(1/T int |y|^p dt)^(1/p)."""
    largest = float(np.abs(y).max())
    if largest == 0 or t[-1] <= t[0]:
        return largest
    # scaled by the peak: |y|^p of a large p would overflow
    with np.errstate(under="ignore"):
        inner = np.trapezoid(np.abs(y / largest) ** rule.p, t) / (t[-1] - t[0])
    return float(largest * inner ** (1 / rule.p))


REDUCTIONS: dict[str, Callable[[Reduction, np.ndarray, np.ndarray], float]] = {
    "max": lambda _rule, _t, y: y.max(),
    "min": lambda _rule, _t, y: y.min(),
    "max_abs": lambda _rule, _t, y: np.abs(y).max(),
    "final": lambda _rule, _t, y: y[-1],
    "mean": _mean,
    "at": _at,
    "norm": _norm,
}
