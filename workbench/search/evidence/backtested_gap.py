"""The gap that a finished search states: narrower than the loop's, and tested on the search's own past.

    U = 95 % point of max over u of f(u),    f drawn jointly from Krigings of other trends, smoothness, ranges

The loop's gap is a bound on every point by itself under the more doubtful of two models, held by a cap of the
range of the values; on rough responses the cap is all that it says. Here models count by how well they
predict left-out runs, the square root of their leave-one-out density, and a draw has one largest value.

The same statement is made again from the first half and the first two thirds of the runs. What the
later runs gained over the best until then, as a share of the width stated then, is known: where it is small
each time the width was too cautious and is taken at `LEAST` of itself, where the later runs went beyond it is
widened by as much. What is stated lies between `SHARE` of the loop's gap and the whole of it: a model that
predicts all runs well knows nothing of a needle, and the loop's doubts are its share in the statement. Where
no model predicts any left-out run better than the mean of the others does, no bound is stated.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import inf

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.search.evidence.gap import COVERAGE, HOPELESS, Gap
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger
from workbench.search.surrogate.credible import credible_models, deviation_factor
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream

__all__ = ["UNKNOWN", "backtested_gap"]

CUTS = (0.5, 0.67)  # shares of the runs after which the statement is made again
SHARE = 0.4  # of the loop's gap: less is not stated
LEAST, MOST = 0.7, 3.0  # factors of a width that later runs never came near to, or went beyond
MARGIN = 3e-4  # of the range of the values: what a maximum between the points of the draws may be higher
TEMPER = 2.0  # power by which the weights of the models are flattened
RANDOM_POINTS, CORNERS, KEPT, DRAWS = 3000, 500, 40, 1500
LEANS = (1.0, 2.0, 3.0)  # deviations above the mean: the highest points are drawn
MOST_RUNS = 150  # of more, fits cost more than they tell
UNKNOWN = "the Kriging predicts none of the runs from the others"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Stated:
    """How far the largest value lies beyond the best run with 95 %, and the best Q2 of the models."""

    width: float
    q2: float


def backtested_gap(gap: Gap, ledger: Ledger, success: SuccessChance, *, begun: int, seed: int) -> Gap:
    """The loop's model-based `gap`, narrowed where the runs allow it, or without a bound where none is known.

    `begun`: runs of the start design and given ones, of which no statement is made.
    """
    features, v = ledger.where.features(ledger.u_ok), ledger.v
    n, p = features.shape
    if n > MOST_RUNS or n < max(begun, p + FEWEST_RUNS) or ledger.is_flat:
        return gap
    now = _stated(ledger, features, v, success, seed=seed)
    if now.q2 <= 0.0:
        return replace(gap, upper=inf, width=inf, note=UNKNOWN)
    used = []
    for cut in CUTS:
        m = max(round(cut * n), begun + 1, p + FEWEST_RUNS)
        if m < n and float(np.ptp(v[:m])) > 0.0:
            then = _stated(ledger, features[:m], v[:m], success, seed=seed)
            gain = float(v.max() - v[:m].max())
            used.append(gain / max(then.width, MARGIN * float(np.ptp(v))))
    factor = float(np.clip(max(used), LEAST, MOST)) if used else 1.0
    width = max(factor * now.width + MARGIN * float(np.ptp(v)), SHARE * gap.width)
    width = min(width, gap.width)
    return replace(gap, upper=float(v.max()) + width, width=width)


def _stated(
    ledger: Ledger, features: np.ndarray, v: np.ndarray, success: SuccessChance, *, seed: int
) -> _Stated:
    """The statement from the runs at `features` (n, p) with the values v (n,)."""
    where = ledger.where
    models, shares = credible_models(features, v, temper=TEMPER, seed=seed)
    rng = stream(seed, "backtested gap", replicate=len(v))
    inside = rng.random((RANDOM_POINTS, where.dimension))
    corners = rng.integers(0, 2, (CORNERS, where.dimension)).astype(float)
    points = where.snap(np.vstack([inside, corners]))
    points = points[where.allowed(points)]
    points = points[success.probability(where.features(points)) > HOPELESS]
    if not len(points):
        return _Stated(width=0.0, q2=1.0)

    def score(u: np.ndarray, model: SearchModel, lean: float) -> np.ndarray:
        mean, std = model.predict(where.features(u))
        return np.where(where.allowed(u), mean + lean * std, -np.inf)

    chosen = []
    for i in np.argsort(-shares)[:3]:
        for lean in LEANS:
            by = partial(score, model=models[i], lean=lean)
            top = points[np.argsort(by(points))[-KEPT:]]
            chosen.append(top)
            if i == int(np.argmax(shares)):
                found = maximise_score(by, top[-2:], where.levels, sweeps=20)[0]
                chosen.append(found[success.probability(where.features(found)) > HOPELESS])
    kept = where.features(np.unique(np.vstack(chosen), axis=0))
    largest = [
        _largest(model, kept, draws, rng)
        for model, draws in zip(models, np.round(shares * DRAWS).astype(int), strict=True)
        if draws
    ]
    width = max(float(np.quantile(np.concatenate(largest), COVERAGE)) - float(v.max()), 0.0)
    return _Stated(width=width, q2=max(model.q2 for model in models))


def _largest(model: SearchModel, features: np.ndarray, draws: int, rng: np.random.Generator) -> np.ndarray:
    """The largest value (draws,) at `features` (m, p) of draws of a model."""
    mean, covariance = model.kriging.posterior_.covariance(np.ascontiguousarray(features))
    values, vectors = np.linalg.eigh(covariance)
    root = deviation_factor(model) * vectors * np.sqrt(np.maximum(values, 0.0))
    best: np.ndarray = (mean[:, None] + root @ rng.standard_normal((len(mean), draws))).max(axis=0)
    return best
