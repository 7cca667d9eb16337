"""Responses over time, and how one becomes a number: a table of reductions, which the study schema reads."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from workbench.errors import EvaluationFailed

__all__ = ["REDUCTIONS", "History", "Reduction"]


@dataclass(frozen=True, slots=True)
class History:
    """A response over time: two sequences of equal length, `time` rising."""

    time: Sequence[float]
    values: Sequence[float]


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
        t, y = [float(v) for v in history.time], [float(v) for v in history.values]
        if len(t) != len(y) or not y:
            raise EvaluationFailed(f"a history needs times and values alike, got {len(t)} and {len(y)}")
        if not all(math.isfinite(v) for v in (*t, *y)):
            return math.nan
        return REDUCTIONS[self.kind](self, t, y)


def _at(rule: Reduction, t: list[float], y: list[float]) -> float:
    """The value at a time, between two nodes on the straight line."""
    assert rule.at is not None
    at = rule.at
    if not t[0] <= at <= t[-1]:
        raise EvaluationFailed(
            f"the history runs from {t[0]:g} to {t[-1]:g}, its value at {at:g} does not exist"
        )
    for k in range(1, len(t)):
        if at <= t[k]:
            share = (at - t[k - 1]) / (t[k] - t[k - 1]) if t[k] > t[k - 1] else 1.0
            return y[k - 1] + share * (y[k] - y[k - 1])
    return y[-1]


def _mean(_rule: Reduction, t: list[float], y: list[float]) -> float:
    """1/T int y dt."""
    return _integral(t, y) / (t[-1] - t[0]) if t[-1] > t[0] else y[0]


def _norm(rule: Reduction, t: list[float], y: list[float]) -> float:
    """(1/T int |y|^p dt)^(1/p)."""
    largest = max(abs(v) for v in y)
    if largest == 0 or t[-1] <= t[0]:
        return largest
    # scaled by the peak: |y|^p of a large p would overflow
    inner = _integral(t, [abs(v / largest) ** rule.p for v in y]) / (t[-1] - t[0])
    return float(largest * inner ** (1 / rule.p))


def _integral(t: list[float], y: list[float]) -> float:
    """By the trapezoidal rule."""
    return sum(0.5 * (t[k] - t[k - 1]) * (y[k] + y[k - 1]) for k in range(1, len(t)))


REDUCTIONS: dict[str, Callable[[Reduction, list[float], list[float]], float]] = {
    "max": lambda _rule, _t, y: max(y),
    "min": lambda _rule, _t, y: min(y),
    "max_abs": lambda _rule, _t, y: max(abs(v) for v in y),
    "final": lambda _rule, _t, y: y[-1],
    "mean": _mean,
    "at": _at,
    "norm": _norm,
}
