"""Runs that are known beside those of a search: no worst case is stated below one of them.

A store holds the runs of other searches, of other responses and of later stages. A search does not start from
them, or it would not come out the same when it is resumed; what it states must not lie below any of them all
the same. Where one is worse than what was found, it is the worst case, and gap, audit and profile are told
anew from a Kriging that has seen it.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.errors import StudyError
from workbench.models.evaluator import Outcome, Reading
from workbench.models.values import is_value
from workbench.search.arguments import Arguments
from workbench.search.conclusion import concluded
from workbench.search.evidence.gap_history import GapHistory
from workbench.search.record import WorstCase
from workbench.search.runs.given_runs import Run
from workbench.search.runs.ledger import Ledger
from workbench.space.box import Space

__all__ = ["Stated", "admitted", "with_known_runs", "worst_beyond"]

SEEN_OF_ATTACK = 60  # the worst runs of an attack that the Kriging sees; thousands would cost more than runs


@dataclass(frozen=True, slots=True, kw_only=True)
class Stated:
    """A worst value that is about to be stated, its sense, and how and off which responses runs are read."""

    value: float
    sense: str
    read: Reading
    reads: Sequence[str]


def worst_beyond(space: Space, known: Iterable[Outcome], stated: Sequence[Stated]) -> list[list[Outcome]]:
    """For each stated value the worst of the known runs, in a list, where one is worse than it; else nothing.

    The runs are gone through once and none is held; the last of equal ones counts. Only of those that are
    worse it is looked at whether they lie inside the space.
    """
    found: list[list[Outcome]] = [[] for _ in stated]
    worst = [-float("inf")] * len(stated)
    for run in known:
        if run.status != "ok":
            continue
        for k, one in enumerate(stated):
            if not all(name in run.outputs for name in one.reads):
                continue
            sign = 1.0 if one.sense == "max" else -1.0
            value = sign * one.read(run.outputs)
            if not is_value(value) or value <= sign * one.value or value < worst[k]:
                continue
            if _is_inside(space, run):
                found[k], worst[k] = [run], value
    return found


def admitted(space: Space, known: Sequence[Outcome]) -> list[Outcome]:
    """The runs that gave values, lie inside the bounds of the space and meet its constraints."""
    return [o for o in known if o.status == "ok" and _is_inside(space, o)]


def with_known_runs(found: WorstCase, space: Space, asked: Arguments, known: Sequence[Outcome]) -> WorstCase:
    """`found`, or what is to be said where one of the known runs is worse.

    `asked`: what the search was asked for; the reading of the response and the sense are taken from it. Where
    runs have noise one of them says nothing of a mean, and `found` stays.
    """
    if found.repeated is not None:
        return found
    ledger = Ledger.opened(space, response=asked.response, sense=asked.sense, start=(), progress=None)
    runs = [ledger.run_of(o, number=0, proposal="known") for o in admitted(space, known)]
    with_value = [(ledger.sign * run.value, i) for i, run in enumerate(runs) if run.value is not None]
    if not with_value or max(with_value)[0] <= ledger.sign * found.value:
        return found
    worst = runs[max(with_value)[1]]
    ledger = Ledger.opened(
        space,
        response=asked.response,
        sense=asked.sense,
        start=[*_seen(found, ledger.sign), worst],
        progress=None,
    )
    again = concluded(
        ledger,
        asked,
        status=found.status,
        gaps=GapHistory(looks=list(found.gap_history)),
        previous=None,
        attack=None if found.attack is None else found.attack.raised_to(ledger.best_value),
    )
    return replace(
        again,
        run_key=worst.key,
        budget=found.budget,
        runs=(*found.runs, worst),
        baselines=found.baselines,
        made_again=found.made_again,
    )


def _seen(found: WorstCase, sign: float) -> list[Run]:
    """The runs of a search, and of an attack on it the worst ones."""
    own = [run for run in found.runs if not run.proposal.startswith("attack")]
    made = [run for run in found.runs if run.proposal.startswith("attack") and run.value is not None]
    made.sort(key=lambda run: -sign * (run.value if run.value is not None else np.nan))
    return [*own, *made[:SEEN_OF_ATTACK]]


def _is_inside(space: Space, outcome: Outcome) -> bool:
    if set(outcome.parameters) != set(space.names):
        return False
    row = dict(outcome.parameters)
    try:
        space.unit([row])
    except StudyError:
        return False
    return space.violated(row) is None
