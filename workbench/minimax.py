"""Designs that survive their worst case: min over x of max over u of f(x, u), by cutting sets on a joint
Kriging.

    result = minimax(function, design_space, uncertainty, budget=300, seed=0)

Each cycle

    1. fits a Kriging to all runs near the present design, in design and uncertainty together;
    2. master: x = argmin max over the accumulated scenarios of the prediction; the oracle on the prediction
       adds scenarios until none is worse (Mutapcic and Boyd 2009, cutting sets with a pessimising oracle);
    3. oracle: the true f is run at x in the predicted worst scenarios until the prediction finds nothing
       worse than the worst true run there: the upper bound of this x;
    4. prints the lower bound (the master's value, model-based) and the upper bound (true runs), and zooms the
       design box around x when prediction and truth agree.

Scenarios are accumulated, never replaced; `to_dict` keeps them, and a later search may begin with them. The
returned value is the largest true run at the returned design. The search is a function of the seed and of the
answers: with an evaluator that remembers its runs it resumes by being asked again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from typing import Any

import numpy as np
from scipy.optimize import minimize

import doe
from surrogates import Kriging
from workbench.errors import NotEnoughRuns, StudyError
from workbench.evaluator import Evaluator, FunctionEvaluator, Reading, response_reader
from workbench.infill import maximise_score
from workbench.scenarios import scenario_points
from workbench.search_space import SearchSpace
from workbench.space import Space
from workbench.streams import stream

__all__ = ["Cycle", "Minimax", "MinimaxStatus", "minimax"]

Array = np.ndarray

START_PER_DIMENSION = 8
RUNS_TO_ZOOM = 2  # new runs per coordinate in a zoomed box
SMALLEST_BOX = 2e-3
ORACLE_RUNS = 6  # true runs per cycle at one design, at most
SAME = 1e-6  # of the unit cube: closer points are one point
QUIET_CYCLES = 2
SETTLED = 1e-4  # relative: a predicted worst this close to the worst run counts as confirmed
RE_EXAMINED = 4


class MinimaxStatus(Enum):
    """Why the search stopped."""

    CONVERGED = "lower and upper bound met within the tolerance"
    BUDGET = "the budget of runs was spent"


@dataclass(frozen=True, slots=True, kw_only=True)
class Cycle:
    """One cycle: bounds after `evaluations` runs. `lower` is the master's value on the Kriging (model-based),
    `upper` the worst true run at this cycle's design, `best` the lowest upper bound so far."""

    number: int
    evaluations: int
    lower: float
    upper: float
    best: float
    box: float
    design: Mapping[str, Any]
    scenario: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Minimax:
    """The design with the lowest confirmed worst case, its worst scenario, and all cycles."""

    design: Mapping[str, Any]
    scenario: Mapping[str, Any]
    value: float
    lower: float
    status: MinimaxStatus
    cycles: tuple[Cycle, ...]
    scenarios: tuple[Mapping[str, Any], ...]
    evaluations: int
    budget: int
    seed: int
    failures: int

    @property
    def gap(self) -> float:
        """Upper minus lower bound at the end; the lower bound is model-based."""
        return max(self.value - self.lower, 0.0)

    def to_dict(self) -> dict[str, Any]:
        """For a JSON document: bounds of every cycle and the scenarios, to begin another search with."""
        return {
            **asdict(self),
            "status": self.status.value,
            "gap": self.gap,
            "cycles": [asdict(cycle) for cycle in self.cycles],
            "scenarios": [dict(scenario) for scenario in self.scenarios],
        }


