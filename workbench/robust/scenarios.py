"""The inner problem of a minimax cycle, solved on the prediction: max over u of m(x, u) at one design x.

Where runs have failed, the worst case of a design is the worst that can be run: proposed are scenarios that
are as likely to run as not, and those that only runs at other designs say fail.
"""

from dataclasses import replace

import numpy as np

from workbench.robust.joint_prediction import JointPrediction
from workbench.robust.joint_runs import LEAST_CHANCE, JointRuns
from workbench.search.surrogate.feasibility import Feasibility
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream

__all__ = ["doubted_scenario", "safest_scenario", "worst_scenario"]

Array = np.ndarray

STARTS, STARTS_AFTER_FAILURES = 5, 10


def worst_scenario(
    runs: JointRuns, model: JointPrediction, x: Array, replicate: int, *, below: float = np.inf
) -> tuple[Array, float]:
    """argmax over u of the prediction at x that is `below` a value, and the prediction; -inf when no such run
    at x is likely to give a value."""
    u = _pool(runs, replicate)

    def score(points: Array) -> Array:
        z = _at(x, points)
        possible, mean = runs.uncertain.allowed(points), model.mean(z)
        if runs.has_failures:
            possible &= model.runnable(z) & (mean <= below)
        return np.where(possible, mean, -np.inf)

    scores = score(u)
    starts = STARTS_AFTER_FAILURES if runs.has_failures else STARTS
    points, values = maximise_score(score, u[np.argsort(scores)[-starts:]], runs.uncertain.levels, sweeps=30)
    best = int(np.argmax(values))
    return points[best], float(values[best])


def doubted_scenario(
    runs: JointRuns, model: JointPrediction, x: Array, replicate: int
) -> tuple[Array, float]:
    """argmax over u of the prediction at x where runs at other designs say that it fails but those at x do
    not, and its value; -inf when there is no such scenario."""
    u = _pool(runs, replicate)
    here = runs.at_design(x)
    own = Feasibility.of(runs.uncertain.features(runs.z[here, runs.dx :]), np.isfinite(runs.y[here]))
    own = replace(own, metric=np.ones(own.features.shape[1]))  # too few runs to tell what matters

    def score(points: Array) -> Array:
        z = _at(x, points)
        likely_here = own.probability(runs.uncertain.features(points)) >= LEAST_CHANCE
        possible = runs.uncertain.allowed(points) & likely_here & ~model.runnable(z)
        return np.where(possible, model.mean(z), -np.inf)

    scores = score(u)
    starts = u[np.argsort(scores)[-STARTS_AFTER_FAILURES:]]
    points, values = maximise_score(score, starts, runs.uncertain.levels, sweeps=30)
    best = int(np.argmax(values))
    return points[best], float(values[best])


def safest_scenario(runs: JointRuns, model: JointPrediction, x: Array, replicate: int) -> Array:
    """The u at which a run at x is most likely to give a value."""
    u = _pool(runs, replicate)
    point: Array = u[int(np.argmax(model.chance(_at(x, u))))]
    return point


def _pool(runs: JointRuns, replicate: int) -> Array:
    """Random scenarios, random corners, those accumulated, and after failures those that have run."""
    rng = stream(runs.seed, "minimax oracle", replicate=replicate)
    pool = [
        rng.random((400, runs.du)),
        rng.integers(0, 2, (64, runs.du)).astype(float),
        *runs.scenarios[-40:],
    ]
    if runs.has_failures:
        pool.append(runs.z[np.isfinite(runs.y), runs.dx :])
    u = runs.uncertain.snap(np.vstack(pool))
    allowed: Array = u[runs.uncertain.allowed(u)]
    # tight constraints may leave none of these
    return allowed if len(allowed) else np.unique(runs.z[:, runs.dx :], axis=0)


def _at(x: Array, u: Array) -> Array:
    return np.column_stack([np.repeat(x[None], len(u), axis=0), u])
