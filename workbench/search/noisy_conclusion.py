"""What a search among noisy runs says: the mean at its worst point, with gap, audit and profile."""

from dataclasses import replace

from surrogates.analysis.success import SuccessChance
from workbench.models.evaluator import response_name
from workbench.search.arguments import Arguments
from workbench.search.evidence.audit import audit_runs
from workbench.search.evidence.border import border_of
from workbench.search.evidence.gap_history import GapHistory
from workbench.search.evidence.mean_gap import mean_gap
from workbench.search.noisy import smoothed
from workbench.search.record import Status, WorstCase, profile_of
from workbench.search.runs.ledger import Ledger, Run
from workbench.search.runs.repeats import Mean
from workbench.search.surrogate.model import SearchModel
from workbench.space.streams import stream

__all__ = ["concluded_by_mean"]

EXACT = "the repeated runs gave one and the same value: the model has no noise, and noise = false saves runs"


def concluded_by_mean(
    ledger: Ledger, asked: Arguments, model: SearchModel, mean: Mean, first: Run
) -> WorstCase:
    """The record of the noisy runs in `ledger`; `mean`, in its sign, is that of the runs from `first` on."""
    where, seed = ledger.where, asked.seed
    success = SuccessChance.of(where.features(ledger.u), ledger.ok)
    gap = mean_gap(ledger, model, success, mean, seed=seed)
    if mean.deviation == 0.0:
        gap = replace(gap, note="; ".join(filter(None, (gap.note, EXACT))))
    gaps = GapHistory()
    gaps.note(gap, ledger, full=True)
    means = smoothed(ledger, model)
    stated = replace(mean, value=ledger.sign * mean.value)
    return WorstCase(
        response=response_name(asked.response),
        unit="1",
        sense=asked.sense,
        value=stated.value,
        parameters=first.parameters,
        confirmed=True,
        run_key=first.key,
        predicted=first.predicted,
        predicted_std=first.std,
        status=Status.BUDGET,
        budget=asked.budget,
        seed=seed,
        runs=tuple(
            replace(run, smoothed=of_mean.value) for run, of_mean in zip(ledger.runs, means.runs, strict=True)
        ),
        gap_history=tuple(gaps.looks),
        gap=replace(gap, upper=ledger.sign * gap.upper),
        audit=audit_runs(means, model, gap=gap, rng=stream(seed, "audit")),
        profile=profile_of(ledger, model, where.unit([dict(first.parameters)])[0]),
        repeated=stated,
        not_attacked=asked.attack or 0,
        border=border_of(
            means, model, success, given_are_even=asked.given_are_even, rng=stream(seed, "border")
        ),
    )
