"""What the robust loop is asked for, its rounds, and what it found."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import NotEnoughRuns
from workbench.robust_layout.oracle import Found, budget_for, is_too_short, share_beyond
from workbench.search.evidence.attack.record import attackers
from workbench.search.evidence.attack.share import at_most
from workbench.search.evidence.grade import BEYOND
from workbench.space.units import counted

__all__ = [
    "FIRST_ORDER",
    "GOING_ON",
    "LoopSettings",
    "OtherStartsFound",
    "RobustLayout",
    "Round",
    "excess",
    "is_as_good",
    "largest",
    "loop_status",
    "may_exceed",
    "near_the_largest",
    "passed_over",
    "promise_of",
    "promise_over",
    "reasons_against_green",
    "rounds_are_spent",
]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

GOING_ON = 3  # attacks after the first, at most
FIRST_ORDER = 0.02  # relative promise of the linearised rows below which a layout is settled
IDLE = 3  # rounds one after the other that gained nothing
BROKEN = 3  # rounds that broke, the latest, tell what a short attack may have missed
AGAIN = 2  # times what the last attack on a layout found, at most, the next may find
TOLD = 1e-4  # the least excess that is told as it is
AT_HAND = 5  # tolerances between what the best layout is worth and what the last round was made for


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """How much the loop may spend, and when it is closed.

    scenarios: of the stratified set that it begins with.    evaluations: of the optimiser per round.
    budget: true runs of each attack.    corners: random ones looked at before.    rounds: at most, fewer
    where the last ones gain nothing (`rounds_are_spent`).
    tolerance: relative excess of the worst case over the bound that is accepted.
    going_on: attacks after the first, at most, where that one broke nothing and no two of its climbs arrived
    at the worst case.    scouts: runs at a longer step in each attack; None: `SCOUTS` times the budget.
    joining: cases that join the next optimisation, at most, of those that broke a layout.
    """

    scenarios: int = 24
    evaluations: int = 30
    budget: int = 1500
    corners: int = 100
    rounds: int = 12
    tolerance: float = 0.02
    seed: int = 0
    going_on: int = GOING_ON
    scouts: int | None = None
    joining: int = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """bound: worst over the cases known at its start; worst: what was then found on the chosen layout.

    cases: that a layout was made for; 0 where none was made, see `is_as_good`.

    runs: of the look or the attack that found it; attacked: whether it came to an attack.
    """

    number: int
    cases: int
    layout: str
    bound: float
    worst: float
    case: Case
    gap: float
    runs: int
    attacked: bool
    optimiser: str
    note: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherStartsFound:
    """worst: of a layout that descends from another start than the best one does, over the cases it is held
    beside the best one in: the first `cases` of those that were found, which were known when it was made.

    apart: by which share that lies above or below the best one, over these cases or over all: the larger.
    starts: where the layouts came from.
    """

    worst: float
    cases: int
    apart: float
    agrees: bool
    starts: tuple[str, ...]


@dataclass(slots=True, kw_only=True)
class RobustLayout:
    """What the loop found. `layouts`: name -> densities; `worst`: name -> the worst true run known.

    closed: the best layout was attacked, nothing was found beyond its bound and the tolerance, less than 1 %
    of the uncertainty lies beyond them, and climbs from elsewhere arrived at its worst case.
    may_exceed: by which share of the worst value another attack may find more, an estimate; infinity where
        attacks were too short for one.
    reasons: what keeps the verdict from being green, in sentences.
    """

    robust: str
    closed: bool
    status: str
    layouts: dict[str, Array]
    worst: dict[str, Found]
    cases: list[dict[str, Any]]
    values: dict[str, list[float | None]]  # name -> value in every case
    rounds: list[Round]
    failures: list[str]
    reasons: list[str]
    may_exceed: float
    other_starts: OtherStartsFound | None = None
    document: Mapping[str, Any] = field(default_factory=dict)  # of the robust layout, as `layout.json`

    def broken_by(self, value: float) -> None:
        """Take back what was said of a loop that a sample of the uncertainty goes beyond."""
        above = excess(value, self.worst[self.robust].value)
        said = f"a sample of the uncertainty lies {100 * above:.3g} % above its worst case"
        self.closed = False
        self.may_exceed = max(self.may_exceed, above)
        self.status = f"The samples were run, and {said}. The loop is not closed."
        self.reasons = [said, *(reason for reason in self.reasons if reason != said)]

    @property
    def bound(self) -> float:
        """The best layout's worst over all cases found."""
        return largest(self.values[self.robust])

    @property
    def grade(self) -> str:
        """What stands behind the worst case: "proved", "attacked" or "searched"."""
        attack = self.worst[self.robust].attack
        if not self.closed or attack is None:
            return "searched"
        return "proved" if attack["exhaustive"] and not attack["failures"] else "attacked"


