"""The Kriging behind a worst-case search, and what a search asks of it.

The search maximises v = +y or -y. The model predicts w(v), w a monotone transform (see
`surrogates.analysis.search_scale`), so the maximiser of v and the expected improvement carry over;
bounds in units of y go through the inverse transform.
"""

from dataclasses import dataclass

import numpy as np

from surrogates import Kriging
from surrogates.analysis.search_scale import NamedScale, OutputTransform
from workbench.search.surrogate.expected_improvement import log_expected_improvement

__all__ = ["SearchModel"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchModel:
    """A fitted Kriging of w(v). `inflation` scales its standard deviations by leave-one-out; `cautious` is
    its twin that takes no input for inert.
    """

    kriging: Kriging
    transform: OutputTransform | NamedScale
    trend: str
    best: float  # largest v among the runs
    noticeable: float  # gain of v over `best` that is worth a run
    scale: float  # standard deviation of w(v) over the runs
    inflation: float
    q2: float
    n_runs: int
    likelier_by: float = 0.0  # what the transform gains over none, in log-likelihood, where that chose it
    chosen_at: int = 0  # number of runs when trend, transform and nugget were chosen
    cautious: "SearchModel | None" = None

    def predict(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Mean and standard deviation of w(v), (n,) each."""
        return self.kriging.posterior_.mean_and_std(np.ascontiguousarray(features))

    @property
    def correlation(self) -> str:
        """Kind of the correlation in force."""
        return str(self.kriging.correlation)

    def mean(self, features: np.ndarray) -> np.ndarray:
        """Predicted v (the median of its predictive law when a transform is in force)."""
        return self.transform.inverse(self.predict(features)[0])

    def bound(self, features: np.ndarray, k: float) -> np.ndarray:
        """Upper bound of v, k inflated standard deviations above the mean, in units of v."""
        mean, std = self.predict(features)
        return self.transform.inverse(mean + k * self.inflation * std)

    def transformed_bound(self, features: np.ndarray, k: float) -> np.ndarray:
        """The same bound in transformed units, for ranking."""
        mean, std = self.predict(features)
        return mean + k * self.inflation * std

    def promises(self, features: np.ndarray, k: float) -> bool:
        """Whether any of the points may exceed the best run by a noticeable amount, k deviations allowed."""
        return bool((self.bound(features, k) > self.best + self.noticeable).any())

    def in_units(self, features: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Predicted v and half the width of its one-standard-deviation interval, in units of v."""
        mean, std = self.predict(features)
        low, high = self.transform.inverse(mean - std), self.transform.inverse(mean + std)
        return self.transform.inverse(mean), 0.5 * (high - low)

    def log_ei(self, features: np.ndarray, target: float | None = None) -> np.ndarray:
        """Log expected improvement, transformed: over the best run by a noticeable gain, or over `target`.

        A smaller gain is worth no run, and to seek it keeps a search at a peak that it knows.
        """
        mean, std = self.predict(features)
        over = self.best + self.noticeable if target is None else target
        return log_expected_improvement(mean, std, float(self.transform.forward(np.array([over]))[0]))
