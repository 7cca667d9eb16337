"""How much worse the mean could be elsewhere, where runs have noise.

    U = 97.5 % point of max over u of f(u),    f drawn from the Kriging given all runs

with f the process without the nugget, drawn jointly at the points that could hold its largest value, its
deviations inflated by leave-one-out. A bound on every point by itself, as runs without noise allow it, would
be wider than all draws: noise keeps the deviations of all points large and their errors are shared. The
draws know nothing of peaks between the runs, and their 95 % point covered the largest mean in 90 % of the
searches with known functions; what is stated with 95 % is therefore their 97.5 % point.
"""

from functools import partial

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.search.evidence.gap import COVERAGE, HOPELESS, Gap
from workbench.search.runs.ledger import Ledger
from workbench.search.runs.repeats import Mean
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.noisy import credible_noisy_models
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream

__all__ = ["mean_gap"]

RANDOM_POINTS, CORNERS = 4000, 1000
KEPT = 400  # points of the highest bounds, whose values are drawn
DRAWS = 2000
QUANTILE = 0.975  # of the draws, so that what is stated covers in 95 % of searches
LEANS = (1.0, 2.0, 3.0)  # deviations above the mean whose largest points are drawn, too


def mean_gap(ledger: Ledger, model: SearchModel, success: SuccessChance, mean: Mean, *, seed: int) -> Gap:
    """The gap above a `mean` in the sign of the ledger, no narrower than its interval."""
    where = ledger.where
    rng = stream(seed, "gap of the mean", replicate=ledger.spent)

    def bound(points: np.ndarray, lean: float) -> np.ndarray:
        features = where.features(points)
        possible = where.allowed(points) & (success.probability(features) > HOPELESS)
        return np.where(possible, model.transformed_bound(features, lean), -np.inf)

    inside = rng.random((RANDOM_POINTS, where.dimension))
    corners = rng.integers(0, 2, (CORNERS, where.dimension)).astype(float)
    points = np.unique(where.snap(np.vstack([inside, corners, ledger.u])), axis=0)
    chosen = []
    for lean in LEANS:
        bounds = bound(points, lean)
        top = points[np.argsort(bounds)[-KEPT // len(LEANS) :]]
        chosen += [top, maximise_score(partial(bound, lean=lean), top[-2:], where.levels, sweeps=25)[0]]
    kept = np.unique(np.vstack(chosen), axis=0)
    kept = kept[np.isfinite(bound(kept, 0.0))]
    upper = mean.value + mean.half
    if len(kept):
        models, shares = credible_noisy_models(where.features(ledger.u_ok), ledger.v, seed=seed)
        largest = []
        for one, share in zip(models, shares, strict=True):
            draws = round(float(share) * DRAWS)
            if not draws:
                continue
            predicted, covariance = one.kriging.posterior_.covariance(where.features(kept))
            values, vectors = np.linalg.eigh(covariance)
            root = one.inflation * vectors * np.sqrt(np.maximum(values, 0.0))
            largest.append((predicted[:, None] + root @ rng.standard_normal((len(kept), draws))).max(axis=0))
        upper = max(upper, float(np.quantile(np.concatenate(largest), QUANTILE)))
    return Gap(
        upper=upper, width=upper - mean.value, coverage=COVERAGE, kind="model-based", subject="the mean"
    )
