"""Stability of a screening: how often an input is selected again when a tenth of the runs is left out.

Breiman (Ann. Stat. 24, 1996, 2350-2383) called a selection unstable when small changes of the data change
it. Here random tenths of the runs are left out in turn, the likelihood is climbed anew from the maximum
found with all runs, the set is shortened and chosen by the same rule. A share near 1 says that no few runs
carry the selection; it does not repeat the search from random starts.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from .confirmation import SMOOTH
from .partitions.anova import anova_landscape
from .partitions.canonical import CanonicalRuns
from .partitions.landscape import PACKED_RUNS, landscape_of
from .partitions.optimum import Optimum
from .screener import KrigingScreener
from .sets.anova import anova_price, units_that_stay
from .sets.backward import shorten
from .sets.forward import forward_path

__all__ = ["selection_stability"]


def selection_stability(
    screener: KrigingScreener,
    *,
    resamples: int = 20,
    left_out: float = 0.1,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Share of resamples in which each input is selected, (d,); the screener is "default" or "forward".

    >>> x = np.random.default_rng(1).random((30, 4))
    >>> screener = KrigingScreener().fit(x, np.sin(5 * x[:, 2]) + x[:, 1])
    >>> print(selection_stability(screener, resamples=5, rng=np.random.default_rng(0)))
    [0. 1. 1. 0.]

    Raises ValueError for the method "welch" and shares outside (0, 0.5].
    """
    check_is_fitted(screener)
    if screener.method == "welch":
        raise ValueError("stability needs method 'default' or 'forward', got 'welch'")
    if not 0.0 < left_out <= 0.5:
        raise ValueError(f"left_out needs a share in (0, 0.5], got {left_out}")
    if resamples < 1:
        raise ValueError(f"resamples needs at least 1, got {resamples}")
    share = np.zeros(screener.n_features_in_)
    if screener._runs is None or screener._largest is None:
        return share
    runs, start = screener._runs, screener._largest
    n = len(runs.y)
    left = max(1, round(left_out * n))
    if n - left < 3:
        return share
    order = np.empty(0, dtype=np.intp)
    for _ in range(resamples):
        if len(order) < left:  # every run is left out equally often
            order = rng.permutation(n)
        gone, order = order[:left], order[left:]
        kept = np.setdiff1d(np.arange(n), gone)
        for unit in _selected(screener, runs, start, kept):
            share[list(runs.given(unit))] += 1.0 / resamples
    return share


def _selected(
    screener: KrigingScreener,
    runs: CanonicalRuns,
    start: tuple[tuple[int, ...], Optimum],
    rows: NDArray[np.intp],
) -> tuple[int, ...]:
    bounds, threshold = screener.diagnosis_.nugget_bounds, screener.diagnosis_.threshold
    if screener._anova is not None:
        part = replace(runs, x=np.ascontiguousarray(runs.x[rows]), y=runs.y[rows])
        anova = anova_landscape(part, restricted=screener.criterion == "reml", eta=SMOOTH, nugget=bounds)
        return units_that_stay(anova, screener._anova, price=anova_price(threshold))
    ground = landscape_of(runs, restricted=screener.criterion == "reml", eta=screener.eta_, rows=rows)
    if screener.method == "forward":
        _, path = forward_path(ground, nugget=bounds, threshold=threshold, steps=screener.n_features)
        taken = path if screener.n_features else [s for s in path if s.gain >= threshold]
        return tuple(s.added for s in taken)
    large = ground.n_runs > PACKED_RUNS
    chain = shorten(
        ground,
        start[1],
        selected=start[0],
        nugget=bounds,
        tried=1 if large else 2,
        valued=3 if large else 1000,
    )
    i = (
        chain.best(threshold)
        if screener.n_features is None
        else chain.index(min(screener.n_features, len(chain.sets[0])))
    )
    return chain.sets[i]