def minimax(
    function: Callable[[Mapping[str, Any], Mapping[str, Any]], Any],
    design_space: Space,
    uncertainty: Space,
    *,
    response: str | Reading | None = None,
    budget: int = 300,
    seed: int = 0,
    tolerance: float = 2e-3,
    evaluator: Evaluator | None = None,
    progress: Callable[[Cycle], None] | None = None,
    scenarios: Sequence[Mapping[str, Any]] = (),
) -> Minimax:
    """Minimise over designs the maximum over the uncertainty of `function(design, uncertainty)`.

    Args:
        function: takes two mappings of names to values; returns a float or a mapping of responses.
        design_space: what may be chosen. uncertainty: what may happen. Names must differ between the two.
        response: a name or a function of the mapping of outputs.
        budget: true runs, at least 3 per coordinate.
        tolerance: stop when upper - lower is below this share of the value (or of 1 % of the spread of the
            values, when that is more) in two cycles.
        evaluator: stores runs of rows that hold the names of both spaces; `function` is then not called here.
        progress: called after every cycle.
        scenarios: points of the uncertainty that every master problem holds from the first cycle on: known
            worst cases, or those of an earlier search.

    Raises:
        StudyError: shared names, budget too small, a scenario outside the uncertainty, constraints that leave
            no point.
        NotEnoughRuns: fewer than half of the start design gave a value.

    >>> from workbench import Parameter
    >>> choice = Space([Parameter("x", lower=0, upper=10)])
    >>> danger = Space([Parameter("u", lower=0, upper=10)])
    >>> result = minimax(lambda x, u: (x["x"] - 5) ** 2 - (u["u"] - 5) ** 2, choice, danger, budget=60)
    >>> abs(result.value) < 0.01
    True
    """
    shared = sorted(set(design_space.names) & set(uncertainty.names))
    if shared:
        raise StudyError(f"design and uncertainty share the names {shared}; rename them in one of the spaces")
    if evaluator is None:

        def joint(**row: Any) -> Any:
            x = {name: row[name] for name in design_space.names}
            return function(x, {name: row[name] for name in uncertainty.names})

        evaluator = FunctionEvaluator(joint)
    game = _Game(
        design=SearchSpace.of(design_space),
        uncertain=SearchSpace.of(uncertainty),
        evaluate=evaluator,
        read=response_reader(response),
        budget=budget,
        seed=seed,
    )
    game.scenarios += list(scenario_points(uncertainty, scenarios))
    return game.play(tolerance=tolerance, progress=progress)


