"""The worst case of a response over an uncertain space: searched on a Kriging, confirmed by true runs.

    result = worst_case(function, space, sense="max", budget=60, seed=0)

The search reuses the runs it is given, starts with d + 2 space-filling points when there are none, and then
runs the model by turns where an improvement is most expected under a Kriging of all runs so far (`ei`) and
where its upper confidence bound is highest (`ucb`); at single changes of the worst point (`flip`), inside a
trust region around it (`trust`), in the least often run discrete combination that is still open
(`combination`), and, after a stall or where nothing more is promised, on the next peak of the runs (`hill`)
and where the bound of a rougher response is highest (`explore`). The last runs of the budget go to the
predicted worst (`predicted`), or climb by the model's gradients where it gives them (`gradient`). Before
them, and when the search has settled, corners are run that were not visited (`corner`, see
`workbench.search.proposals.corners`); where nothing is proposed and the gap is wide, the space is filled
(`fill`). Once the gap has closed, some of the runs left are drawn at random (`second look`, see
`workbench.search.second_look`): what no run has met, no Kriging foresees.

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

from surrogates.analysis.success import SuccessChance
from workbench.models.evaluator import FunctionEvaluator, Reading, RepeatingEvaluator
from workbench.search.arguments import Arguments, default_budget
from workbench.search.attacked import attacked
from workbench.search.conclusion import concluded
from workbench.search.evidence.enclosure import Enclosure, check_enclosure
from workbench.search.evidence.gap_history import GapHistory
from workbench.search.loop import Loop
from workbench.search.noisy import NoisySearch, disagreeing
from workbench.search.noisy_conclusion import concluded_by_mean
from workbench.search.proposals.known import Known
from workbench.search.proposals.portfolio import predicted_worst
from workbench.search.record import Status, WorstCase, profile_of
from workbench.search.runs.given_runs import Start
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger, Run
from workbench.search.surrogate.fitting import fit_search_model
from workbench.space.box import Space
from workbench.space.streams import stream

__all__ = ["Status", "WorstCase", "search_worst_case", "surrogate_worst_case", "worst_case"]

Progress = Callable[[Run, float], None]


def worst_case(
    function: Callable[..., Any],
    space: Space,
    *,
    response: str | Reading | None = None,
    sense: str = "max",
    budget: int | None = None,
    seed: int = 0,
    start: Start = (),
    workers: int = 1,
    tolerance: float = 1e-3,
    lipschitz: float | None = None,
    enclosure: Enclosure | None = None,
    attack: int | None = None,
    noise: bool | None = None,
    failures: str = "avoid",
    transform: str = "auto",
    progress: Progress | None = None,
) -> WorstCase:
    """Search the worst case of `function(**parameters)` over `space`.

    Args:
        function: takes the parameters by name, returns a float or a mapping of response names to floats; a
            model with gradients returns a pair, see `workbench.models.evaluator.FunctionEvaluator`.
        space: names, bounds, units and kinds of the uncertain parameters.
        response: a name, or a function of the mapping of outputs; not needed when there is one response.
        sense: "max" when large is bad, "min" when small is bad.
        budget: true runs to spend, the start design included; runs given in `start` cost nothing. None: 60,
            and 120 where `noise` is True.
        seed: of the start design and of the search's random candidates.
        start: runs already made: outcomes, `runs` of another search, mappings of parameters and responses,
            or a DataFrame of them.
        workers: how many runs a batch proposes.
        tolerance: stop when the remaining gap is below this share of the spread of the values seen or of the
            worst value, whichever is less.
        lipschitz: bound of |f(u) - f(v)| / |u - v| in the unit cube when it is known; makes the gap a
            certificate.
        enclosure: bounds of the response over a box when they can be computed, as
            `workbench.search.evidence.enclosure` describes; makes the gap a certificate. Of two certificates
            the narrower is stated.
        attack: true runs of an adversary beside the budget, see `workbench.search.attacked`; None for what
            the search leaves of its budget when it stops by itself, 0 for no attack. With 1 200 and more the
            worst case may be called attacked.
        noise: whether the model gives another value when it is run again. True: the largest mean is searched,
            points are repeated, and `value` is the mean of fresh runs at `parameters`, with `interval`, see
            `workbench.search.noisy`. None: found out, where runs of `start` at one point disagree, or where
            the Kriging takes some of the scatter for noise and a run made again confirms it, at the cost of
            one of the budget. False: never.
        failures: "avoid": the worst of the runs that give a value is searched, along the border of failures
            where they grow into it; `border` says whether, and how much of the box fails. "worst": a failed
            run is worse than any value. It is searched without avoiding any, and once one has failed the rest
            of the budget counts how much of the box fails; `value` is the worst that came.
        transform: the scale on which the response is modelled: "auto" for none or a logarithm of the distance
            to one of its ends, whichever makes the runs likeliest; "none", "log", "box-cox", "yeo-johnson" by
            name (see `surrogates.response_map`). Bounds and predictions are in units of the response. `scale`
            of the result says which was used, and why.
        progress: called with every run and the best value so far.

    Returns: a `WorstCase`; `value` and `parameters` belong to a true run, or under noise to several.

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
    asked = Arguments(
        response=response,
        sense=sense,
        budget=default_budget(noise) if budget is None else budget,
        seed=seed,
        workers=workers,
        tolerance=tolerance,
        lipschitz=lipschitz,
        enclosure=enclosure,
        attack=attack,
        noise=noise,
        failures=failures,
        transform=transform,
    )
    return search_worst_case(FunctionEvaluator(function), space, asked, start=start, progress=progress)


