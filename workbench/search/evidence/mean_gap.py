"""How much worse the mean could be elsewhere, where runs have noise.

    U = 96 % point of max over u of f(u),    f drawn from Krigings given all runs

with f the process without the nugget, drawn jointly at the points that could hold its largest value, its
deviations inflated by leave-one-out. A bound on every point by itself, as runs without noise allow it, would
be wider than all draws: noise keeps the deviations of all points large and their errors are shared.

The Krigings are rough ones (see `workbench.search.surrogate.noisy`): noise hides whether a peak is smooth or
kinked, and draws of smooth ones missed one in five worst cases inside the box. The draws know nothing of
peaks between the runs, so a higher point of them is taken than what is stated. Where no point is predicted
from the others better than by their mean, the response may hide beneath the noise: no bound is stated.
"""

from dataclasses import replace
from functools import partial
from math import inf

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.search.evidence.gap import HOPELESS, Gap
from workbench.search.runs.ledger import Ledger
from workbench.search.runs.repeats import Mean
from workbench.search.surrogate.left_out_points import q2_of_points
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.noisy import credible_noisy_models
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream

__all__ = ["HIDDEN", "mean_gap"]

RANDOM_POINTS, CORNERS = 4000, 1000
KEPT = (400, 150)  # points of the highest bounds of the search's model, and of the rough one believed most
DRAWS = 2000
QUANTILE = 0.96  # of the draws
# what is stated: of 281 searches of kinked, clipped and peaked responses 262 were covered; of those that were
# not, all but three are second peaks and humps that few runs met
HELD = 0.9
LEANS = (1.0, 2.0, 3.0)  # deviations above the mean whose largest points are drawn, too
HIDDEN = "noise hides what the runs differ by, the Kriging predicts none of their points from the others"


def mean_gap(ledger: Ledger, model: SearchModel, success: SuccessChance, mean: Mean, *, seed: int) -> Gap:
    """The gap above a `mean` in the sign of the ledger, no narrower than its interval; without a bound where
    the runs tell nothing of points that were not run.
    """
    where = ledger.where
    stated = Gap(upper=inf, width=inf, coverage=HELD, kind="model-based", note=HIDDEN, subject="the mean")
    models, shares = credible_noisy_models(where.features(ledger.u_ok), ledger.v, seed=seed)
    explained = max(q2_of_points(one, ledger.u_ok, ledger.v) for one in (model, *models))
    if explained <= 0.0 and not ledger.is_exhausted:
        return stated
    rng = stream(seed, "gap of the mean", replicate=ledger.spent)
    points = _possible_tops(ledger, success, (model, models[int(np.argmax(shares))]), rng)
    upper = mean.value + mean.half
    if len(points):
        largest = [
            _largest(one, where.features(points), draws, rng)
            for one, draws in zip(models, np.round(shares * DRAWS).astype(int), strict=True)
            if draws
        ]
        upper = max(upper, float(np.quantile(np.concatenate(largest), QUANTILE)))
    return replace(stated, upper=upper, width=upper - mean.value, note="")


def _possible_tops(
    ledger: Ledger, success: SuccessChance, models: tuple[SearchModel, SearchModel], rng: np.random.Generator
) -> np.ndarray:
    """Points (m, d) that may hold the largest mean: those of the highest bounds of either model."""
    where = ledger.where

    def bound(points: np.ndarray, model: SearchModel, lean: float) -> np.ndarray:
        features = where.features(points)
        possible = where.allowed(points) & (success.probability(features) > HOPELESS)
        return np.where(possible, model.transformed_bound(features, lean), -np.inf)

    inside = rng.random((RANDOM_POINTS, where.dimension))
    corners = rng.integers(0, 2, (CORNERS, where.dimension)).astype(float)
    points = np.unique(where.snap(np.vstack([inside, corners, ledger.u])), axis=0)
    chosen = []
    for model, count in zip(models, KEPT, strict=True):
        for lean in LEANS:
            by = partial(bound, model=model, lean=lean)
            top = points[np.argsort(by(points))[-count // len(LEANS) :]]
            chosen.append(top)
            if model is models[0]:
                chosen.append(maximise_score(by, top[-2:], where.levels, sweeps=25)[0])
    kept = np.unique(np.vstack(chosen), axis=0)
    return np.asarray(kept[np.isfinite(bound(kept, models[0], 0.0))])


def _largest(model: SearchModel, features: np.ndarray, draws: int, rng: np.random.Generator) -> np.ndarray:
    """The largest value (draws,) at `features` (m, p) of draws of a model."""
    predicted, covariance = model.kriging.posterior_.covariance(features)
    values, vectors = np.linalg.eigh(covariance)
    root = model.inflation * vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray((predicted[:, None] + root @ rng.standard_normal((len(predicted), draws))).max(axis=0))