class _Game:
    """The runs of a minimax search and its moves. z = (x, u) in the joint unit cube."""

    def __init__(
        self,
        *,
        design: SearchSpace,
        uncertain: SearchSpace,
        evaluate: Evaluator,
        read: Reading,
        budget: int,
        seed: int,
    ) -> None:
        self.design, self.uncertain = design, uncertain
        self.evaluate, self.read = evaluate, read
        self.budget, self.seed = budget, seed
        self.dx, self.du = design.dimension, uncertain.dimension
        self.z = np.empty((0, self.dx + self.du))
        self.y = np.empty(0)  # NaN where the run failed
        self.scenarios: list[Array] = []
        self.tried: list[Array] = []  # designs run in their predicted worst scenario
        least = 3 * (self.dx + self.du)
        if budget < least:
            raise StudyError(
                f"budget={budget} is below 3 runs per coordinate, {least} for {self.dx} design and {self.du} "
                "uncertain parameters; raise it"
            )

    # -- true runs
    # ----------------------------------------------------------------------------------------------

    @property
    def left(self) -> int:
        return self.budget - len(self.y)

    def run(self, z: Array, purpose: str) -> Array:
        """True values at z (m, d), NaN where failed; at most as many as the budget allows."""
        z = np.array(z[: max(self.left, 0)], ndmin=2).reshape(-1, self.dx + self.du)
        if not len(z):
            return np.empty(0)
        x_rows, u_rows = self.design.rows(z[:, : self.dx]), self.uncertain.rows(z[:, self.dx :])
        rows = [{**x, **u} for x, u in zip(x_rows, u_rows, strict=True)]
        outcomes = self.evaluate(rows, purpose=purpose)
        y = np.array([self.read(o.outputs) if o.status == "ok" else np.nan for o in outcomes])
        self.z, self.y = np.vstack([self.z, z]), np.concatenate([self.y, y])
        return y

    def fill(self, count: int, *, centre: Array, box: float, replicate: int) -> None:
        """Run `count` space-filling points with x inside the box around `centre`."""
        count = min(count, self.left)
        if count < 1:
            return
        rng = stream(self.seed, "minimax fill", replicate=replicate)
        kept = np.empty((0, self.dx + self.du))
        for _ in range(50):
            drawn = doe.optimised_lhs(
                max(count, 2), self.dx + self.du, criterion="phi_p", swaps=5000, rng=rng
            )
            low, high = self._bounds(centre, box)
            drawn[:, : self.dx] = low + drawn[:, : self.dx] * (high - low)
            drawn = self._snap(drawn)
            fine = self.design.allowed(drawn[:, : self.dx]) & self.uncertain.allowed(drawn[:, self.dx :])
            kept = np.vstack([kept, drawn[fine]])
            if len(kept) >= count:
                break
        if not len(kept):
            raise StudyError("no point meets the constraints of design and uncertainty: loosen them")
        self.run(kept[:count], "minimax start" if replicate == 0 else "minimax fill")

    def _snap(self, z: Array) -> Array:
        return np.column_stack([self.design.snap(z[:, : self.dx]), self.uncertain.snap(z[:, self.dx :])])

    def _bounds(self, centre: Array, box: float) -> tuple[Array, Array]:
        """The design box of half width box/2 around the centre, moved inside the unit cube."""
        low = np.clip(centre - box / 2, 0, 1 - min(box, 1))
        return low, low + min(box, 1)

    # -- the model
    # ----------------------------------------------------------------------------------------------

    def fit(self, centre: Array, box: float) -> "_Prediction":
        """Kriging of the runs whose design lies in twice the box, all runs when those are too few."""
        ok = np.isfinite(self.y)
        d = self.dx + self.du
        quadratic = (d + 1) * (d + 2) // 2
        low, high = self._bounds(centre, 2 * box)
        x = self.z[:, : self.dx]
        near = ok & np.all((x >= low - 1e-12) & (x <= high + 1e-12), axis=1)
        if near.sum() < d + 4:
            distance = np.where(ok, np.abs(x - centre).max(axis=1), np.inf)
            near = np.zeros(len(x), dtype=bool)
            near[np.argsort(distance, kind="stable")[: min(int(ok.sum()), quadratic + d)]] = True
            low, high = x[near].min(axis=0), x[near].max(axis=0)
        trend = (
            "quadratic" if near.sum() >= quadratic + 3 else "linear" if near.sum() >= d + 3 else "constant"
        )
        span = np.concatenate([np.maximum(high - low, 1e-9), np.ones(self.du)])
        shift = np.concatenate([low, np.zeros(self.du)])
        z, first = np.unique(self.z[near], axis=0, return_index=True)
        return _Prediction.of(self, (z - shift) / span, self.y[near][first], shift, span, trend)

    # -- master and oracle on the prediction
    # --------------------------------------------------------------------

    def worst_scenario(self, model: "_Prediction", x: Array, replicate: int) -> tuple[Array, float]:
        """argmax over u of the prediction at x, and its value."""
        rng = stream(self.seed, "minimax oracle", replicate=replicate)
        pool = [
            rng.random((400, self.du)),
            rng.integers(0, 2, (64, self.du)).astype(float),
            *self.scenarios[-40:],
        ]
        u = self.uncertain.snap(np.vstack(pool))
        u = u[self.uncertain.allowed(u)]

        def score(points: Array) -> Array:
            value = model.mean(np.column_stack([np.repeat(x[None], len(points), axis=0), points]))
            return np.where(self.uncertain.allowed(points), value, -np.inf)

        scores = score(u)
        points, values = maximise_score(score, u[np.argsort(scores)[-5:]], self.uncertain.levels, sweeps=30)
        best = int(np.argmax(values))
        return points[best], float(values[best])

    def master(self, model: "_Prediction", centre: Array, box: float, replicate: int) -> tuple[Array, float]:
        """argmin over the design box of the worst prediction, scenarios added until none is worse."""
        rng = stream(self.seed, "minimax master", replicate=replicate)
        low, high = self._bounds(centre, box)
        candidates = low + rng.random((300, self.dx)) * (high - low)
        candidates = self.design.snap(np.vstack([candidates, centre]))
        candidates = candidates[self.design.allowed(candidates)]
        scenarios = [*self.scenarios[-60:]] or [np.full(self.du, 0.5)]
        x, value = candidates[0], np.inf
        for round_ in range(12):
            x, value = self._finite_minimax(model, candidates, np.array(scenarios), low, high)
            u, worst = self.worst_scenario(model, x, replicate * 100 + round_)
            if worst <= value + 1e-7 * (1 + abs(value)):
                break
            scenarios.append(u)
            candidates = np.vstack([candidates, x])
        return x, max(value, worst)

    def _finite_minimax(
        self, model: "_Prediction", candidates: Array, scenarios: Array, low: Array, high: Array
    ) -> tuple[Array, float]:
        """min over x of max over a finite set of scenarios, on the prediction."""
        m = len(scenarios)

        def values(x: Array) -> Array:
            z = np.column_stack([np.repeat(x, m, axis=0), np.tile(scenarios, (len(x), 1))])
            return model.mean(z).reshape(len(x), m)

        worst = values(candidates).max(axis=1)
        order = np.argsort(worst)[:3]
        if any(grid is not None for grid in self.design.levels) or self.design.space.constraints:

            def score(points: Array) -> Array:
                inside = np.all((points >= low - 1e-12) & (points <= high + 1e-12), axis=1)
                return np.where(inside & self.design.allowed(points), -values(points).max(axis=1), -np.inf)

            points, scores = maximise_score(score, candidates[order], self.design.levels)
            return points[int(np.argmax(scores))], float(-scores.max())
        best_x, best = candidates[order[0]], float(worst[order[0]])
        step = 1e-6 * np.maximum(high - low, 1e-6)
        scale = max(float(np.ptp(worst)), 1e-12)

        def constraints(p: Array) -> Array:
            return p[-1] - values(p[None, :-1])[0] / scale

        def slopes(p: Array) -> Array:
            shifted = np.vstack([p[:-1] + np.diag(step), p[:-1] - np.diag(step)])
            f = values(shifted) / scale
            gradient = (f[: self.dx] - f[self.dx :]).T / (2 * step)
            return np.column_stack([-gradient, np.ones(m)])

        objective_slope = np.concatenate([np.zeros(self.dx), [1.0]])
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

    # -- the loop
    # -----------------------------------------------------------------------------------------------

    def play(self, *, tolerance: float, progress: Callable[[Cycle], None] | None) -> Minimax:
        d = self.dx + self.du
        centre, box = np.full(self.dx, 0.5), 1.0
        start = min(START_PER_DIMENSION * d, max(self.budget // 3, 2 * d))
        self.fill(start, centre=centre, box=1.0, replicate=0)
        n_ok = int(np.isfinite(self.y).sum())
        if n_ok < max(3, start // 2):
            raise NotEnoughRuns(
                f"{n_ok} of {start} runs of the start design gave a value; "
                "mend the model or narrow the spaces"
            )
        cycles: list[Cycle] = []
        quiet, status, whole = 0, MinimaxStatus.BUDGET, True
        while self.left > 0:
            number = len(cycles) + 1
            model = self.fit(centre, box)
            x, lower = self.master(model, centre, box, number)
            x = self.design.snap(x[None])[0]
            upper, scenario = self.confirm(model, x, centre, box, number)
            if np.isfinite(upper):
                self.tried.append(x)
            best, best_x, best_u = self.best_confirmed(box, number)
            cycle = Cycle(
                number=number,
                evaluations=len(self.y),
                lower=lower,
                upper=upper,
                best=best,
                box=box,
                design=self.design.rows(best_x[None])[0],
                scenario=self.uncertain.rows(best_u[None])[0],
            )
            cycles.append(cycle)
            if progress is not None:
                progress(cycle)
            threshold = tolerance * max(abs(best), 1e-2 * self.spread)
            met = best - lower <= threshold and abs(upper - lower) <= threshold
            quiet = quiet + 1 if met else 0
            if quiet >= QUIET_CYCLES:
                if whole:
                    status = MinimaxStatus.CONVERGED
                    break
                # the box has converged: look once more at the whole design space before believing it
                centre, box, whole, quiet = best_x, 1.0, True, QUIET_CYCLES - 1
                continue
            low, high = self._bounds(centre, box)
            at_edge = np.any(((x - low < 1e-3 * box) & (low > 0)) | ((high - x < 1e-3 * box) & (high < 1)))
            moved = float(np.abs(x - centre).max())
            centre = best_x if upper > best + threshold else x
            if at_edge:
                box = min(1.0, 2 * box)
            elif moved < box / 4 or abs(upper - lower) > threshold:
                box = max(box / 2, SMALLEST_BOX)
            whole = box >= 1.0
            if not met:
                self.fill(RUNS_TO_ZOOM * d, centre=centre, box=box, replicate=number)
        if not self.tried:
            raise NotEnoughRuns("no design could be confirmed: every run at a proposed design failed")
        value, x, scenario = self.best_confirmed(box, len(cycles) + 1)
        return Minimax(
            design=self.design.rows(x[None])[0],
            scenario=self.uncertain.rows(scenario[None])[0],
            value=value,
            lower=min(cycles[-1].lower, value),
            status=status,
            cycles=tuple(cycles),
            scenarios=tuple(self.uncertain.rows(np.array(self.scenarios))) if self.scenarios else (),
            evaluations=len(self.y),
            budget=self.budget,
            seed=self.seed,
            failures=int(np.isnan(self.y).sum()),
        )

    def confirm(
        self, model: "_Prediction", x: Array, centre: Array, box: float, number: int
    ) -> tuple[float, Array]:
        """Run x in its predicted worst scenarios until none worse is predicted: worst run, its scenario."""
        for attempt in range(ORACLE_RUNS):
            u, predicted = self.worst_scenario(model, x, 7919 * number + attempt)
            worst, _ = self.worst_run(x)
            if self.is_run(x, u) or predicted <= worst + SETTLED * (1 + abs(worst)) or self.left < 1:
                break
            y = self.run(np.concatenate([x, u])[None], "minimax oracle")
            if len(y) and np.isfinite(y[0]):
                self.scenarios.append(u)
            model = self.fit(centre, box)
        return self.worst_run(x)

    def best_confirmed(self, box: float, number: int) -> tuple[float, Array, Array]:
        """The tried design of the lowest worst run, re-examined with what was learnt since it was tried."""
        for round_ in range(RE_EXAMINED):
            worsts = [self.worst_run(x)[0] for x in self.tried]
            x = self.tried[int(np.argmin(worsts))] if self.tried else np.full(self.dx, 0.5)
            before = self.worst_run(x)[0]
            if self.tried and self.left > 0:
                self.confirm(self.fit(x, box), x, x, box, 104_729 * number + round_)
            worst, u = self.worst_run(x)
            if worst <= before + SETTLED * (1 + abs(before)):
                break
        worsts = [self.worst_run(t)[0] for t in self.tried]
        x = self.tried[int(np.argmin(worsts))] if self.tried else x
        worst, u = self.worst_run(x)
        return worst, x, u

    def worst_run(self, x: Array) -> tuple[float, Array]:
        """The largest true value at the design x and its scenario; -inf when there is none."""
        mine = np.all(np.abs(self.z[:, : self.dx] - x) < SAME, axis=1) & np.isfinite(self.y)
        if not mine.any():
            return -np.inf, np.full(self.du, 0.5)
        top = np.flatnonzero(mine)[int(np.argmax(self.y[mine]))]
        return float(self.y[top]), self.z[top, self.dx :]

    def is_run(self, x: Array, u: Array) -> bool:
        """Whether f was run at (x, u), or so near that another run would tell nothing."""
        here = np.all(np.abs(self.z[:, : self.dx] - x) < SAME, axis=1)
        return bool((here & np.all(np.abs(self.z[:, self.dx :] - u) < 1e-4, axis=1)).any())

    @property
    def spread(self) -> float:
        """Interquartile range of the values seen."""
        values = self.y[np.isfinite(self.y)]
        return float(np.subtract(*np.quantile(values, [0.75, 0.25])))


@dataclass(frozen=True, slots=True)
class _Prediction:
    """A Kriging in the shifted and scaled coordinates of the present box."""

    game: _Game
    kriging: Kriging
    shift: Array
    span: Array

    @classmethod
    def of(cls, game: _Game, z: Array, y: Array, shift: Array, span: Array, trend: str) -> "_Prediction":
        features = cls._features(game, z)
        kriging = Kriging(trend=trend, correlation="gaussian", nugget=1e-10, seed=game.seed).fit(features, y)
        return cls(game, kriging, shift, span)

    @staticmethod
    def _features(game: _Game, z: Array) -> Array:
        return np.column_stack(
            [game.design.features(z[:, : game.dx]), game.uncertain.features(z[:, game.dx :])]
        )

    def mean(self, z: Array) -> Array:
        values: Array = self.kriging.predict(self._features(self.game, (z - self.shift) / self.span))
        return values
