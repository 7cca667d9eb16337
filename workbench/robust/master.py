"""The outer problem of a minimax cycle, solved on the prediction: the master.

    min over x of max over a finite set of scenarios of m(x, u)

The set grows by the answers of the inner problem (`workbench.robust.scenarios`) until none is worse: cutting
sets, Mutapcic and Boyd 2009. Each master is solved in its epigraph form, min t with m(x, u_i) <= t, by SLSQP
from the best of random designs; with levels or constraints by pattern search; with categories by both in
turn.

Where runs have failed, the master also counts scenarios that ran elsewhere and are not likely to fail, and a
design without a likely scenario is no candidate. Pattern search, which keeps to the borders of failing
regions, then follows SLSQP.
"""

import numpy as np
from scipy.optimize import minimize

from workbench.robust.joint_prediction import JointPrediction
from workbench.robust.joint_runs import LEAST_CHANCE, JointRuns, Region
from workbench.robust.scenarios import worst_scenario
from workbench.search.surrogate.pattern_search import maximise_score
from workbench.space.streams import stream

__all__ = ["robust_design"]

Array = np.ndarray

DOUBTFUL = 0.2  # chance from which a scenario counts: no design shall look good because runs may fail there
PROBES = 8  # scenarios that a master problem after failures holds besides the accumulated ones
HALVINGS = 12


def robust_design(
    runs: JointRuns, model: JointPrediction, region: Region, replicate: int
) -> tuple[Array, float]:
    """argmin over the region of the worst prediction, scenarios added until none is worse."""
    rng = stream(runs.seed, "minimax master", replicate=replicate)
    low, high = runs.design_box(region)
    candidates = low + rng.random((300, runs.dx)) * (high - low)
    candidates = runs.design.snap(np.vstack([candidates, region.centre]))
    candidates = candidates[runs.design.allowed(candidates)]
    if runs.has_failures or not len(candidates):
        known = runs.z[np.isfinite(runs.y), : runs.dx]
        inside = np.all((known >= low - 1e-12) & (known <= high + 1e-12), axis=1)
        candidates = np.vstack([candidates, known[inside] if inside.any() else known])
    scenarios = [*runs.scenarios[-60:]] or [np.full(runs.du, 0.5)]
    if runs.has_failures:
        probes = runs.uncertain.snap(rng.random((PROBES, runs.du)))
        scenarios += [*probes[runs.uncertain.allowed(probes)]]
    x, value, worst = candidates[0], np.inf, -np.inf
    for round_ in range(12):
        x, value = _Master(runs, model, np.array(scenarios), low, high).solve(candidates)
        u, worst = worst_scenario(runs, model, x, replicate * 100 + round_)
        if worst <= value + 1e-7 * (1 + abs(value)):
            break
        scenarios.append(u)
        candidates = np.vstack([candidates, x])
    return x, max(value, worst)


