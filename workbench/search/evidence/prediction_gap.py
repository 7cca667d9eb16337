"""How much worse than a predicted worst case could it be, where nothing can be run?

    U = max over u of m(u) + 3 z k s(u),    z = root mean square of (w_i - m'(u_i)) / (k' s'(u_i))

m', s' and the factor k' of its deviations are of the Kriging without the worst fifth of the runs, asked at
those, and z is no less than 1; U is the larger of that of the model and of its cautious twin, and no less
than the bound of a search would be.

A search aims its runs at the worst case. The rows of a table stand anywhere, and their worst case is read off
beyond most of them, where a Kriging errs by more than between its runs: how much more is asked of the rows,
by making it predict the worst of them from the milder ones. A bound that lies further beyond than all runs
are apart says nothing, and none is stated. `studies/predicted_worst_cases.py` counts how often it covers.
"""

from dataclasses import replace
from math import inf

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.search.evidence.gap import BOUND_FACTOR, HOPELESS, Gap
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream

__all__ = ["UNPREDICTED", "extrapolation_error", "prediction_gap"]

LEFT_OUT, FEWEST = 0.2, 2  # share of the runs, the worst of them, and how many at least
EXACT = 1e-6  # of the range of the values: a smaller deviation, of an exact fit, is none
RANDOM_POINTS, CORNERS, REFINED = 4000, 2000, 2
UNPREDICTED = (
    "a Kriging without the worst fifth of the runs errs so much there that what is predicted could be "
    "further off than all runs lie apart"
)


def prediction_gap(
    gap: Gap, ledger: Ledger, model: SearchModel, success: SuccessChance, *, scale: str, seed: int
) -> Gap:
    """The `gap` of a search, widened by what the runs tell of extrapolation; without a bound where that is
    further than all runs are apart. `scale`: what the response is modelled on, "auto" or its name.
    """
    if ledger.is_flat or not np.isfinite(gap.width):
        return gap
    where, v = ledger.where, ledger.v
    best, spread = float(v.max()), float(np.ptp(v))
    error = extrapolation_error(where.features(ledger.u_ok), v, scale=scale, sign=ledger.sign, seed=seed)
    if not np.isfinite(error):
        return replace(gap, upper=inf, width=inf, note=UNPREDICTED)
    rng = stream(seed, "prediction gap")
    corners = rng.integers(0, 2, (CORNERS, where.dimension)).astype(float)
    points = where.snap(np.vstack([rng.random((RANDOM_POINTS, where.dimension)), corners, ledger.u]))

    def possible(u: np.ndarray) -> np.ndarray:
        allowed: np.ndarray = where.allowed(u) & (success.probability(where.features(u)) > HOPELESS)
        return allowed

    points = points[possible(points)]
    if not len(points):
        return gap
    predicted, upper = best, gap.upper
    for k, judge in (
        (0.0, model),
        *((BOUND_FACTOR * error, one) for one in (model, model.cautious or model)),
    ):

        def score(u: np.ndarray, judge: SearchModel = judge, k: float = k) -> np.ndarray:
            return np.where(possible(u), judge.bound(where.features(u), k), -np.inf)

        top = points[np.argsort(judge.bound(where.features(points), k))[-REFINED:]]
        reached = float(maximise_score(score, top, where.levels, sweeps=20)[1].max())
        predicted, upper = max(predicted, reached if k == 0.0 else best), max(upper, reached)
    if not upper - predicted <= spread:
        return replace(gap, upper=inf, width=inf, note=UNPREDICTED)
    return replace(gap, upper=upper, width=upper - best)


def extrapolation_error(
    features: np.ndarray, v: np.ndarray, *, scale: str = "auto", sign: float = 1.0, seed: int
) -> float:
    """The root mean square of the standardised errors at the worst fifth of the runs, features (n, p) and
    values v (n,), of a Kriging of the others; at least 1, and infinite where these are too few for one.
    """
    k = max(round(LEFT_OUT * len(v)), FEWEST)
    order = np.argsort(v, kind="stable")
    kept, worst = np.sort(order[:-k]), order[-k:]
    if len(kept) < FEWEST_RUNS or float(np.ptp(v[kept])) == 0.0:
        return inf
    milder = fit_search_model(features[kept], v[kept], previous=None, seed=seed, scale=scale, sign=sign)
    mean, std = milder.predict(features[worst])
    w = milder.transform.forward(v)
    sizes = (w[worst] - mean) / np.maximum(milder.inflation * std, EXACT * float(np.ptp(w)))
    return max(float(np.sqrt(np.mean(sizes**2))), 1.0)
