"""The mean of repeated runs at one point, with its interval.

    mean = (y_1 + ... + y_k)/k,    s^2 = sum (y_i - mean)^2/(k - 1)
    interval = mean -+ t(0.975, k - 1) s/sqrt k          Student 1908

The interval holds with 95 % for noise of a normal law when the point was chosen before the k runs were made:
runs by which a point was chosen are the lucky ones, and have no part in its mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from workbench.models.evaluator import Outcome, RepeatingEvaluator
from workbench.search.runs.ledger import Ledger
from workbench.space.units import number

__all__ = ["COVERAGE", "Mean", "mean_of", "run_again"]

COVERAGE = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Mean:
    """`value` of `count` runs at one point, which holds within -+ `half`, and the `deviation` of one run."""

    value: float
    half: float
    count: int
    deviation: float

    @property
    def interval(self) -> tuple[float, float]:
        """The lower and the upper end."""
        return self.value - self.half, self.value + self.half

    def label(self, unit: str = "1") -> str:
        """How a page says it.

        >>> Mean(value=3.2, half=0.31, count=12, deviation=0.5).label("N")
        'the mean of 12 runs, +- 0.31 N with 95 % confidence'
        """
        suffix = "" if unit in ("", "1") else f" {unit}"
        return (
            f"the mean of {self.count} runs, +- {number(self.half, 3)}{suffix} with "
            f"{100 * COVERAGE:.0f} % confidence"
        )


def mean_of(values: Sequence[float]) -> Mean:
    """The mean of at least two runs.

    Raises:
        ValueError: fewer than two values, of which nothing follows about the noise.

    >>> found = mean_of([1.0, 2.0, 3.0])
    >>> found.value, round(found.half, 3), found.deviation
    (2.0, 2.484, 1.0)
    """
    k = len(values)
    if k < 2:
        raise ValueError(f"the mean of repeated runs needs at least 2 of them, got {k}")
    deviation = float(np.std(values, ddof=1))
    half = float(stdtrit(k - 1, 0.5 + COVERAGE / 2)) * deviation / float(np.sqrt(k))
    return Mean(value=float(np.mean(values)), half=half, count=k, deviation=deviation)


def run_again(
    evaluate: RepeatingEvaluator, ledger: Ledger, u: np.ndarray, *, times: int, purpose: str
) -> list[Outcome]:
    """Run a point (1, d) that was run so many `times` before."""
    rows = ledger.where.rows(u)
    return evaluate(rows, purpose=purpose, repeat=times) if times else evaluate(rows, purpose=purpose)
