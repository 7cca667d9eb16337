"""Designs that survive their worst case: min over x of max over u of f(x, u), by cutting sets on a Kriging.

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
returned value is the largest true run at the returned design; that no scenario is worse and no design better
rests on the Kriging, which is given two standard deviations to err in the lower bound of the result. The
search is a function of the seed and of the answers: with an evaluator that remembers its runs it resumes by
being asked again. A point that was run is not run again and costs nothing.

Where runs fail, the worst case of a design is the worst that can be run. A map of the failures
(`workbench.search.surrogate.feasibility`) keeps proposals to where runs are as likely to give a value as not,
which bisects the borders of failing regions; the best design is also run in worse scenarios that the map only
presumes to fail. A scenario that ran at one design counts at another unless it is likely to fail there: where
the failing scenarios depend on the design, the search leans to designs that would stand the scenario if it
could be run.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from workbench.errors import StudyError
from workbench.models.evaluator import (
    Evaluator,
    FunctionEvaluator,
    Reading,
    need_function,
    response_reader,
)
from workbench.robust.attacked import attacked
from workbench.robust.cycles import CuttingSets
from workbench.robust.joint_runs import JointRuns
from workbench.robust.minimax_record import Cycle, Minimax, MinimaxStatus
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.box import Space, need_space
from workbench.space.scenarios import scenario_points

__all__ = ["Cycle", "Minimax", "MinimaxStatus", "minimax"]


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
    attack: int | None = None,
) -> Minimax:
    """Minimise over designs the maximum over the uncertainty of `function(design, uncertainty)`.

    Args:
        function: takes two mappings of names to values; returns a float or a mapping of responses.
        design_space: what may be chosen. uncertainty: what may happen. Names must differ between the two.
        response: a name or a function of the mapping of outputs.
        budget: true runs, failed ones included, at least 3 per coordinate.
        tolerance: stop when upper - lower is below this share of the value (or of 1 % of the spread of the
            values, when that is more) in two cycles.
        evaluator: stores runs of rows that hold the names of both spaces; `function` is then not called here.
        progress: called after every cycle.
        scenarios: points of the uncertainty that every master problem holds from the first cycle on: known
            worst cases, or those of an earlier search.
        attack: true runs beside the budget, of an adversary at the returned design and for the repair of
            designs that it breaks, see `workbench.robust.attacked`; never more than budget and attack
            together are made. None for what a search that ended by itself has left, 0 for none. Take 150 and
            more per uncertain coordinate: fewer leave no room for climbs from elsewhere
            (`studies.two_peak_games`).

    Returns: a `Minimax`; its `status` says why the search stopped, `failed` holds the runs without a value.

    Raises:
        StudyError: shared names, budget too small, a scenario outside the uncertainty, constraints that leave
            no point.
        NotEnoughRuns: fewer than three runs of the start design gave a value, or every run at a proposed
            design failed.

    >>> from workbench import Parameter
    >>> choice = Space([Parameter("x", lower=0, upper=10)])
    >>> danger = Space([Parameter("u", lower=0, upper=10)])
    >>> result = minimax(lambda x, u: (x["x"] - 5) ** 2 - (u["u"] - 5) ** 2, choice, danger, budget=60)
    >>> abs(result.value) < 0.01
    True
    """
    need_space(design_space, name="design_space")
    need_space(uncertainty, name="uncertainty")
    shared = sorted(set(design_space.names) & set(uncertainty.names))
    if shared:
        raise StudyError(f"design and uncertainty share the names {shared}; rename them in one of the spaces")
    if evaluator is None:
        need_function(function, takes="two mappings, design and uncertainty")

        def joint(**row: Any) -> Any:
            x = {name: row[name] for name in design_space.names}
            return function(x, {name: row[name] for name in uncertainty.names})

        evaluator = FunctionEvaluator(joint)
    if attack is not None and (isinstance(attack, bool) or not isinstance(attack, int) or attack < 0):
        raise StudyError(f"attack needs a whole number of runs >= 0, or None, got {attack!r}")
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
    search = CuttingSets(runs)
    found = search.solve(tolerance=tolerance, progress=progress)
    return attacked(search, found, budget=attack, tolerance=tolerance)
