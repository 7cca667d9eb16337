"""The worst case of a response over an uncertain space: searched on a Kriging, confirmed by true runs.

    result = worst_case(function, space, sense="max", budget=60, seed=0)

The search reuses the runs it is given, starts with d + 2 space-filling points when there are none, and then
runs the model by turns where an improvement is most expected under a Kriging of all runs so far (`ei`) and
where its upper confidence bound is highest (`ucb`); at single changes of the worst point (`flip`), inside a
trust region around it (`trust`), in the least often run discrete combination that is still open
(`combination`), and, after a stall or where nothing more is promised, on the next hill of the runs (`hill`)
and where the bound of a rougher response is highest (`explore`). The last runs of the budget go to the
predicted worst (`predicted`), or climb by the model's gradients where it gives them (`gradient`). Before
them, and when the search has settled, corners are run that were not visited (`corner`, see
`workbench.search.proposals.corners`); where nothing is proposed and the gap is wide, the space is filled
(`fill`).

What is reported as worst is always a true run. The remaining gap is an upper credible bound of the Kriging,
stated as model-based, unless the space was enumerated, or a Lipschitz constant or an interval enclosure was
given.

The search is a function of the seed and of the model's answers alone. To resume it, ask again with an
evaluator that remembers its runs (the campaign's does): the same batches come back and finished runs are
not repeated.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from workbench.models.evaluator import (
    Evaluator,
    FunctionEvaluator,
    Reading,
    response_name,
)
from workbench.search.arguments import check_search_arguments
from workbench.search.evidence.audit import audit_runs
from workbench.search.evidence.baselines import predicted_baselines
from workbench.search.evidence.certificates import stated_gap
from workbench.search.evidence.enclosure import Enclosure, check_enclosure
from workbench.search.evidence.gap import Gap, remaining_gap
from workbench.search.evidence.gap_history import GapHistory
from workbench.search.proposals.corners import FINISHING_RUNS, CornerPlan
from workbench.search.proposals.gradient_ascent import polish, reserve
from workbench.search.proposals.portfolio import predicted_worst, propose
from workbench.search.record import Status, WorstCase, profile_of
from workbench.search.runs.given_runs import Start
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger, Run
from workbench.search.start import begin, far_points
from workbench.search.surrogate.feasibility import Feasibility
from workbench.search.surrogate.model import SearchModel, fit_rough_model, fit_search_model
from workbench.space.box import Space
from workbench.space.streams import stream

__all__ = ["Status", "WorstCase", "search_worst_case", "surrogate_worst_case", "worst_case"]

Progress = Callable[[Run, float], None]

QUIET_BATCHES = 3  # batches in a row with a gap below the tolerance before the search stops
FLAT_RUNS = 10  # per parameter, all of one value, before a response counts as constant


def worst_case(
    function: Callable[..., Any],
    space: Space,
    *,
    response: str | Reading | None = None,
    sense: str = "max",
    budget: int = 60,
    seed: int = 0,
    start: Start = (),
    workers: int = 1,
    tolerance: float = 1e-3,
    lipschitz: float | None = None,
    enclosure: Enclosure | None = None,
    progress: Progress | None = None,
) -> WorstCase:
    """Search the worst case of `function(**parameters)` over `space`.

    Args:
        function: takes the parameters by name, returns a float or a mapping of response names to floats; a
            model with gradients returns a pair, see `workbench.models.evaluator.FunctionEvaluator`.
        space: names, bounds, units and kinds of the uncertain parameters.
        response: a name, or a function of the mapping of outputs; not needed when there is one response.
        sense: "max" when large is bad, "min" when small is bad.
        budget: true runs to spend, the start design included; runs given in `start` cost nothing.
        seed: of the start design and of the search's random candidates.
        start: runs already made: outcomes, `runs` of another search, mappings of parameters and responses,
            or a DataFrame of them.
        workers: how many runs a batch proposes.
        tolerance: stop when the remaining gap is below this share of the spread of the values seen or of the
            worst value, whichever is less.
        lipschitz: bound of |f(u) - f(v)| / |u - v| in the unit cube when it is known; makes the gap a
            certificate.
        enclosure: bounds of the response over a box when they can be computed, as
        `workbench.search.evidence.enclosure`
            describes; makes the gap a certificate. Of two certificates the narrower is stated.
        progress: called with every run and the best value so far.

    Returns: a `WorstCase`; `value` and `parameters` belong to a true run.

    Raises:
        StudyError: an argument is of no use: unknown sense or response, empty space, budget below the start
            design, start outside the space, a number that is none. A certificate that the runs refute is no
            error: the gap of the Kriging is stated, with the reason.
        NotEnoughRuns: every run failed, or too few gave a value to fit a Kriging.

    >>> from workbench import Parameter
    >>> space = Space([Parameter("a", lower=-1, upper=2), Parameter("b", lower=0, upper=1)])
    >>> found = worst_case(lambda a, b: a * a - b, space, budget=12)
    >>> found.parameters, found.value
    ({'a': 2.0, 'b': 0.0}, 4.0)
    """
    return search_worst_case(
        FunctionEvaluator(function),
        space,
        response=response,
        sense=sense,
        budget=budget,
        seed=seed,
        start=start,
        workers=workers,
        tolerance=tolerance,
        lipschitz=lipschitz,
        enclosure=enclosure,
        progress=progress,
    )


def search_worst_case(
    evaluate: Evaluator,
    space: Space,
    *,
    response: str | Reading | None = None,
    sense: str = "max",
    budget: int = 60,
    seed: int = 0,
    start: Start = (),
    workers: int = 1,
    tolerance: float = 1e-3,
    lipschitz: float | None = None,
    enclosure: Enclosure | None = None,
    progress: Progress | None = None,
) -> WorstCase:
    """`worst_case` on an evaluator, which stores runs and repeats none; see there for the arguments."""
    check_search_arguments(
        sense=sense,
        budget=budget,
        seed=seed,
        workers=workers,
        tolerance=tolerance,
        lipschitz=lipschitz,
        enclosure=enclosure,
    )
    ledger = Ledger.opened(space, response=response, sense=sense, start=start, progress=progress)
    where = ledger.where
    if enclosure is not None:
        check_enclosure(where, enclosure)
    begun = begin(evaluate, ledger, budget=budget, seed=seed, workers=workers)
    ledger.require_values(1 if ledger.is_exhausted else FEWEST_RUNS)
    gaps = GapHistory()
    model, status, quiet = None, Status.BUDGET, 0
    searched = budget - reserve(ledger, budget)
    corners = CornerPlan.of(ledger, budget=searched - begun)
    while ledger.spent < searched and not ledger.is_exhausted:
        left = searched - ledger.spent
        model = fit_search_model(where.features(ledger.u_ok), ledger.v, previous=model, seed=seed)
        feasibility = Feasibility.of(where.features(ledger.u), ledger.ok, seed=seed)
        # the full bound is sought only when a cheap look at it suggests that the search is over
        gap = _gap(ledger, model, feasibility, seed=seed, replicate=ledger.spent, full=quiet >= QUIET_BATCHES)
        gaps.note(gap, ledger, full=quiet >= QUIET_BATCHES)
        quiet = quiet + 1 if gap.width <= tolerance * ledger.scale else 0
        is_settled, room = quiet > QUIET_BATCHES, corners.room(ledger, runs=left)
        if is_settled or room <= 0:
            unrun = corners.due(ledger, most=left)
            if len(unrun):
                best = float(ledger.v.max())
                _run(evaluate, ledger, unrun, name="corner")
                # a corner that is worse than all before begins the search anew
                quiet = quiet if float(ledger.v.max()) <= best else 0
                continue
        if is_settled and not (ledger.is_flat and len(ledger.v) < FLAT_RUNS * where.dimension):
            status = Status.CONVERGED
            break
        batch = propose(
            where,
            model,
            u=ledger.u,
            u_ok=ledger.u_ok,
            v=ledger.v,
            incumbent=ledger.incumbent,
            feasibility=feasibility,
            iteration=ledger.spent - begun,
            stalled=ledger.since_improvement > max(where.dimension, 6),
            finishing=left <= FINISHING_RUNS and ledger.since_improvement > FINISHING_RUNS,
            size=min(workers, room if room > 0 else left),
            rng=stream(seed, "worst case", replicate=ledger.spent),
        )
        if not len(batch.u):
            # no proposal is left, which says nothing of the gap: fill the space
            rng = stream(seed, "worst case fill", replicate=ledger.spent)
            far = far_points(where, ledger.u, size=min(workers, left), rng=rng)
            if not len(far):
                status = Status.NO_POINT
                break
            _run(evaluate, ledger, far, name="fill")
            continue
        outcomes = evaluate(where.rows(batch.u), purpose=batch.proposals[0])
        ledger.add(
            outcomes,
            batch.u,
            proposals=batch.proposals,
            predicted=ledger.sign * batch.predicted,
            std=batch.std,
        )
    if ledger.slopes and not ledger.is_exhausted:
        polish(evaluate, ledger, budget=budget)
    if ledger.is_exhausted:
        status = Status.EXHAUSTED
    elif ledger.is_flat:
        status = Status.CONSTANT
    elif quiet > QUIET_BATCHES:
        status = Status.CONVERGED  # also where corners without a gain took the rest of the budget
    return _result(
        ledger,
        gaps,
        response=response,
        budget=budget,
        seed=seed,
        status=status,
        tolerance=tolerance,
        lipschitz=lipschitz,
        enclosure=enclosure,
        previous=model,
    )


def surrogate_worst_case(
    space: Space,
    runs: Start,
    *,
    response: str | Reading | None = None,
    sense: str = "max",
    seed: int = 0,
) -> WorstCase:
    """The extreme that a Kriging of given runs predicts, when there is no model to run.

    The result is labelled as unconfirmed: `confirmed` is False, `value` and `parameters` are the
    *predicted* worst and `run_key` names the worst run that truly exists; `audit` and `gap` as for a
    search.

    Raises:
        NotEnoughRuns: fewer than three runs gave a value.
    """
    ledger = Ledger.opened(space, response=response, sense=sense, start=runs, progress=None)
    ledger.require_values(FEWEST_RUNS)
    where = ledger.where
    model = fit_search_model(where.features(ledger.u_ok), ledger.v, previous=None, seed=seed)
    worst = predicted_worst(
        where,
        model,
        incumbent=ledger.incumbent,
        feasibility=Feasibility.of(where.features(ledger.u), ledger.ok, seed=seed),
        rng=stream(seed, "worst case"),
    )[None]
    mean, std = model.in_units(where.features(worst))
    found = _result(ledger, GapHistory(), response=response, budget=0, seed=seed, status=Status.SURROGATE)
    predicted = float(ledger.sign * mean[0])
    return replace(
        found,
        value=predicted,
        parameters=where.rows(worst)[0],
        confirmed=False,
        predicted=predicted,
        predicted_std=float(std[0]),
        profile=profile_of(ledger, model, worst[0]),
    )


def _run(evaluate: Evaluator, ledger: Ledger, points: np.ndarray, *, name: str) -> None:
    """Run the points (m, d) of one proposal."""
    ledger.add(evaluate(ledger.where.rows(points), purpose=name), points, proposals=[name] * len(points))


def _gap(
    ledger: Ledger, model: SearchModel, feasibility: Feasibility, *, seed: int, replicate: int, full: bool
) -> Gap:
    """The model-based gap; `full` with the roughest credible model and a climb, a cheap look without."""
    features = ledger.where.features(ledger.u_ok)
    return remaining_gap(
        ledger.where,
        model,
        u=ledger.u,
        v=ledger.v,
        feasibility=feasibility,
        rng=stream(seed, "gap", replicate=replicate),
        rough=fit_rough_model(features, ledger.v, model, seed=seed) if full else None,
        polish=full,
    )


def _result(
    ledger: Ledger,
    gaps: GapHistory,
    *,
    response: str | Reading | None,
    budget: int,
    seed: int,
    status: Status,
    tolerance: float = 0.0,
    lipschitz: float | None = None,
    enclosure: Enclosure | None = None,
    previous: SearchModel | None = None,
) -> WorstCase:
    """The record of a finished search: gap, audit and profile from a last Kriging of all runs."""
    where = ledger.where
    # the search's choices are kept: the gap that is stated is the one that it stopped at
    model = _last_model(ledger, previous, seed=seed)

    feasibility = Feasibility.of(where.features(ledger.u), ledger.ok, seed=seed)

    def modelled() -> Gap:
        assert model is not None  # only an enumeration goes without
        return _gap(ledger, model, feasibility, seed=seed, replicate=ledger.spent, full=True)

    gap = stated_gap(ledger, model, modelled, tolerance=tolerance, lipschitz=lipschitz, enclosure=enclosure)
    gaps.note(gap, ledger, full=True)
    missed = gap.kind == "model-based" and gap.width > tolerance * ledger.scale
    if status is Status.CONVERGED and missed and ledger.spent >= budget:
        status = Status.BUDGET  # the last runs, at corners, have widened the gap again
    best = ledger.best
    return WorstCase(
        response=response_name(response),
        unit="1",
        sense="max" if ledger.sign > 0 else "min",
        value=float(best.value if best.value is not None else np.nan),
        parameters=best.parameters,
        confirmed=True,
        run_key=best.key,
        predicted=best.predicted,
        predicted_std=best.std,
        status=status,
        budget=budget,
        seed=seed,
        runs=tuple(ledger.runs),
        gap_history=tuple(gaps.looks),
        gap=replace(gap, upper=ledger.sign * gap.upper),
        audit=audit_runs(ledger, model, rng=stream(seed, "audit")),
        profile={} if model is None else profile_of(ledger, model, ledger.incumbent),
        baselines={}
        if model is None
        else predicted_baselines(
            where,
            model,
            feasibility=feasibility,
            u=ledger.u_ok,
            v=ledger.v,
            runs=len(ledger.runs),
            sign=ledger.sign,
            rng=stream(seed, "baselines"),
        ),
    )


def _last_model(ledger: Ledger, previous: SearchModel | None, *, seed: int) -> SearchModel | None:
    """A Kriging of all runs; None where an enumeration of a few points left too few values for one."""
    if len(ledger.v) < FEWEST_RUNS:
        return None
    return fit_search_model(ledger.where.features(ledger.u_ok), ledger.v, previous=previous, seed=seed)
