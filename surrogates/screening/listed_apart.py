"""Inputs that a screening saw and that hardly matter: selected by the likelihood, listed apart from drivers.

With runs enough the likelihood selects every input that acts at all, down to a hundredth of a percent of a
smooth response's variance. A list of drivers ends at one percent, so inputs below it stand beside the list,
by the total Sobol' indices of the selected inputs' Kriging with theta taken as known:

    resolved       below by the mean of the index
    else           below by the upper end of its 95 % band: a model in doubt cannot be asked for a mean

from the weakest up, as long as those listed apart make up no more than a twentieth together. Of a response
that was screened on another scale they are indices of the response itself, see
`surrogates.screening.response_scale.response_shares`.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..analysis.measure import Measure, uniform
from ..analysis.sobol import sobol_indices
from ..kriging.estimator import Kriging
from .hidden_share import percent
from .partitions.anova import AnovaOptimum
from .partitions.anova_shares import drawn_total_indices
from .partitions.canonical import CanonicalRuns

__all__ = [
    "MINOR_SHARE",
    "SelectedShare",
    "anova_shares",
    "apart_in_words",
    "at_the_border",
    "border_in_words",
    "minor_inputs",
    "selected_shares",
    "shares_of",
    "shares_of_units",
]

Array = NDArray[np.float64]

MINOR_SHARE = 0.01  # of the variance: a weaker input is no driver
MOST_TOGETHER = 0.05  # of it, that a list of drivers may leave out
BORDER = 0.5  # of a half of a 95 % band: one standard deviation
DRAWS, FEATURES = 20, 64
MOST_RUNS = 300  # a share of the variance needs no more
LEAST_THETA = 1e-8  # on the ranges of the runs


@dataclass(frozen=True, slots=True, kw_only=True)
class SelectedShare:
    """Total index of one input: `mean`, and the ends of its 95 % band."""

    column: int
    mean: float
    lower: float
    upper: float


def selected_shares(
    x: Array,
    y: Array,
    columns: Sequence[int],
    *,
    theta: Array,
    nugget: float,
    eta: float = 2.0,
    labels: Sequence[int] = (),
    measures: Sequence[Measure | None] | None = None,
    seed: int = 0,
) -> tuple[SelectedShare, ...]:
    """Total indices of some columns of runs x (n, d), y (n,), in ascending order of the columns.

    theta (d,), in the coordinates of x, the nugget and eta are those of the screening; `measures` (d,) say
    what is averaged over, see `surrogates.analysis.measure`; without one a number is uniform on the range of
    its runs, so that shares do not depend on units.
    """
    kept, rng = sorted(int(k) for k in columns), np.random.default_rng(seed)
    if not kept:
        return ()
    rows = np.arange(len(y)) if len(y) <= MOST_RUNS else np.sort(rng.permutation(len(y))[:MOST_RUNS])
    label = [k in set(labels) for k in kept]
    width = np.where(label, 1.0, np.ptp(x[:, kept], axis=0))
    model = Kriging(
        correlation="gaussian" if eta == 2.0 else "power_exponential",
        eta=eta,
        trend="constant",
        theta=np.maximum(theta[kept], LEAST_THETA / width**eta),
        nugget=nugget,
        categorical=[i for i, is_label in enumerate(label) if is_label] or None,
        intervals="plug-in",
    ).fit(x[rows][:, kept], y[rows])
    found = sobol_indices(
        model,
        draws=DRAWS,
        features=FEATURES,
        thetas=0,
        measures=[
            _measure(x[:, k], None if measures is None else measures[k], k in set(labels)) for k in kept
        ],
        rng=rng,
    ).total
    return tuple(
        SelectedShare(column=k, mean=float(m), lower=float(low), upper=float(high))
        for k, m, low, high in zip(kept, found.mean, found.lower, found.upper, strict=True)
    )


def anova_shares(
    runs: CanonicalRuns,
    at: AnovaOptimum,
    x: Array,
    *,
    eta: float,
    measures: Sequence[Measure | None] | None = None,
    seed: int = 0,
) -> tuple[SelectedShare, ...]:
    """The same of the units of an ANOVA correlation, from runs x (n, d) and their canonical form.

    Of a unit of several columns each is said to have the share of all.
    """
    drawn = drawn_total_indices(
        runs, at, eta=eta, given=x, measures=measures, draws=DRAWS, rng=np.random.default_rng(seed)
    )
    return shares_of_units(runs, at.units, drawn)


def shares_of(
    screener: Any, x: Array, y: Array, runs: CanonicalRuns, anova: AnovaOptimum | None
) -> tuple[SelectedShare, ...]:
    """Of the inputs that a screener has selected, by the correlation that selected them; () if published."""
    if screener.method != "default" or screener.n_features is not None:
        return ()
    if anova is not None:
        return anova_shares(runs, anova, x, eta=2.0, measures=screener.measures, seed=screener.seed)
    return selected_shares(
        x,
        y,
        screener.selected_.tolist(),
        theta=screener.theta_,
        nugget=screener.nugget_,
        eta=screener.eta_,
        labels=[int(k) % x.shape[1] for k in screener.categorical],
        measures=screener.measures,
        seed=screener.seed,
    )


def shares_of_units(runs: CanonicalRuns, units: Sequence[int], drawn: Array) -> tuple[SelectedShare, ...]:
    """Mean and band of drawn indices (draws, k) of k units, by column."""
    lower, upper = np.quantile(drawn, [0.025, 0.975], axis=0)
    found = [
        SelectedShare(column=k, mean=float(mean), lower=float(low), upper=float(high))
        for unit, mean, low, high in zip(units, drawn.mean(axis=0), lower, upper, strict=True)
        for k in runs.given(unit)
    ]
    return tuple(sorted(found, key=lambda share: share.column))


def _sets(columns: Iterable[int], together: Sequence[Sequence[int]]) -> list[tuple[int, ...]]:
    """The columns that stand or fall together: sets of `together`, and each of the others by itself."""
    at = set(columns)
    sets = [tuple(k for k in group if k in at) for group in together]
    grouped = {k for group in sets for k in group}
    return [group for group in sets if group] + [(k,) for k in columns if k not in grouped]


def at_the_border(shares: Sequence[SelectedShare], together: Sequence[Sequence[int]] = ()) -> tuple[int, ...]:
    """The columns of which the runs do not tell whether they have more than 1 %: it lies within a standard
    deviation of their share, of a set in `together` of the sum.

    >>> one, two = ((0, 0.0095), (1, 0.012))
    >>> found = [SelectedShare(column=k, mean=m, lower=0.8 * m, upper=1.2 * m) for k, m in (one, two)]
    >>> at_the_border(found)
    (0,)
    """
    at = {share.column: share for share in shares}
    found: list[int] = []
    for group in _sets(at, together):
        mean, lower, upper = (sum(getattr(at[k], end) for k in group) for end in ("mean", "lower", "upper"))
        if mean - BORDER * (mean - lower) < MINOR_SHARE < mean + BORDER * (upper - mean):
            found += group
    return tuple(sorted(found))


def apart_in_words(minor: Sequence[int], name: Callable[[int], str]) -> list[str]:
    """The inputs that act and hardly matter; [] where there is none."""
    if not minor:
        return []
    return [f"listed apart, estimated below {percent(MINOR_SHARE)} each: {', '.join(map(name, minor))}"]


def border_in_words(border: Sequence[int], name: Callable[[int], str]) -> list[str]:
    """The inputs that another design would list, or list apart, as soon as not; [] where there is none."""
    if not border:
        return []
    lies = f"{'lie' if len(border) > 1 else 'lies'} at the border of {percent(MINOR_SHARE)}"
    return [f"{' and '.join(map(name, border))} {lies}: listed, or listed apart, by chance"]


def _measure(values: Array, given: Measure | None, is_label: bool) -> Measure | None:
    if given is not None or is_label:
        return given
    return uniform(float(values.min()), float(values.max()))


def minor_inputs(
    shares: Sequence[SelectedShare], together: Sequence[Sequence[int]] = (), *, resolved: bool
) -> tuple[int, ...]:
    """The columns to list apart, the strongest first; of a set in `together` all or none.

    >>> pair = enumerate((0.9, 0.006))
    >>> shares = [SelectedShare(column=k, mean=m, lower=m / 2, upper=2 * m) for k, m in pair]
    >>> minor_inputs(shares, resolved=True), minor_inputs(shares, resolved=False)
    ((1,), ())
    """
    at = {share.column: share for share in shares}
    sets = _sets(at, together)
    size = [sum(at[k].mean if resolved else at[k].upper for k in group) for group in sets]
    # a Kriging that takes the response for noise has no shares
    if not sets or sum(share.mean for share in shares) < 0.5:
        return ()
    found: list[int] = []
    left = MOST_TOGETHER
    for i in np.argsort(size, kind="stable"):
        left -= size[i]
        if size[i] >= MINOR_SHARE or left < 0.0:
            break
        found += sets[i]
    return tuple(found[::-1])