def excess(worst: float, bound: float) -> float:
    """How far a worst case lies above a bound, as a share of the bound's size; the excess where it is 0."""
    above = max(0.0, worst - bound)
    return above / abs(bound) if bound else above


def _percent(share: float) -> str:
    """An excess in words: what is not nothing and less than a ten-thousandth counts as that.

    >>> _percent(9.2e-7), _percent(0.0), _percent(0.115)
    ('0.01 %', '0 %', '11.5 %')
    """
    return f"{100 * max(share, TOLD):.3g} %" if share else "0 %"


def may_exceed(
    rounds: Sequence[Round], breaks: Sequence[float], tolerance: float, *, closed: bool,
    held: Mapping[str, Any] | None = None, last: float | None = None,
) -> float:  # fmt: skip
    """By which share of the worst value another attack may find more: as much as attacks found lately.

    breaks: what attacks found beyond the bounds of the best layout, or of all where it met none.
    last: what the last one found on a layout that had broken before and was attacked as it is. By how much
        a layout is worse than in the cases that it was made for the first attack settles; how far attacks
        differ the last one tells, and the next may differ by twice as much.
    held: the attack on the best layout, where it broke nothing. What one missed that was too short to close
        the loop may be as bad as what broke the layouts of the last rounds; the first layout knew the cases
        of the start alone, and breaks by more, but where it was the only one that is all there is.
    """
    if closed:
        return tolerance
    if held is not None and is_too_short(held):
        told = rounds[1:] or rounds
        return max([r.gap for r in told if r.gap > tolerance][-BROKEN:], default=tolerance)
    lately = [r.gap for r in rounds if r.attacked][-2:]
    off = max([*lately, *breaks, *([] if held is None else [tolerance])], default=0.0)
    return off if last is None else min(off, max(AGAIN * last, tolerance))


def is_as_good(worst: float, rounds: Sequence[Round], settings: LoopSettings) -> bool:
    """Whether a layout is as good in all cases known as what the last round was made for in fewer of them,
    but for half of what may be found beyond one that holds: a layout made anew could gain no more.

    worst: of the layout, in all cases known.
    """
    made_for = [r.bound for r in rounds if r.cases][-1:]  # what those say that made one
    return any(worst <= bound + 0.5 * settings.tolerance * abs(bound) for bound in made_for)


def rounds_are_spent(rounds: Sequence[Round], worst: Callable[[str], float], settings: LoopSettings) -> bool:
    """Whether no round is left, or the last three gained less than half a tolerance over all cases known.

    worst: of a layout, over these cases. A round is made for what broke the one before, and what it is made
    for is met by as much elsewhere; more of them would go on so. Where the best layout is far above what the
    last round was made for, rounds still learn of a cliff, and go on.
    """
    if len(rounds) >= settings.rounds:
        return True
    if len(rounds) <= IDLE:
        return False
    before = min(worst(r.layout) for r in rounds[:-IDLE])
    best = min(before, *(worst(r.layout) for r in rounds[-IDLE:]))
    made_for = rounds[-1].bound
    is_at_hand = best - made_for < AT_HAND * settings.tolerance * abs(made_for)
    return is_at_hand and before - best < 0.5 * settings.tolerance * abs(best)


def loop_status(
    found: Found, bound: float | None, *, closed: bool, holds: bool = False, broke: float | None = None,
    idle: bool = False, off: float = 0.0,
) -> str:  # fmt: skip
    """Whether the loop is closed, in a sentence.

    found: of the best layout.    bound: over the known cases when it was attacked, None if it was not.
    holds: nothing was found beyond the tolerance.
    broke: the bound before, of a layout that an attack had broken and that was attacked again as it is.
    idle: rounds were left, of which nothing more was hoped.
    off: by which share another attack may find more, see `may_exceed`; infinity where that is not known.
    """
    ended = "The last rounds gained nothing" if idle else "The rounds were spent"
    if bound is None:
        return (
            f"{ended}, and attacks broke the layouts that were better before. This one is the "
            "best in the cases that are known by now; it was not attacked itself. The loop is not closed."
        )
    above = _percent(excess(found.value, bound)) if bound else f"{found.value:.3g}"
    scouts = 0 if found.attack is None else found.attack.get("scouts", 0)  # none in attacks kept from before
    raised = ""
    if broke is not None:
        by = f"{100 * excess(bound, broke):.3g} %"
        raised = f"An earlier bound was broken by {by}, and what broke it is the bound now. "
    said = f"{raised}{attackers(found.runs, scouts)} found nothing more than {above} above the bound"
    if holds and found.attack is not None:
        high = share_beyond(found.attack)
        if closed:
            less = f" With 95 % confidence less than {at_most(high)} of the uncertainty lies beyond"
            return (
                f"{said}: the loop is closed.{f'{less} the tolerance{_lost(found.attack)}.' if high else ''}"
            )
        if is_too_short(found.attack):
            more = (
                f": another may find {_percent(off)} more" if np.isfinite(off)
                else ", or to say how much more another may find"
            )  # fmt: skip
            return (
                f"{said}. That is too short an attack to call the loop closed{more}. "
                f"Up to {at_most(high)} of the uncertainty may lie beyond the tolerance"
                f"{_lost(found.attack)}; less than {at_most(BEYOND)} takes budget = {budget_for(BEYOND)}."
            )
        arrived, climbs = found.attack["arrived"] or "none", found.attack["climbs"]
        return (
            f"{said}, but {arrived} of {climbs} climbs from elsewhere arrived at the worst of them: another "
            "may end higher. The loop is not closed."
        )
    how = "the last attack" if found.attack is not None else "the last look at random corners"
    if np.isinf(off):
        return (
            f"{raised}{ended}, and {how} found {above} above the bound: attacks as short as these do not say "
            "how much more another may find. The loop is not closed."
        )
    is_more = bound and off > excess(found.value, bound) + TOLD
    more = f"{_percent(off)} more" if is_more else "as much again"
    return (
        f"{raised}{ended}, and {how} found {above} above the bound: another may find {more}. "
        "The loop is not closed."
    )


