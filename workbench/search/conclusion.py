"""What a finished search says: its record, with gap, audit and profile from a Kriging of all runs."""

from dataclasses import replace
from math import inf

import numpy as np

from surrogates.analysis.success import SuccessChance
from workbench.models.evaluator import response_name
from workbench.search.arguments import Arguments
from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.audit import audit_runs
from workbench.search.evidence.backtested_gap import backtested_gap
from workbench.search.evidence.baselines import measured_baselines
from workbench.search.evidence.border import border_of
from workbench.search.evidence.certificates import stated_gap
from workbench.search.evidence.gap import COVERAGE, Gap, modelled_gap
from workbench.search.evidence.gap_history import GapHistory
from workbench.search.evidence.prediction_gap import prediction_gap
from workbench.search.record import Status, WorstCase, profile_of
from workbench.search.runs.ledger import FEWEST_RUNS, Ledger, Run
from workbench.search.surrogate.fitting import fit_search_model
from workbench.search.surrogate.model import SearchModel
from workbench.search.surrogate.scale import used_scale
from workbench.space.streams import stream

__all__ = ["concluded"]

FAILED = "a failed run counts as worse, and has no value"
PREDICTED = (Status.SURROGATE, Status.KNOWN_RUN)  # of a table, where nothing can be run


def concluded(
    ledger: Ledger,
    asked: Arguments,
    *,
    status: Status,
    gaps: GapHistory,
    previous: SearchModel | None,
    attack: Attack | None = None,
    unseen: tuple[Run, ...] = (),
    reported: np.ndarray | None = None,
) -> WorstCase:
    """The record of the runs in `ledger` and of those of an `attack` that its Kriging has not seen;
    `previous` is the last Kriging of the search, `reported` the point (d,) that is predicted to be worse than
    every run, where there is one.

    Its choices are kept: the gap that is stated is the one that the search stopped at.
    """
    where, seed = ledger.where, asked.seed
    model = _last_model(ledger, previous, asked)
    success = SuccessChance.of(where.features(ledger.u), ledger.ok)

    def modelled() -> Gap:
        assert model is not None  # only an enumeration goes without
        if ledger.is_flat:
            # a Kriging of one value repeats it everywhere: it has seen no change, and so no bound of one
            return Gap(upper=inf, width=inf, coverage=COVERAGE, kind="model-based")
        loop_gap = modelled_gap(ledger, model, success, seed=seed, full=True)
        is_predicted = status in PREDICTED
        if loop_gap.width <= asked.tolerance * ledger.scale and not is_predicted:
            return loop_gap
        begun = sum(run.value is not None for run in ledger.runs if run.proposal in ("given", "start"))
        tested = backtested_gap(loop_gap, ledger, success, begun=begun, seed=seed)
        if not is_predicted:
            return tested
        return prediction_gap(tested, ledger, model, success, scale=asked.transform, seed=seed)

    gap = stated_gap(
        ledger,
        model,
        modelled,
        tolerance=asked.tolerance,
        lipschitz=asked.lipschitz,
        enclosure=asked.enclosure,
    )
    gaps.note(gap, ledger, full=True)
    missed = gap.kind == "model-based" and gap.width > asked.tolerance * ledger.scale
    own = sum(run.number > 0 and not run.proposal.startswith("attack") for run in ledger.runs)
    if status is Status.CONVERGED and missed and own >= asked.budget:
        status = Status.BUDGET  # the last runs, at corners, have widened the gap again
    best = ledger.best
    found = WorstCase(
        response=response_name(asked.response),
        unit="1",
        sense=asked.sense,
        value=float(best.value if best.value is not None else np.nan),
        parameters=best.parameters,
        confirmed=True,
        run_key=best.key,
        predicted=best.predicted,
        predicted_std=best.std,
        status=status,
        budget=asked.budget + (asked.attack or 0),
        seed=seed,
        runs=(*ledger.runs, *unseen),
        attack=attack,
        gap_history=tuple(gaps.looks),
        gap=replace(gap, upper=ledger.sign * gap.upper),
        audit=audit_runs(ledger, model, gap=gap, worst=reported, unseen=unseen, rng=stream(seed, "audit")),
        border=border_of(
            ledger,
            model,
            success,
            worst=reported,
            unseen=unseen,
            is_answer=asked.failures == "worst",
            given_are_even=asked.given_are_even,
            rng=stream(seed, "border"),
        ),
    )
    if found.border is not None and found.border.is_answer:
        # a bound of the values that runs give says nothing of the failure that is worse than they
        beyond = Gap(upper=ledger.sign * inf, width=inf, coverage=COVERAGE, kind="model-based", note=FAILED)
        found = replace(found, status=Status.FAILED, gap=beyond)
    if model is None:
        return found
    return replace(
        found,
        scale=used_scale(asked.transform, model, ledger.v),
        profile=profile_of(ledger, model, ledger.incumbent),
        baselines=measured_baselines(found.runs, sign=ledger.sign),
    )


def _last_model(ledger: Ledger, previous: SearchModel | None, asked: Arguments) -> SearchModel | None:
    """A Kriging of all runs; None where an enumeration of a few points left too few values for one."""
    if len(ledger.v) < FEWEST_RUNS:
        return None
    features = ledger.where.features(ledger.u_ok)
    return fit_search_model(
        features, ledger.v, previous=previous, seed=asked.seed, scale=asked.transform, sign=ledger.sign
    )
