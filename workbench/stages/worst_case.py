"""The stage `worst_case` of a study: the searches of its table from the stored runs: `worst_case.json`."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.campaign.results.functionals import (
    functional_notes,
    known_outcomes,
    searching,
    with_functionals,
)
from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.errors import StudyError
from workbench.models.evaluator import Outcome, response_reader
from workbench.models.python import load_function
from workbench.models.stored.evaluation import Evaluation
from workbench.models.table import TableModel
from workbench.models.values import is_value
from workbench.report.claims import refuse_contradictions, worst_case_claims
from workbench.report.lines.statements import regime_name, regime_of
from workbench.report.lines.worst_case import worst_case_lines
from workbench.stages.stored_runs import refuse_without_values, runs_as_text, screening_columns, thinned
from workbench.stages.work import Work
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.study.worst_case_targets import QUANTILE_BUDGET, Target, targets
from workbench.system.atomic import read_json, write_json

if TYPE_CHECKING:
    from workbench.search.arguments import Arguments
    from workbench.search.evidence.enclosure import Enclosure
    from workbench.search.worst_case import WorstCase

__all__ = ["WORK"]

SHARED = ("tolerance", "attack", "noise", "failures", "transform")  # by one search and by several
MOST_RUNS = 300  # with a value that a search starts from; of more, those that spread most


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """Search, by true runs where the model can be run."""
    wanted = targets(campaign.study)
    reads = dict.fromkeys(name for target in wanted for name in target.reads)
    runs = _runs_to_start_from(campaign, wanted, next(iter(reads)))
    is_table = campaign.study.model["kind"] == "table"
    if is_table:
        counts = Counter(run.status for run in runs)
        for name in reads:
            values = np.array([run.outputs[name] for run in runs if run.status == "ok"])
            refuse_without_values(campaign, name, values, counts)
    sought = ", ".join(f"{target.sense} {target.name}" for target in wanted)
    campaign.progress.stage("worst_case", f"{sought} from {len(runs)} runs")
    given = _rows_of_table(campaign) if is_table else []
    document = _document(campaign, table, wanted, [row.as_outcome() for row in runs], given)
    claims = worst_case_claims(document, is_runnable=not is_table)
    beyond = _beyond(campaign, wanted, [claim.value for claim in claims], given)
    for claim, target, runs_beyond in zip(claims, wanted, beyond, strict=True):
        read = response_reader(target.reading)
        refuse_contradictions(claim, [(run.key, read(run.outputs)) for run in runs_beyond])
    write_json(campaign.folder / "worst_case.json", document)
    return document


def _runs_to_start_from(campaign: CampaignRuns, wanted: Sequence[Target], response: str) -> list[Evaluation]:
    """The stored runs, of very many some that spread by `response`, and the worst of every target."""
    readings = {"": response_reader(response)}
    readings |= {target.name: response_reader(target.reading) for target in wanted}
    every = screening_columns(campaign, readings)
    chosen = thinned(campaign, every, "", most=MOST_RUNS)
    good = np.flatnonzero(every.is_ok)
    if len(good):
        signs = {target.name: 1.0 if target.sense == "max" else -1.0 for target in wanted}
        signed = [sign * every.values[name][good] for name, sign in signs.items()]
        # a reading such as `within` has no number for some runs
        worst = [good[np.argmax(np.where(np.isnan(values), -np.inf, values))] for values in signed]
        chosen = np.union1d(chosen, worst)
    return every.at(chosen)


def _beyond(
    campaign: CampaignRuns, wanted: Sequence[Target], values: Sequence[float], given: Sequence[Outcome]
) -> list[list[Outcome]]:
    """For every target the worst run of the store or of the `given` ones, if worse than the value."""
    from workbench.search.known_runs import Stated, worst_beyond

    stated = [
        Stated(value=value, sense=target.sense, read=response_reader(target.reading), reads=target.reads)
        for target, value in zip(wanted, values, strict=True)
    ]
    return worst_beyond(campaign.study.space, chain(known_outcomes(campaign), given), stated)


def _rows_of_table(campaign: CampaignRuns) -> list[Outcome]:
    """The rows of a table of runs inside the bounds, with the responses that they have: those that its design
    leaves out, and those that count as failed because another response is missing, among them."""
    model, space = TableModel.opened(campaign.spec), campaign.study.space
    found = []
    for row in model.rows:
        try:
            inputs = space.canonical({name: row[name] for name in space.names})
        except StudyError:  # outside the bounds
            continue
        values = {n: v for n, v in row.items() if n not in space.names and v is not None and is_value(v)}
        found.append(Outcome(parameters=inputs, status="ok", outputs=values, key=campaign.key(inputs)))
    return found


def _reading(target: Target, runs: Sequence[Outcome]) -> list[Outcome]:
    """The runs that have every response that a target reads."""
    return [run for run in runs if run.status == "ok" and all(n in run.outputs for n in target.reads)]


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> Iterable[str]:
    return runs_as_text(campaign)


def _planned_runs(study: Study, folder: Path) -> int:
    table = study.worst_case or {}
    more = table.get("quantile_budget", QUANTILE_BUDGET) if "quantile" in table else 0
    return int(table["budget"] + table.get("attack", 0) + more)


def _check(study: Study) -> None:
    """The interval enclosure can be loaded."""
    reference = (study.worst_case or {}).get("enclosure")
    if reference is not None:
        with placed(study.text, study.where, ("worst_case", "enclosure")):
            try:
                load_function(reference, study.folder)
            except StudyError as exc:
                raise StudyError(f"[worst_case] enclosure: {exc}") from None


WORK = Work(run=_run, inputs=_inputs, lines=worst_case_lines, planned_runs=_planned_runs, check=_check)


def _document(
    campaign: CampaignRuns,
    table: Mapping[str, Any],
    wanted: Sequence[Target],
    start: Sequence[Outcome],
    given: Sequence[Outcome],
) -> dict[str, Any]:
    """`worst_case.json` of a search from `start`: that of the first target, the `others` in it.

    `given`: the rows of a table; with the runs of the store no worst case lies below them.
    """
    if campaign.study.model["kind"] == "table":
        scale = table.get("transform", "auto")
        found = [_predicted(campaign, target, _read_anew(start, given, target), scale) for target in wanted]
    elif len(wanted) == 1:
        found = [_searched(campaign, table, wanted[0], start)]
    else:
        found = _all_searched(campaign, table, wanted, start)
    # its runs may lie beyond the worst case that was found
    quantile = _quantile(campaign, table, wanted[0], found[0]) if "quantile" in table else None
    from workbench.search.known_runs import with_known_runs

    beyond = _beyond(campaign, wanted, [result.value for result in found], given)
    found = [
        with_known_runs(result, campaign.study.space, _asked(campaign, table, target), known)
        for result, target, known in zip(found, wanted, beyond, strict=True)
    ]
    first, *others = (
        result.named(target.name, target.unit).to_dict()
        | dict(target.notes)
        | functional_notes(campaign, target.reads)
        for result, target in zip(found, wanted, strict=True)
    )
    if quantile is not None:
        first["quantile"] = quantile
    screening = read_json(campaign.folder / "screening.json")
    if screening is not None and screening["response"] == first["response"]:
        first["regime"] = regime_of(float(first["value"]), screening) or None
        first["regime_name"] = regime_name(float(first["value"]), screening) or None
    return first | ({"others": others} if others else {})


def _read_anew(start: Sequence[Outcome], given: Sequence[Outcome], target: Target) -> list[Outcome]:
    """The runs of a table; one that failed for want of another response has a value all the same."""
    whole = {run.key: run for run in _reading(target, given)}
    return [whole.get(run.key, run) for run in start]


def _predicted(campaign: CampaignRuns, target: Target, start: Sequence[Outcome], scale: str) -> "WorstCase":
    from workbench.search.worst_case import surrogate_worst_case

    return surrogate_worst_case(
        campaign.study.space,
        start,
        response=target.reading,
        sense=target.sense,
        seed=campaign.study.seed,
        transform=scale,
    )


def _searched(
    campaign: CampaignRuns, table: Mapping[str, Any], target: Target, start: Sequence[Outcome]
) -> "WorstCase":
    from workbench.search.worst_case import search_worst_case

    _tell_idle_workers(campaign, table)
    result = search_worst_case(
        searching(campaign),
        campaign.study.space,
        _asked(campaign, table, target),
        start=start,
        progress=_listener(campaign, table, target, start),
    )
    if campaign.study.model.get("gradient") and not result.audit.gradient_runs:
        errors = (
            error
            for some in campaign.chunks()
            for status, error in zip(some.statuses, some.errors, strict=True)
            if status == "ok" and error
        )
        campaign.progress.note(f"the model's gradient was of no use: {next(errors, 'not all derivatives')}")
    return result


def _asked(campaign: CampaignRuns, table: Mapping[str, Any], target: Target) -> "Arguments":
    """What the search of a target is asked for; of a table of runs without a budget."""
    from workbench.search.arguments import Arguments

    options = {key: table[key] for key in (*SHARED, "lipschitz") if key in table}
    if "enclosure" in table:
        options["enclosure"] = _enclosure(campaign, table)
    return Arguments(
        response=target.reading,
        sense=target.sense,
        budget=0 if campaign.study.model["kind"] == "table" else table["budget"],
        seed=campaign.study.seed,
        workers=int(table.get("batch", 1)),
        given_are_even=campaign.study.model["kind"] != "table",  # who knows where its rows came from
        **options,
    )


def _all_searched(
    campaign: CampaignRuns, table: Mapping[str, Any], wanted: Sequence[Target], start: Sequence[Outcome]
) -> "list[WorstCase]":
    from workbench.search.worst_cases import worst_cases

    _tell_idle_workers(campaign, table)
    by_name = {target.name: target for target in wanted}
    found = worst_cases(
        None,
        campaign.study.space,
        {target.name: target.sense for target in wanted},
        budget=table["budget"],
        seed=campaign.study.seed,
        start=start,
        workers=int(table.get("batch", 1)),
        evaluator=searching(campaign),
        progress=lambda name: _listener(campaign, table, by_name[name], start),
        **{key: table[key] for key in SHARED if key in table},
    )
    return [found[target.name] for target in wanted]


def _quantile(
    campaign: CampaignRuns, table: Mapping[str, Any], target: Target, worst: "WorstCase"
) -> dict[str, Any]:
    """The worst quantile, from the runs of the search and up to `quantile_budget` more."""
    from workbench.search.worst_quantile import worst_quantile

    share = table["quantile"]
    campaign.progress.stage("worst_case", f"quantile {share:g} of {target.name} from {len(worst.runs)} runs")
    known = campaign.store.rows(keys=[run.key for run in worst.runs])
    found = worst_quantile(
        None,
        campaign.study.space,
        share=share,
        response=target.reading,
        sense=target.sense,
        budget=table.get("quantile_budget", QUANTILE_BUDGET),
        seed=campaign.study.seed,
        start=[row.as_outcome() for row in with_functionals(campaign, known)],
        workers=int(table.get("batch", 1)),
        evaluator=searching(campaign),
    )
    plain = replace(found, response=target.name).to_dict()
    del plain["sentence"]  # it knows nothing of the runs of the search, nor of the unit
    return plain | {"unit": target.unit, "known": len(known)}


def _tell_idle_workers(campaign: CampaignRuns, table: Mapping[str, Any]) -> None:
    """Say it where the search proposes fewer runs at once than there are workers."""
    workers, batch = campaign.study.evaluate.get("workers", 1), int(table.get("batch", 1))
    if workers > batch:
        campaign.progress.note(
            f"{workers} workers, but [worst_case] batch = {batch}: the search proposes {batch} at a time"
        )


def _listener(
    campaign: CampaignRuns, table: Mapping[str, Any], target: Target, start: Sequence[Outcome]
) -> Callable[[Any, float], None]:
    """Who tells a person of every run: the worst value so far, or that a failed run is worse."""
    from workbench.search.evidence.border import has_failed

    counts = table.get("failures") == "worst"
    worse_than_all = inf if target.sense == "max" else -inf
    lost = counts and any(outcome.status != "ok" for outcome in start)

    def tell(run: Any, best: float) -> None:
        nonlocal lost
        lost = lost or (counts and has_failed(run))
        campaign.progress.search(
            run.number,
            table["budget"] + table.get("attack", 0),
            proposal=run.proposal,
            value=run.value,
            best=worse_than_all if lost else best,
            name=target.name,
            unit=target.unit,
        )

    return tell


def _enclosure(campaign: CampaignRuns, table: Mapping[str, Any]) -> "Enclosure":
    """The function that bounds the response over a box, from its reference."""
    from workbench.search.evidence.enclosure import Enclosure

    function = load_function(table["enclosure"], campaign.study.folder)
    return Enclosure(function, calls=table["enclosure_calls"])