def _lost(attack: Mapping[str, Any]) -> str:
    """How many of the cases that tell of the uncertainty gave no value, which may be worse cases."""
    failing = attack.get("failing")  # none in attacks kept from before
    if not failing or not failing["hits"]:
        return ""
    return f" ({failing['hits']} of {failing['draws']} even draws gave no value)"


def passed_over(least: str, worst: Callable[[str], float], robust: str) -> str:
    """A sentence where the layout that is the least in the known cases is not the one returned; else nothing,
    and nothing where it is lower by less than can be told, as the same layout from another search is.

    worst: of a layout, over these cases.
    """
    lower = excess(worst(robust), worst(least))
    if lower < TOLD:
        return ""
    return (
        f" In the cases known the layout '{least}' is {_percent(lower)} lower, less than half of the "
        "tolerance; returned is the one that withstood an attack."
    )


def largest(values: Sequence[float | None]) -> float:
    """The worst of the values there are; a layout that runs in no case is as bad as can be."""
    there = [value for value in values if value is not None]
    if not there:
        raise NotEnoughRuns("a layout gave a value in none of the cases; look at `holdfast failures`")
    return max(there)


def near_the_largest(values: Sequence[float | None], share: float) -> float:
    """From which value on a case is near the worst: a share of that; of responses that may be negative, as a
    clearance with its sign turned is, of the way up to it from the smallest of the values.

    >>> near_the_largest([1.0, 5.0, None], 0.6), near_the_largest([-9.0, -4.0], 0.6)
    (3.0, -6.0)
    """
    low = min([0.0, *(value for value in values if value is not None)])
    return low + share * (largest(values) - low)


def promise_of(document: Mapping[str, Any]) -> float:
    """By which share of the value the linearised rows of a layout could still fall; infinity if unknown."""
    return float("inf") if document["kkt"] is None else float(document["kkt"])


def promise_over(document: Mapping[str, Any], beyond: float) -> float | None:
    """By which share of its worst a layout could still fall, `beyond` being the share by which cases found
    since the search lie above its optimum: no layout is better in more cases than the optimum in some.
    """
    promise = promise_of(document)
    return (promise + max(beyond, 0.0)) / (1.0 + max(beyond, 0.0)) if promise < float("inf") else None


def reasons_against_green(
    worst: Found, document: Mapping[str, Any] | None, others: OtherStartsFound | None, *, closed: bool,
    gained: float | None = None,
) -> list[str]:  # fmt: skip
    """An open loop, an optimiser at its limit, starts that disagree, an attack that leaves doubts.

    worst: of the layout returned.    document: of its optimisation, None where no optimiser made it.
    others: layouts from other starts, None where none could be made.
    gained: what more evaluations gained over the cases known, where that was too little for another attack.
    """
    said = [] if closed else ["the loop is not closed"]
    if document is not None and promise_of(document) > FIRST_ORDER:
        ended = "ended" if document["converged"] else "stopped at its limit"
        more = "" if gained is None else (
            f" (more evaluations gained {100 * gained:.2g} % in the cases known by then)"
        )  # fmt: skip
        said.append(
            f"the optimiser {ended} where the first-order condition is off by "
            f"{100 * promise_of(document):.2g} %: a better layout may stand nearby{more}"
        )
    if others is None:
        said.append("no layout could be made from another start: a better one may stand elsewhere")
    elif not others.agrees:
        said.append(f"layouts from other starts came no nearer to this one than {100 * others.apart:.3g} %")
    if worst.attack is not None and any(worst.attack["failures"].values()):
        said.append(f"{counted(sum(worst.attack['failures'].values()), 'run')} of the attack gave no value")
    if worst.disbelieved:
        said.append(f"{counted(len(worst.disbelieved), 'case changes', 'cases change')} at half the step")
    return said
