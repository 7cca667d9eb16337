"""Where the limits of the runs stand at a design, what they cost, and the sentence on each."""

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation
from .result import LimitOutcome

__all__ = ["limit_outcomes", "limit_sentence"]

Array = NDArray[np.float64]

_WORTHLESS = 1e-6  # of the value per 1 % of the limit


def limit_outcomes(evaluation: Evaluation | None, prices: Array) -> tuple[LimitOutcome, ...]:
    """Every limit at its worst row; prices (c,) of the rows, per unit of the constraint."""
    if evaluation is None or not evaluation.limit_rows:
        return ()
    rows, values = evaluation.limit_rows, np.asarray(evaluation.constraints)
    found = []
    for number in sorted({row.limit for row in rows}):
        own = [i for i, row in enumerate(rows) if row.limit == number]
        worst = rows[max(own, key=lambda i: values[i])]
        found.append(
            LimitOutcome(
                name=worst.name, value=worst.height, bound=worst.bound, upper=worst.upper, unit=worst.unit,
                scenario=worst.scenario, time=worst.time,
                price=float(sum(prices[i] for i in own)) / worst.size,
            )
        )  # fmt: skip
    return tuple(found)


def limit_sentence(limit: LimitOutcome, objective: float, unit: str) -> str:
    """What a designer asks of a limit: whether it binds, where, and what loosening it would bring."""
    suffix = "" if limit.unit == "1" else f" {limit.unit}"
    where = f"in scenario {limit.scenario}"
    if np.isfinite(limit.time):
        where = f"at t = {limit.time:.4g} s {where}"
    side = "at most" if limit.upper else "at least"
    bound = f"{side} {limit.bound:.6g}{suffix}"
    one_percent = 0.01 * abs(limit.bound) if limit.bound else 0.01
    gain = limit.price * one_percent
    if gain <= _WORTHLESS * abs(objective):
        return f"'{limit.name}' ({bound}) costs nothing: its worst is {limit.value:.6g}{suffix} {where}."
    step = "1 %" if limit.bound else f"{one_percent:g}{suffix}"
    of = "" if unit == "1" else f" {unit}"
    return (
        f"'{limit.name}' ({bound}) binds {where}; loosening it by {step} would lower the objective by about "
        f"{gain:.3g}{of} ({100 * gain / abs(objective):.2g} %)."
    )
