"""Where runs fail: the chance that a run succeeds, from the nearest that did and the nearest that did not.

    p(u) = 1 / (1 + exp(-s (d_failed - d_ok) / (d_failed + d_ok)))

d_ok and d_failed are the distances to the nearest run of either kind. The map has no length of its own:
half way between a success and a failure the chance is even, so a search that is drawn into a failing region
closes in on its border by bisection. Failed runs enter a search through this map and never as invented
numbers.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

from surrogates import Kriging

__all__ = ["Feasibility"]

FEWEST_OF_EACH = 3  # successes and failures before a metric is learnt
INDICATOR_NUGGET = 1e-2
STARTS = 4
LEAST_WEIGHT = 1e-3  # of the largest theta: no input is left out of the metric altogether
SHARPNESS = 4.0  # s: the chance is 0.98 at a success and 0.02 at a failure


@dataclass(frozen=True, slots=True, kw_only=True)
class Feasibility:
    """`features` (n, p) of all runs, `ok` (n,) whether each gave a response, `metric` (p,) weights of the
    squared differences."""

    features: np.ndarray
    ok: np.ndarray
    metric: np.ndarray

    @classmethod
    def of(
        cls, features: np.ndarray, ok: np.ndarray, *, seed: int = 0, least_weight: float = LEAST_WEIGHT
    ) -> "Feasibility":
        """The map for runs at `features` (n, p) of which `ok` (n,) succeeded; no weight of an input is below
        `least_weight` of the largest.

        >>> runs = Feasibility.of(np.array([[0.0], [1.0]]), np.array([True, False]))
        >>> runs.probability(np.array([[0.0], [0.5], [1.0]])).round(2).tolist()
        [0.98, 0.5, 0.02]
        """
        metric = np.ones(features.shape[1])
        if min(ok.sum(), (~ok).sum()) >= FEWEST_OF_EACH:
            kriging = Kriging(
                correlation="gaussian",
                trend="constant",
                nugget=INDICATOR_NUGGET,
                n_starts=STARTS,
                intervals="plug-in",
                seed=seed,
            ).fit(features, ok.astype(float))
            metric = np.maximum(kriging.theta_, least_weight * kriging.theta_.max())
        return cls(features=features, ok=ok, metric=metric)

    def probability(self, features: np.ndarray) -> np.ndarray:
        """Chance of success at (m, p); ones when no run has failed, a half when none has succeeded."""
        if self.ok.all():
            return np.ones(len(features))
        if not self.ok.any():
            return np.full(len(features), 0.5)
        scale = np.sqrt(self.metric)
        to_ok = cdist(features * scale, self.features[self.ok] * scale).min(axis=1)
        to_failed = cdist(features * scale, self.features[~self.ok] * scale).min(axis=1)
        margin = (to_failed - to_ok) / np.maximum(to_failed + to_ok, 1e-12)
        return 1.0 / (1.0 + np.exp(-SHARPNESS * margin))