class _Master:
    """min over x of max over a finite set of scenarios (m, du), on the prediction."""

    def __init__(
        self, runs: JointRuns, model: JointPrediction, scenarios: Array, low: Array, high: Array
    ) -> None:
        self.runs, self.model, self.scenarios, self.low, self.high = runs, model, scenarios, low, high
        # a scenario that has run somewhere counts unless it is likely to fail, one only thought of if it is
        # likely to run
        has_run = np.arange(len(scenarios)) < len(runs.scenarios[-60:])
        self.least = np.where(has_run, DOUBTFUL, LEAST_CHANCE)

    def solve(self, candidates: Array) -> tuple[Array, float]:
        """The best design (dx,) from the best of `candidates`, and its worst predicted value."""
        runs = self.runs
        worst = self.worst(candidates)
        if not np.isfinite(worst).any():
            return self._likeliest(candidates)
        order = np.argsort(worst)[:3]
        starts = candidates[order][np.isfinite(worst[order])]
        has_levels = any(grid is not None for grid in runs.design.levels)
        scale = max(float(np.ptp(worst[np.isfinite(worst)])), 1e-12)
        if has_levels or runs.design.space.constraints:
            starts, scores = maximise_score(self._score, starts, runs.design.levels)
            if not any(runs.design.categorical) or runs.design.is_finite:
                return starts[int(np.argmax(scores))], float(-scores.max())
            best_x, best = starts[int(np.argmax(scores))], float(-scores.max())
        else:
            best_x, best = starts[0], float(worst[order[0]])
        for start in starts:
            x = self._descended(start, scale)
            value = float(self.worst(x[None])[0])
            if value < best:
                best_x, best = x, value
        if runs.has_failures:
            points, scores = maximise_score(self._score, best_x[None], runs.design.levels, step=0.02)
            best_x, best = points[0], float(-scores[0])
        return best_x, best

    def values(self, x: Array) -> Array:
        """Predictions (n, m) at the designs x (n, dx) in all scenarios."""
        return self.model.mean(self._grid(x)).reshape(len(x), len(self.scenarios))

    def worst(self, x: Array) -> Array:
        """The worst of those that are likely to run, (n,); inf where none is."""
        values = self.values(x)
        if not self.runs.has_failures:
            worst: Array = values.max(axis=1)
            return worst
        chance = self.model.chance(self._grid(x)).reshape(values.shape)
        counted = np.where(chance >= self.least, values, -np.inf).max(axis=1)
        return np.where(chance.max(axis=1) >= LEAST_CHANCE, counted, np.inf)

    def chance(self, x: Array) -> Array:
        """The chance of designs x (n, dx) in the scenario that is likeliest to run there, (n,)."""
        chance: Array = self.model.chance(self._grid(x)).reshape(len(x), -1).max(axis=1)
        return chance

    def _grid(self, x: Array) -> Array:
        return np.column_stack(
            [np.repeat(x, len(self.scenarios), axis=0), np.tile(self.scenarios, (len(x), 1))]
        )

    def _likeliest(self, candidates: Array) -> tuple[Array, float]:
        """Where no candidate is likely to run: the one that is most so."""
        x = candidates[int(np.argmax(self.chance(candidates)))]
        return x, float(self.values(x[None]).max())

    def _score(self, points: Array) -> Array:
        inside = np.all((points >= self.low - 1e-12) & (points <= self.high + 1e-12), axis=1)
        return np.where(inside & self.runs.design.allowed(points), -self.worst(points), -np.inf)

    def _descended(self, start: Array, scale: float) -> Array:
        """SLSQP from `start` over the continuous coordinates, in the scenarios that are likely to run there;
        drawn back towards `start` where it ends at a design that is not."""
        runs = self.runs
        free = np.array([grid is None for grid in runs.design.levels])
        step = 1e-6 * np.maximum(self.high - self.low, 1e-6)[free]
        n = int(free.sum())
        low, high = self.low[free], self.high[free]
        active = np.ones(len(self.scenarios), dtype=bool)
        if runs.has_failures:
            active = self.model.chance(self._grid(start[None])) >= self.least

        def designs(points: Array) -> Array:
            full = np.repeat(start[None], len(points), axis=0)
            full[:, free] = points
            return full

        def below(points: Array) -> Array:
            """What must not exceed (t, ..., t, 0): predictions, and after failures the lack of chance."""
            x = designs(points)
            f = self.values(x)[:, active] / scale
            return f if not runs.has_failures else np.column_stack([f, LEAST_CHANCE - self.chance(x)])

        def constraints(p: Array) -> Array:
            return p[-1] * is_value - below(p[None, :-1])[0]

        def slopes(p: Array) -> Array:
            f = below(np.vstack([p[:-1] + np.diag(step), p[:-1] - np.diag(step)]))
            gradient = (f[:n] - f[n:]).T / (2 * step)
            return np.column_stack([-gradient, is_value])

        is_value = np.ones(int(active.sum()) + runs.has_failures)
        is_value[active.sum() :] = 0.0

        objective_slope = np.concatenate([np.zeros(n), [1.0]])
        first = self.values(start[None])[0, active].max() / scale
        found = minimize(  # type: ignore[call-overload]
            lambda p: p[-1],
            np.concatenate([start[free], [first]]),
            jac=lambda p: objective_slope,
            bounds=[*zip(low, high, strict=True), (None, None)],
            constraints={"type": "ineq", "fun": constraints, "jac": slopes},
            method="SLSQP",
            options={"maxiter": 60, "ftol": 1e-10},
        )
        end = designs(np.clip(found.x[None, :-1], low, high))[0]
        return self._drawn_back(start, end)

    def _drawn_back(self, start: Array, end: Array) -> Array:
        """The farthest point from `start` towards `end` that is allowed and likely to run, by halving."""

        def fits(x: Array) -> bool:
            return bool(np.isfinite(self._score(x[None])[0]))

        if not (self.runs.has_failures or self.runs.design.space.constraints) or fits(end):
            return end
        inner, outer = 0.0, 1.0
        for _ in range(HALVINGS):
            middle = 0.5 * (inner + outer)
            inner, outer = (middle, outer) if fits(start + middle * (end - start)) else (inner, middle)
        return start + inner * (end - start)
