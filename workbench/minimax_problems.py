"""The two problems of a minimax cycle, solved on the prediction.

    inner (the oracle)   max over u of m(x, u) at one design x
    outer (the master)   min over x of max over a finite set of scenarios, which grows by the inner problem's
                         answers until none is worse (cutting sets, Mutapcic and Boyd 2009)

The outer problem is solved in its epigraph form, min t with m(x, u_i) <= t, by SLSQP from the best of random
designs; with levels or constraints by pattern search.
"""

import numpy as np
from scipy.optimize import minimize

from workbench.infill import maximise_score
from workbench.joint_prediction import JointPrediction
from workbench.joint_runs import JointRuns, design_box
from workbench.streams import stream

__all__ = ["robust_design", "worst_scenario"]

Array = np.ndarray


def worst_scenario(runs: JointRuns, model: JointPrediction, x: Array, replicate: int) -> tuple[Array, float]:
    """argmax over u of the prediction at x, and its value."""
    rng = stream(runs.seed, "minimax oracle", replicate=replicate)
    pool = [
        rng.random((400, runs.du)),
        rng.integers(0, 2, (64, runs.du)).astype(float),
        *runs.scenarios[-40:],
    ]
    u = runs.uncertain.snap(np.vstack(pool))
    u = u[runs.uncertain.allowed(u)]

    def score(points: Array) -> Array:
        value = model.mean(np.column_stack([np.repeat(x[None], len(points), axis=0), points]))
        return np.where(runs.uncertain.allowed(points), value, -np.inf)

    scores = score(u)
    points, values = maximise_score(score, u[np.argsort(scores)[-5:]], runs.uncertain.levels, sweeps=30)
    best = int(np.argmax(values))
    return points[best], float(values[best])


def robust_design(
    runs: JointRuns, model: JointPrediction, centre: Array, box: float, replicate: int
) -> tuple[Array, float]:
    """argmin over the design box of the worst prediction, scenarios added until none is worse."""
    rng = stream(runs.seed, "minimax master", replicate=replicate)
    low, high = design_box(centre, box)
    candidates = low + rng.random((300, runs.dx)) * (high - low)
    candidates = runs.design.snap(np.vstack([candidates, centre]))
    candidates = candidates[runs.design.allowed(candidates)]
    scenarios = [*runs.scenarios[-60:]] or [np.full(runs.du, 0.5)]
    x, value = candidates[0], np.inf
    for round_ in range(12):
        x, value = _finite_minimax(runs, model, candidates, np.array(scenarios), low, high)
        u, worst = worst_scenario(runs, model, x, replicate * 100 + round_)
        if worst <= value + 1e-7 * (1 + abs(value)):
            break
        scenarios.append(u)
        candidates = np.vstack([candidates, x])
    return x, max(value, worst)


def _finite_minimax(
    runs: JointRuns, model: JointPrediction, candidates: Array, scenarios: Array, low: Array, high: Array
) -> tuple[Array, float]:
    """min over x of max over a finite set of scenarios, on the prediction."""
    m = len(scenarios)

    def values(x: Array) -> Array:
        z = np.column_stack([np.repeat(x, m, axis=0), np.tile(scenarios, (len(x), 1))])
        return model.mean(z).reshape(len(x), m)

    worst = values(candidates).max(axis=1)
    order = np.argsort(worst)[:3]
    if any(grid is not None for grid in runs.design.levels) or runs.design.space.constraints:

        def score(points: Array) -> Array:
            inside = np.all((points >= low - 1e-12) & (points <= high + 1e-12), axis=1)
            return np.where(inside & runs.design.allowed(points), -values(points).max(axis=1), -np.inf)

        points, scores = maximise_score(score, candidates[order], runs.design.levels)
        return points[int(np.argmax(scores))], float(-scores.max())
    best_x, best = candidates[order[0]], float(worst[order[0]])
    step = 1e-6 * np.maximum(high - low, 1e-6)
    scale = max(float(np.ptp(worst)), 1e-12)

    def constraints(p: Array) -> Array:
        return p[-1] - values(p[None, :-1])[0] / scale

    def slopes(p: Array) -> Array:
        shifted = np.vstack([p[:-1] + np.diag(step), p[:-1] - np.diag(step)])
        f = values(shifted) / scale
        gradient = (f[: runs.dx] - f[runs.dx :]).T / (2 * step)
        return np.column_stack([-gradient, np.ones(m)])

    objective_slope = np.concatenate([np.zeros(runs.dx), [1.0]])
    for start in candidates[order]:
        p0 = np.concatenate([start, [values(start[None]).max() / scale]])
        found = minimize(  # type: ignore[call-overload]
            lambda p: p[-1],
            p0,
            jac=lambda p: objective_slope,
            bounds=[*zip(low, high, strict=True), (None, None)],
            constraints={"type": "ineq", "fun": constraints, "jac": slopes},
            method="SLSQP",
            options={"maxiter": 60, "ftol": 1e-10},
        )
        x = np.clip(found.x[:-1], low, high)
        value = float(values(x[None]).max())
        if value < best:
            best_x, best = x, value
    return best_x, best
