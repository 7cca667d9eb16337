"""Designs compared in the scenarios in which every one of them gave a value.

A design that fails where the response is bad would look better for it if its statistics were those of the
runs that it survived. So the comparison rests on common scenarios, and failures are told beside it.

    share k/n                 with the Wilson interval (Wilson 1927)
    quantile q                the order statistics whose ranks hold the binomial 95 % interval of q n; where a
                              small sample has no such rank, that side of the interval is open
    regret of a scenario      value of the design minus the best of all designs in that scenario
    price of robustness       value at nominal minus the best value at nominal
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.stats import binom

from workbench.errors import NotEnoughRuns
from workbench.robust.record import Share, Summary

__all__ = [
    "FEWEST",
    "common",
    "mean_interval",
    "paired_differences",
    "quantile",
    "share",
    "summaries",
    "wilson",
]

Z95 = 1.959963984540054
QUANTILES = (0.05, 0.5, 0.95)
FEWEST = 10


def wilson(k: int, n: int, z: float = Z95) -> tuple[float, float]:
    """The Wilson interval of a share k/n.

    >>> low, high = wilson(9, 10)
    >>> print(f"{low:.3f} {high:.3f}")
    0.596 0.982
    """
    if n == 0:
        return 0.0, 1.0
    p, z2 = k / n, z * z
    centre = (p + z2 / (2 * n)) / (1 + z2 / n)
    half = z / (1 + z2 / n) * np.sqrt(p * (1 - p) / n + z2 / (4 * n * n))
    # none and all reach the end exactly; rounding would leave 3e-18
    return (0.0 if k == 0 else float(centre - half)), (1.0 if k == n else float(centre + half))


def share(hit: np.ndarray) -> Share:
    """The share of True among `hit` (n,) with its interval."""
    k, n = int(hit.sum()), len(hit)
    return (k / n, *wilson(k, n))


def mean_interval(sample: np.ndarray) -> tuple[float, float, float]:
    """The mean of a sample (n,) with its 95 % interval by the normal approximation."""
    # by a power of two, which rounds nothing: the square of a run that went astray (1e200) would overflow
    scale = 2.0 ** (np.frexp(np.abs(sample).max())[1] - 1)
    mean = float((sample / scale).mean() * scale)
    half = float(Z95 * (sample / scale).std(ddof=1) / np.sqrt(len(sample)) * scale)
    return mean, mean - half, mean + half


def quantile(sample: np.ndarray, q: float) -> tuple[float, float | None, float | None]:
    """Sample quantile with its distribution-free 95 % interval from order statistics; None where it is open.

    >>> quantile(np.arange(100.0), 0.5), quantile(np.arange(20.0), 0.95)
    ((49.5, 39.0, 60.0), (18.05, 16.0, None))
    """
    ordered, n = np.sort(sample), len(sample)
    low, high = int(binom.ppf(0.025, n, q)) - 1, int(binom.ppf(0.975, n, q))
    return (
        float(np.quantile(ordered, q)),
        float(ordered[low]) if low >= 0 else None,
        float(ordered[high]) if high < n else None,
    )


def common(names: Sequence[str], drawn: np.ndarray, errors: Mapping[str, str]) -> np.ndarray:
    """Which of the drawn scenarios, values (n, designs) with NaN where a run failed, have a value of all.

    Raises:
        NotEnoughRuns: fewer than 10 of them; names the design that fails too often (`errors` in its words),
            or says that the designs fail in different scenarios.
    """
    there = ~np.isnan(drawn)
    together: np.ndarray = there.all(axis=1)
    if together.sum() >= FEWEST:
        return together
    n = len(drawn)
    for name, count in zip(names, there.sum(axis=0), strict=True):
        if count < FEWEST:
            why = f". Its last failure: {errors[name]}" if errors.get(name) else ""
            raise NotEnoughRuns(
                f"design {name!r} gave a value in {count} of {n} runs; at least {FEWEST} are needed{why}"
            )
    each = ", ".join(f"{name} in {count}" for name, count in zip(names, there.sum(axis=0), strict=True))
    raise NotEnoughRuns(
        f"the designs gave values together in {together.sum()} of {n} scenarios ({each}); at least {FEWEST} "
        "are needed to compare them. Compare fewer designs, or mend what fails"
    )


def summaries(
    names: Sequence[str],
    rows: Sequence[Mapping[str, Any]],
    values: np.ndarray,
    together: np.ndarray,
    at_nominal: np.ndarray | None,
    *,
    sign: float,
    limit: float | None,
) -> tuple[Summary, ...]:
    """One summary per design.

    Args:
        rows, values: scenarios and their values (m, designs), the n drawn ones first.
        together: (n,) which of the drawn ones have a value of every design.
        at_nominal: (designs,), NaN where it failed.
        sign: +1 when large is bad, -1 when small is.
    """
    drawn = values[: len(together)]
    whole = np.flatnonzero(~np.isnan(values).any(axis=1))
    bad = sign * values[whole]
    regret = bad - bad.min(axis=1, keepdims=True)
    out = []
    for j, name in enumerate(names):
        sample, failed = drawn[together, j], np.isnan(drawn[:, j])
        worst = int(whole[bad[:, j].argmax()])
        worst_run = int(np.nanargmax(sign * values[:, j]))
        beyond = None if limit is None else sign * sample > sign * limit
        # NaN > limit is False: a failure is counted by its own term
        risk = None if limit is None else (sign * drawn[:, j] > sign * limit) | failed
        mean, low, high = mean_interval(sample)
        nominal, price = _at_nominal(at_nominal, j, sign)
        out.append(
            Summary(
                design=name,
                n=len(sample),
                failed=int(failed.sum()),
                failed_share=share(failed),
                mean=mean,
                mean_interval=(low, high),
                quantiles={f"P{round(100 * q)}": quantile(sample, q) for q in QUANTILES},
                worst=float(values[worst, j]),
                worst_scenario=dict(rows[worst]),
                worst_run=float(values[worst_run, j]),
                worst_run_scenario=dict(rows[worst_run]),
                beyond_limit=None if beyond is None else share(beyond),
                beyond_or_failed=None if risk is None else share(risk),
                largest_regret=float(regret[:, j].max()),
                mean_regret=float(regret[:, j].mean()),
                nominal=nominal,
                price_of_robustness=price,
            )
        )
    return tuple(out)


def paired_differences(
    names: Sequence[str], drawn: np.ndarray, together: np.ndarray
) -> dict[str, tuple[float, float, float]]:
    """Mean difference to the first design over the common scenarios, with its 95 % interval."""
    return {
        f"{name} - {names[0]}": mean_interval(drawn[together, j] - drawn[together, 0])
        for j, name in enumerate(names[1:], start=1)
    }


def _at_nominal(at_nominal: np.ndarray | None, j: int, sign: float) -> tuple[float | None, float | None]:
    if at_nominal is None or np.isnan(at_nominal[j]):
        return None, None
    return float(at_nominal[j]), float(sign * at_nominal[j] - np.nanmin(sign * at_nominal))
