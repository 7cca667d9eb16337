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
from typing import Any

import numpy as np

from workbench.errors import NotEnoughRuns, StudyError
from workbench.evaluator import Evaluator, FunctionEvaluator, Reading, response_reader
from workbench.joint_prediction import JointPrediction, fit_near
from workbench.joint_runs import JointRuns, design_box
from workbench.minimax_problems import robust_design, worst_scenario
from workbench.minimax_record import Cycle, Minimax, MinimaxStatus
from workbench.scenarios import scenario_points
from workbench.search_space import SearchSpace
from workbench.space import Space

__all__ = ["Cycle", "Minimax", "MinimaxStatus", "minimax"]

Array = np.ndarray

START_PER_DIMENSION = 8
RUNS_TO_ZOOM = 2  # new runs per coordinate in a zoomed box
SMALLEST_BOX = 2e-3
ORACLE_RUNS = 6  # true runs per cycle at one design, at most
QUIET_CYCLES = 2
SETTLED = 1e-4  # relative: a predicted worst this close to the worst run counts as confirmed
RE_EXAMINED = 4


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
    least = 3 * (design_space.dimension + uncertainty.dimension)
    if budget < least:
        raise StudyError(
            f"budget={budget} is below 3 runs per coordinate, {least} for {design_space.dimension} design "
            f"and {uncertainty.dimension} uncertain parameters; raise it"
        )
    runs = JointRuns(
        design=SearchSpace.of(design_space),
        uncertain=SearchSpace.of(uncertainty),
        evaluate=evaluator,
        read=response_reader(response),
        budget=budget,
        seed=seed,
        scenarios=list(scenario_points(uncertainty, scenarios)),
    )
    return _Game(runs).play(tolerance=tolerance, progress=progress)


class _Game:
    """The moves of a minimax search over its runs."""

    def __init__(self, runs: JointRuns) -> None:
        self.runs = runs
        self.tried: list[Array] = []  # designs run in their predicted worst scenario

    def play(self, *, tolerance: float, progress: Callable[[Cycle], None] | None) -> Minimax:
        runs = self.runs
        d = runs.dimension
        centre, box = np.full(runs.dx, 0.5), 1.0
        start = min(START_PER_DIMENSION * d, max(runs.budget // 3, 2 * d))
        runs.fill(start, centre=centre, box=1.0, replicate=0)
        n_ok = int(np.isfinite(runs.y).sum())
        if n_ok < max(3, start // 2):
            raise NotEnoughRuns(
                f"{n_ok} of {start} runs of the start design gave a value; "
                "mend the model or narrow the spaces"
            )
        cycles: list[Cycle] = []
        quiet, status, whole = 0, MinimaxStatus.BUDGET, True
        while runs.left > 0:
            number = len(cycles) + 1
            model = fit_near(runs, centre, box)
            x, lower = robust_design(runs, model, centre, box, number)
            x = runs.design.snap(x[None])[0]
            upper, scenario = self.confirm(model, x, centre, box, number)
            if np.isfinite(upper):
                self.tried.append(x)
            best, best_x, best_u = self.best_confirmed(box, number)
            cycle = Cycle(
                number=number,
                evaluations=len(runs.y),
                lower=lower,
                upper=upper,
                best=best,
                box=box,
                design=runs.design.rows(best_x[None])[0],
                scenario=runs.uncertain.rows(best_u[None])[0],
            )
            cycles.append(cycle)
            if progress is not None:
                progress(cycle)
            threshold = tolerance * max(abs(best), 1e-2 * runs.spread)
            met = best - lower <= threshold and abs(upper - lower) <= threshold
            quiet = quiet + 1 if met else 0
            if quiet >= QUIET_CYCLES:
                if whole:
                    status = MinimaxStatus.CONVERGED
                    break
                # the box has converged: look once more at the whole design space before believing it
                centre, box, whole, quiet = best_x, 1.0, True, QUIET_CYCLES - 1
                continue
            low, high = design_box(centre, box)
            at_edge = np.any(((x - low < 1e-3 * box) & (low > 0)) | ((high - x < 1e-3 * box) & (high < 1)))
            moved = float(np.abs(x - centre).max())
            centre = best_x if upper > best + threshold else x
            if at_edge:
                box = min(1.0, 2 * box)
            elif moved < box / 4 or abs(upper - lower) > threshold:
                box = max(box / 2, SMALLEST_BOX)
            whole = box >= 1.0
            if not met:
                runs.fill(RUNS_TO_ZOOM * d, centre=centre, box=box, replicate=number)
        if not self.tried:
            raise NotEnoughRuns("no design could be confirmed: every run at a proposed design failed")
        value, x, scenario = self.best_confirmed(box, len(cycles) + 1)
        return Minimax(
            design=runs.design.rows(x[None])[0],
            scenario=runs.uncertain.rows(scenario[None])[0],
            value=value,
            lower=min(cycles[-1].lower, value),
            status=status,
            cycles=tuple(cycles),
            scenarios=tuple(runs.uncertain.rows(np.array(runs.scenarios))) if runs.scenarios else (),
            evaluations=len(runs.y),
            budget=runs.budget,
            seed=runs.seed,
            failures=int(np.isnan(runs.y).sum()),
        )

    def confirm(
        self, model: JointPrediction, x: Array, centre: Array, box: float, number: int
    ) -> tuple[float, Array]:
        """Run x in its predicted worst scenarios until none worse is predicted: worst run, its scenario."""
        for attempt in range(ORACLE_RUNS):
            u, predicted = worst_scenario(self.runs, model, x, 7919 * number + attempt)
            worst, _ = self.runs.worst_run(x)
            if (
                self.runs.is_run(x, u)
                or predicted <= worst + SETTLED * (1 + abs(worst))
                or self.runs.left < 1
            ):
                break
            y = self.runs.run(np.concatenate([x, u])[None], "minimax oracle")
            if len(y) and np.isfinite(y[0]):
                self.runs.scenarios.append(u)
            model = fit_near(self.runs, centre, box)
        return self.runs.worst_run(x)

    def best_confirmed(self, box: float, number: int) -> tuple[float, Array, Array]:
        """The tried design of the lowest worst run, re-examined with what was learnt since it was tried."""
        for round_ in range(RE_EXAMINED):
            worsts = [self.runs.worst_run(x)[0] for x in self.tried]
            x = self.tried[int(np.argmin(worsts))] if self.tried else np.full(self.runs.dx, 0.5)
            before = self.runs.worst_run(x)[0]
            if self.tried and self.runs.left > 0:
                self.confirm(fit_near(self.runs, x, box), x, x, box, 104_729 * number + round_)
            worst, u = self.runs.worst_run(x)
            if worst <= before + SETTLED * (1 + abs(before)):
                break
        worsts = [self.runs.worst_run(t)[0] for t in self.tried]
        x = self.tried[int(np.argmin(worsts))] if self.tried else x
        worst, u = self.runs.worst_run(x)
        return worst, x, u
