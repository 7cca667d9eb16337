"""The Kriging of a minimax search: all runs near the present design, in design and uncertainty together."""

from dataclasses import dataclass

import numpy as np

from surrogates import Kriging
from workbench.joint_runs import JointRuns, design_box

__all__ = ["JointPrediction", "fit_near"]

Array = np.ndarray


@dataclass(frozen=True, slots=True)
class JointPrediction:
    """A Kriging in the shifted and scaled coordinates of the present box."""

    runs: JointRuns
    kriging: Kriging
    shift: Array
    span: Array

    def mean(self, z: Array) -> Array:
        """Predicted values at z (m, dx + du)."""
        values: Array = self.kriging.predict(_features(self.runs, (z - self.shift) / self.span))
        return values


def fit_near(runs: JointRuns, centre: Array, box: float) -> JointPrediction:
    """Kriging of the runs whose design lies in twice the box around `centre` (dx,); of the nearest runs when
    those are too few."""
    ok = np.isfinite(runs.y)
    d = runs.dimension
    quadratic = (d + 1) * (d + 2) // 2
    low, high = design_box(centre, 2 * box)
    x = runs.z[:, : runs.dx]
    near = ok & np.all((x >= low - 1e-12) & (x <= high + 1e-12), axis=1)
    if near.sum() < d + 4:
        distance = np.where(ok, np.abs(x - centre).max(axis=1), np.inf)
        near = np.zeros(len(x), dtype=bool)
        near[np.argsort(distance, kind="stable")[: min(int(ok.sum()), quadratic + d)]] = True
        low, high = x[near].min(axis=0), x[near].max(axis=0)
    trend = "quadratic" if near.sum() >= quadratic + 3 else "linear" if near.sum() >= d + 3 else "constant"
    span = np.concatenate([np.maximum(high - low, 1e-9), np.ones(runs.du)])
    shift = np.concatenate([low, np.zeros(runs.du)])
    z, first = np.unique(runs.z[near], axis=0, return_index=True)
    features = _features(runs, (z - shift) / span)
    kriging = Kriging(trend=trend, correlation="gaussian", nugget=1e-10, seed=runs.seed)
    return JointPrediction(runs, kriging.fit(features, runs.y[near][first]), shift, span)


def _features(runs: JointRuns, z: Array) -> Array:
    return np.column_stack([runs.design.features(z[:, : runs.dx]), runs.uncertain.features(z[:, runs.dx :])])
