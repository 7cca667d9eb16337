"""What the failed runs of a comparison may hide, in sentences.

Scenarios in which a design failed are left out of the comparison for all. That is fair to the designs and
says nothing about the failures: where they are many, or where they sit where the other designs are bad
(one-sided Mann-Whitney test, Mann and Whitney 1947), the worst of the design may lie in them.
"""

from collections.abc import Sequence

import numpy as np
from scipy.stats import mannwhitneyu

from workbench.robust.statistics import share

__all__ = ["failure_warnings"]

MANY = 0.05  # share of failed scenarios from which the design's own worst is in doubt
CLEAR = 0.025  # level at which a design is said to fail where others do badly


def failure_warnings(
    names: Sequence[str],
    values: np.ndarray,
    n_drawn: int,
    at_nominal: np.ndarray | None,
    *,
    sign: float,
    unit: str,
) -> tuple[str, ...]:
    """A sentence for every design whose failures may hide its worst, and for every worst run left out.

    Args:
        values: (scenarios, designs), the drawn ones first; NaN where a run failed.
        at_nominal: (designs,)
        sign: +1 when large is bad, -1 when small is.
    """
    drawn, given = values[:n_drawn], values[n_drawn:]
    said = []
    for j, name in enumerate(names):
        failed = np.isnan(drawn[:, j])
        k, (part, low, high) = int(failed.sum()), share(failed)
        where = _where_others_are_bad(names, drawn, j, sign, unit) if k else ""
        if part > MANY or where:
            said.append(
                f"{name} gave no value in {k} of {n_drawn} scenarios ({100 * part:.3g} %, 95 % interval "
                f"{100 * low:.3g} to {100 * high:.3g} %){where}: its worst may be hidden in them"
            )
        missed = int(np.isnan(given[:, j]).sum())
        if missed:
            said.append(f"{name} gave no value in {missed} of the {len(given)} scenarios that were given")
        if at_nominal is not None and np.isnan(at_nominal[j]):
            said.append(
                f"{name} gave no value in the nominal scenario; the price of the others is told without it"
            )
    return (*said, *_left_out_worst(names, values, sign, unit))


def _where_others_are_bad(names: Sequence[str], drawn: np.ndarray, j: int, sign: float, unit: str) -> str:
    """ ", and fails where ..." when another design does clearly worse in the scenarios in which j fails."""
    failed, words = np.isnan(drawn[:, j]), ""
    best = CLEAR / max(len(names) - 1, 1)  # of as many looks as there are other designs
    for i, other in enumerate(names):
        there = ~np.isnan(drawn[:, i])
        inside, outside = drawn[failed & there, i], drawn[~failed & there, i]
        if not len(inside) or not len(outside) or np.ptp(drawn[there, i]) == 0:
            continue
        p = float(mannwhitneyu(sign * inside, sign * outside, alternative="greater").pvalue)
        if p < best:
            best = p
            words = (
                f", and fails where {other} is bad (median {_quantity(float(np.median(inside)), unit)} there,"
                f" {_quantity(float(np.median(outside)), unit)} elsewhere)"
            )
    return words


def _left_out_worst(names: Sequence[str], values: np.ndarray, sign: float, unit: str) -> list[str]:
    """A design's worst run that the comparison leaves out because another design failed there."""
    whole = ~np.isnan(values).any(axis=1)
    said = []
    for j, name in enumerate(names):
        met, run = (sign * values[whole, j]).max(), np.nanmax(sign * values[:, j])
        if run > met:
            said.append(
                f"the worst run of {name}, {_quantity(sign * run, unit)}, is left out of the comparison, "
                "because another design gave no value in that scenario"
            )
    return said


def _quantity(value: float, unit: str) -> str:
    return f"{value:.4g}" if unit == "1" else f"{value:.4g} {unit}"