def search_worst_case(
    evaluate: RepeatingEvaluator,
    space: Space,
    asked: Arguments,
    *,
    start: Start = (),
    progress: Progress | None = None,
) -> WorstCase:
    """`worst_case` on an evaluator, which stores runs and repeats none; see there for what is asked."""
    ledger = Ledger.opened(space, response=asked.response, sense=asked.sense, start=start, progress=progress)
    if asked.enclosure is not None:
        check_enclosure(ledger.where, asked.enclosure)
    if asked.noise or (asked.noise is None and disagreeing(ledger)):
        return _among_noise(evaluate, ledger, asked)
    search = Loop.started(evaluate, ledger, asked)
    status = search.run()
    if search.is_noisy:
        return _among_noise(evaluate, ledger, asked)
    after = attacked(search, status)
    found = concluded(
        ledger,
        asked,
        status=after.status,
        gaps=search.gaps,
        previous=search.model,
        attack=after.attack,
        unseen=after.unseen,
    )
    return replace(found, made_again=int(search.is_checked))


def _among_noise(evaluate: RepeatingEvaluator, ledger: Ledger, asked: Arguments) -> WorstCase:
    """The search for the largest mean, after or without runs of the other search."""
    search = NoisySearch(evaluate=evaluate, ledger=ledger, asked=asked)
    mean, first = search.run()
    assert search.model is not None
    return concluded_by_mean(ledger, asked, search.model, mean, first)


def surrogate_worst_case(
    space: Space,
    runs: Start,
    *,
    response: str | Reading | None = None,
    sense: str = "max",
    seed: int = 0,
    transform: str = "auto",
) -> WorstCase:
    """The extreme that a Kriging of given runs predicts, when there is no model to run.

    The result is labelled as unconfirmed: `confirmed` is False, `value` and `parameters` are the
    *predicted* worst and `run_key` names the worst run that truly exists; `audit` as for a search, and the
    `gap` counts from the prediction (`workbench.search.evidence.prediction_gap`). Where the Kriging predicts
    nothing beyond the worst run, that run is the result, confirmed.

    Raises:
        NotEnoughRuns: fewer than three runs gave a value.
    """
    asked = Arguments(
        response=response, sense=sense, budget=0, seed=seed, tolerance=0.0, transform=transform,
        given_are_even=False,
    )  # fmt: skip
    ledger = Ledger.opened(space, response=response, sense=sense, start=runs, progress=None)
    ledger.require_values(FEWEST_RUNS)
    where = ledger.where
    features = where.features(ledger.u_ok)
    model = fit_search_model(features, ledger.v, previous=None, seed=seed, scale=transform, sign=ledger.sign)
    known = Known.of(ledger, model, SuccessChance.of(where.features(ledger.u), ledger.ok))
    worst = predicted_worst(known, rng=stream(seed, "worst case"))[None]
    mean, std = model.in_units(where.features(worst))
    rounding = 1e-9 * float(np.ptp(ledger.v)) + 1e-12 * float(np.abs(ledger.v).max())
    is_known = float(mean[0]) <= float(np.max(ledger.v)) + rounding
    found = concluded(
        ledger,
        asked,
        status=Status.SURROGATE,
        gaps=GapHistory(),
        previous=None,
        reported=None if is_known else worst[0],
    )
    if is_known:
        return replace(found, status=Status.KNOWN_RUN)
    predicted = float(ledger.sign * mean[0])
    upper = max(ledger.sign * found.gap.upper, float(mean[0]))
    return replace(
        found,
        value=predicted,
        parameters=where.rows(worst)[0],
        confirmed=False,
        predicted=predicted,
        predicted_std=float(std[0]),
        gap=replace(found.gap, upper=ledger.sign * upper, width=upper - float(mean[0])),
        profile=profile_of(ledger, model, worst[0]),
    )
