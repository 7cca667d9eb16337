"""The Kriging of a minimax search: all runs near the present design, in design and uncertainty together.

Runs that failed enter by the chance that a run succeeds (`workbench.search.surrogate.feasibility`), never as
numbers.
"""

from dataclasses import dataclass, replace

import numpy as np

from surrogates import Kriging
from workbench.robust.joint_runs import LEAST_CHANCE, JointRuns, Region
from workbench.robust.joint_trend import MixedTrend, largest_trend
from workbench.search.surrogate.feasibility import Feasibility

__all__ = ["JointPrediction", "fit_near"]

Array = np.ndarray

NUGGETS = (1e-10, 1e-8, 1e-6, 1e-4)  # relative to the process variance; the first that can be solved


@dataclass(frozen=True, slots=True)
class JointPrediction:
    """A Kriging in the shifted and scaled coordinates of the present box; `feasibility` is None as long as
    no run has failed. `doubt`: by how many of its standard deviations its values are taken lower."""

    runs: JointRuns
    kriging: Kriging
    shift: Array
    span: Array
    feasibility: Feasibility | None
    doubt: float = 0.0

    def mean(self, z: Array) -> Array:
        """Predicted values at z (m, dx + du), less the doubt."""
        features = self.runs.features((z - self.shift) / self.span)
        if not self.doubt:
            values: Array = self.kriging.predict(features)
            return values
        mean, deviation = self.kriging.predict(features, return_std=True)
        lowered: Array = mean - self.doubt * deviation
        return lowered

    def chance(self, z: Array) -> Array:
        """Chance that a run at z (m, dx + du) gives a value."""
        if self.feasibility is None:
            return np.ones(len(z))
        return self.feasibility.probability(self.runs.features(z))

    def runnable(self, z: Array) -> Array:
        """Where a run is as likely to give a value as not, (m,) of bool. Proposals half way between a success
        and a failure bisect the border of the failing region."""
        return self.chance(z) >= LEAST_CHANCE

    def after_failure(self) -> "JointPrediction":
        """The same prediction with the failures since; a failed run brings no value to fit."""
        return replace(self, feasibility=self.runs.feasibility())


def fit_near(runs: JointRuns, region: Region) -> JointPrediction:
    """Kriging of the runs whose design lies in twice the region; of the nearest runs when those are too few.

    A region never tells categories apart: which are near is for the Kriging to say.
    """
    ok = np.isfinite(runs.y)
    d = runs.free_features
    quadratic = (d + 1) * (d + 2) // 2
    low, high = runs.design_box(replace(region, width=2 * region.width))
    x = runs.z[:, : runs.dx]
    near = ok & np.all((x >= low - 1e-12) & (x <= high + 1e-12), axis=1)
    category = np.array(runs.design.categorical, dtype=bool)
    if near.sum() < d + 4:
        apart = np.where(category, 0.0, np.abs(x - region.centre))
        distance = np.where(ok, apart.max(axis=1), np.inf)
        near = np.zeros(len(x), dtype=bool)
        near[np.argsort(distance, kind="stable")[: min(int(ok.sum()), quadratic + d)]] = True
        low, high = x[near].min(axis=0), x[near].max(axis=0)
    # indicators of levels are read off the coordinate itself
    low, high = np.where(category, 0.0, low), np.where(category, 1.0, high)
    span = np.concatenate([np.maximum(high - low, 1e-9), np.ones(runs.du)])
    shift = np.concatenate([low, np.zeros(runs.du)])
    z, first = np.unique(runs.z[near], axis=0, return_index=True)
    features = runs.features((z - shift) / span)
    trend = largest_trend((runs.design, runs.uncertain), int(near.sum()))
    kriging = _fitted(features, runs.y[near][first], trend, seed=runs.seed)
    return JointPrediction(runs, kriging, shift, span, runs.feasibility())


def _fitted(features: Array, y: Array, trend: str | MixedTrend, *, seed: int) -> Kriging:
    """A Kriging of the runs; of a larger nugget, then of a smaller trend, where they do not carry it.

    Runs that close in on the border of a failing region may be too close for the smallest nugget.
    """
    attempts = [(form, nugget) for form in dict.fromkeys((trend, "constant")) for nugget in NUGGETS]
    for form, nugget in attempts:
        kriging = Kriging(trend=form, correlation="gaussian", nugget=nugget, intervals="plug-in", seed=seed)
        try:
            fitted: Kriging = kriging.fit(features, y)
        except ValueError:  # NotPositiveDefinite and TooFewRuns are
            if (form, nugget) == attempts[-1]:
                raise
        else:
            return fitted
    raise AssertionError("unreachable: the last attempt returns or raises")
