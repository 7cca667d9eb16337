"""The attack on what a search found: the adversary's budget, and what becomes of its runs.

    attack = N       N true runs beside the budget of the search
    attack = None    what the search leaves of its budget when it stops by itself, no more runs than it made
                     itself, and none at all where too few are left to say anything

A worst case is called attacked after about 1 200 runs: `workbench.search.evidence.grade`.

The runs of an attack join those of the search. A Kriging of thousands of runs would cost more than the runs:
it sees the worst of them and some of the independent ones, up to `JOINED`. A search that had stopped by
itself with runs left goes on where the attack has found a noticeably worse case, or where its runs have
opened the gap again.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.models.evaluator import Evaluator, Outcome
from workbench.search.evidence.attack.adversary import attack
from workbench.search.evidence.attack.record import Attack, Attempt
from workbench.search.evidence.grade import fewest_runs
from workbench.search.loop import Loop
from workbench.search.record import Status
from workbench.search.runs.ledger import Ledger, Run, distinct

__all__ = ["Attacked", "attacked"]

JOINED = 60  # runs of an attack that the Kriging of the search sees
OPEN = (Status.CONVERGED, Status.CONSTANT, Status.NO_POINT)  # a search that stopped by itself


@dataclass(frozen=True, slots=True, kw_only=True)
class Attacked:
    """An attack on a search, why the search stopped in the end, and the runs that its Kriging did not see."""

    attack: Attack | None
    status: Status
    unseen: tuple[Run, ...] = ()


def attacked(search: Loop, status: Status) -> Attacked:
    """Attack the worst case of a finished search."""
    ledger, asked = search.ledger, search.asked
    budget = _budget(search, status)
    if not budget or ledger.is_exhausted:
        return Attacked(attack=None, status=status)
    claim = ledger.best_value
    made = attack(
        _told(search),
        ledger.where.space,
        value=claim,
        budget=budget,
        seed=asked.seed,
        sense=asked.sense,
        response=asked.response,
        claimed=ledger.best.parameters,
    )
    before = ledger.spent
    progress, ledger.progress = ledger.progress, None  # which has heard of them
    unseen = _joined(ledger, made)
    ledger.progress, ledger.apart = progress, len(unseen)
    if asked.attack is not None:
        search.searched += ledger.spent - before
    if status in OPEN and search.searched > ledger.spent:
        if made.since < made.runs:
            search.quiet = 0
        status = search.run()
    if status is Status.CONSTANT and not ledger.is_flat:
        status = Status.BUDGET  # the attack met other values, and no run is left to follow them
    return Attacked(attack=made.raised_to(ledger.best_value), status=status, unseen=unseen)


def _told(search: Loop) -> Evaluator:
    """What runs the rows of an attack, and tells the progress of the search of every new one as it comes."""
    ledger, best, made = search.ledger, search.ledger.best_value, search.ledger.spent
    known = ledger.u

    def evaluate(rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        nonlocal best, made
        outcomes = search.evaluate(rows, purpose=purpose)
        points = ledger.where.unit([dict(row) for row in rows])
        for point, outcome in zip(points, outcomes, strict=True):
            if ledger.progress is None or not len(distinct(point[None], known)):
                continue
            made += 1
            run = ledger.run_of(outcome, number=made, proposal=purpose)
            if run.value is not None and ledger.sign * run.value > ledger.sign * best:
                best = run.value
            ledger.progress(run, best)
        return outcomes

    return evaluate


def _budget(search: Loop, status: Status) -> int:
    asked, spent = search.asked, search.ledger.spent
    if asked.attack is not None:
        return asked.attack
    left = min(asked.budget - spent, spent) if status in OPEN else 0
    return left if left >= fewest_runs(search.ledger.where.dimension) else 0


def _joined(ledger: Ledger, made: Attack) -> tuple[Run, ...]:
    """Hand the runs of an attack to the search; those that its Kriging does not see come back."""
    new = [a for a in made.attempts if len(distinct(a.point[None], ledger.u))]
    seen = _telling(new, sign=ledger.sign)
    for i in sorted(seen):
        a = new[i]
        ledger.add([a.outcome], a.point[None], proposals=[f"attack: {a.kind}"])
    return tuple(
        ledger.run_of(a.outcome, number=ledger.spent + k + 1, proposal=f"attack: {a.kind}")
        for k, a in enumerate(a for i, a in enumerate(new) if i not in seen)
    )


def _telling(attempts: list[Attempt], *, sign: float) -> set[int]:
    """Places of the attempts for the Kriging: half of them the worst, the others the first drawn."""
    values = np.array([-np.inf if a.value is None else sign * a.value for a in attempts])
    worst = np.argsort(-values, kind="stable")[: JOINED // 2]
    drawn = [i for i, a in enumerate(attempts) if a.kind == "interior"][: JOINED // 2]
    return {int(i) for i in worst if np.isfinite(values[i])} | set(drawn)
