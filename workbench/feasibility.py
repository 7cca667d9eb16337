"""Where runs fail: a smooth map of the chance that a run succeeds, from the runs that did and did not.

    p(u) = (sum_i w_i ok_i + prior * w0) / (sum_i w_i + w0),    w_i = exp(-|u - u_i|^2 / (2 h^2))

a Nadaraya-Watson mean with one pseudo-run of success: far from any run nothing is held against a point. The
width h is half the median distance between neighbouring runs, so one failure shadows its own neighbourhood
only. Failed runs enter a search through this map and never as invented numbers.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.distance import cdist

__all__ = ["Feasibility"]

PRIOR_WEIGHT = 0.2  # of the one pseudo-run that succeeded everywhere


@dataclass(frozen=True, slots=True, kw_only=True)
class Feasibility:
    """`features` (n, p) of all runs, `ok` (n,) whether each gave a response, `width` h in units of the
    features.
    """

    features: np.ndarray
    ok: np.ndarray
    width: float

    @classmethod
    def of(cls, features: np.ndarray, ok: np.ndarray) -> "Feasibility":
        """The map for runs at `features` (n, p) of which `ok` (n,) succeeded."""
        width = 1.0
        if len(features) > 1:
            distance = cdist(features, features)
            np.fill_diagonal(distance, np.inf)
            width = max(0.5 * float(np.median(distance.min(axis=1))), 1e-3)
        return cls(features=features, ok=ok.astype(float), width=width)

    def probability(self, features: np.ndarray) -> np.ndarray:
        """Chance of success at (m, p); ones when no run has failed yet."""
        if self.ok.all():
            return np.ones(len(features))
        weight = np.exp(-0.5 * (cdist(features, self.features) / self.width) ** 2)
        return (weight @ self.ok + PRIOR_WEIGHT) / (weight.sum(axis=1) + PRIOR_WEIGHT)
