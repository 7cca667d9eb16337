"""The oracle of the robust loop: what breaks a layout over the whole uncertainty, by true runs.

`look` runs the known cases and fresh random corners: samples inside hardly ever meet a corner, and a layout
that breaks there needs no attack. `attack` sends the adversary of `workbench.search.evidence.attack` against
the bound: it has no surrogate, and every turn of the loop has a seed of its own, so that a layout is never
attacked by the numbers that it was mended for. It begins at the worst case known, with a part of its budget
that goes to corners and climbs alone: most layouts of a loop break there. One that does not meets the cases
that scouts at a longer step found worst (`workbench.robust_layout.scouts`), and then the rest, even draws
among it. Where scouts climb they go whatever the raid has met: they cost less than another layout, and tell
it many cases at a time. Where that breaks nothing but no two of its climbs from elsewhere arrived at the
worst, it goes on from there, three times at most. A layout that broke and is the best all the same is
attacked once more, to the end: what is said of it rests on the whole budget.

What breaks the bound is run again at half the step, where the model can (`refined`), before it is believed
(`workbench.search.evidence.attack.belief`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from hashlib import blake2b
from math import ceil, log, log1p
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import NotEnoughRuns
from workbench.models.evaluator import Evaluator, Outcome
from workbench.robust_layout.cuts import spread_out_worst
from workbench.robust_layout.model import LayoutModel, layout_name
from workbench.robust_layout.scouts import SCOUTS, worst_of_scouts
from workbench.search.evidence.attack.adversary import DEFAULT_SPLIT, Split, attack
from workbench.search.evidence.attack.belief import Believing
from workbench.search.evidence.attack.record import Attack
from workbench.search.evidence.attack.strata import Strata
from workbench.search.evidence.grade import ARRIVED, BEYOND, fewest_runs
from workbench.search.runs.unit_space import SearchSpace
from workbench.space.box import Space
from workbench.space.streams import stream
from workbench.system.atomic import read_json, write_json

__all__ = ["Found", "LayoutOracle", "budget_for", "is_settled", "is_too_short", "share_beyond"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

TURNS = 1000  # apart are the seeds of attacks that go on from those of other turns
RAIDS = 500  # the same, of raids
SCOUTED = 250  # the same, of what scouts chose
RAID = 0.4  # of the budget of an attack: no even draws, which a layout that breaks has no use for
CORNERS_FIRST = Split(interior=0.0, corner=0.25, near_corner=0.15)  # of the raid
THE_REST = Split(interior=0.4, corner=0.1, near_corner=0.05)  # of what it leaves
NOTICEABLE = 0.01  # of the worst value: a rise that leaves behind what climbs had arrived at
KEPT = 12  # of the runs, far from each other, that are told with the worst: no more can join a study's cases


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The worst true run of a layout, and how it was looked for.

    attack: the record of the adversary, None where none was sent.
    others: further cases, far from it and from each other, with their values, largest first.
    disbelieved: cases beyond the bound that were not beyond it at half the step, with both values.
    """

    value: float
    case: Case
    runs: int
    status: str
    attack: Mapping[str, Any] | None = None
    others: Sequence[Mapping[str, Any]] = ()
    disbelieved: Sequence[Mapping[str, Any]] = ()

    def after(self, before: "Found | None") -> "Found":
        """What is known after this look: a layout that was attacked keeps its attack, and a worse case."""
        if before is None or before.attack is None:
            return self
        return replace(before, value=self.value, case=self.case) if self.value > before.value else before


def budget_for(beyond: float) -> int:
    """The budget of an attack whose even draws, none of them beyond, say with 95 % confidence that no larger
    share of the uncertainty is.

    >>> budget_for(0.01)
    1246
    """
    draws = ceil(log(0.05) / log1p(-beyond))
    return ceil(draws / (THE_REST.interior * (1 - RAID)))


def is_settled(attack: Mapping[str, Any]) -> bool:
    """Whether another attack would say no more: all cases were run, or climbs from elsewhere arrived at the
    worst."""
    return bool(attack["exhaustive"]) or attack["arrived"] >= ARRIVED


def share_beyond(attack: Mapping[str, Any]) -> float:
    """How much of the uncertainty may lie beyond the limit that an attack did not break, with 95 %
    confidence, by its even draws; 0 where all cases were run."""
    return 0.0 if attack["exhaustive"] else float(attack["share"]["high"])


def is_too_short(attack: Mapping[str, Any]) -> bool:
    """Whether the silence of an attack says too little to close a loop."""
    return share_beyond(attack) > BEYOND


@dataclass(frozen=True, slots=True, kw_only=True)
class _Part:
    """Of what is spent on a layout.    seed: added to the number of the turn.

    scouts: at a longer step, whose worst cases are all that is run.    leads_on: though it breaks the layout.
    """

    seed: int
    budget: int
    split: Split
    is_last_of_an_attack: bool = True
    scouts: int = 0
    leads_on: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutOracle:
    """budget: true runs of each attack.    corners: random corners looked at before.
    evaluator: density -> evaluator of its true runs.    folder: where ended attacks are kept.
    identity: changes when the model changes.    going_on: attacks after the first, at most.
    coarse: density -> evaluator of runs at a longer step, None without.    scouts: such runs of an attack.
    """

    model: LayoutModel
    space: Space
    evaluator: Callable[[Array], Evaluator]
    folder: Path
    identity: str
    budget: int
    corners: int
    seed: int
    going_on: int = 3
    coarse: Callable[[Array], Evaluator] | None = None
    scouts: int = 0

    @property
    def scouts_climb(self) -> bool:
        """Whether scouts are so many that they climb: they tell a round many cases at a time."""
        return self.coarse is not None and self.scouts > SCOUTS * self.budget

    @property
    def tells_nothing(self) -> bool:
        """Whether attacks are so short that neither their silence nor what they find says how much worse
        another case may be."""
        return self.budget < min(fewest_runs(self.space.dimension), SearchSpace.of(self.space).size)

    def look(self, density: Array, cases: Sequence[Case], *, limit: float, turn: int) -> Found:
        """The worst of the known cases and of the random corners of this turn."""
        belief = self._belief(density, limit)
        known = [
            *belief(cases, purpose="cases"),
            *belief(self._corners(turn), purpose="corners"),
        ]
        status = "random corners were looked at; an attack was not needed"
        return self._found(known, belief, runs=len(known), status=status)

    def attack(
        self, density: Array, cases: Sequence[Case], *, limit: float, turn: int, to_the_end: bool = False
    ) -> Found:
        """The worst that an adversary finds against `limit`, or of the known cases; kept in `folder`.

        to_the_end: spend the rest of the budget on a layout that breaks in the raid, too.
        """
        by_name = [sorted(case.items()) for case in cases]
        text = repr((self.identity, self.space.hash, layout_name(density), by_name, limit, turn))
        text += repr((self.budget, self.seed, self.going_on, to_the_end))
        text += "" if self.coarse is None else repr(self.scouts)
        attacked = self._kept(
            "attack",
            text,
            lambda: asdict(self._attacked(density, cases, limit=limit, turn=turn, to_the_end=to_the_end)),
        )
        return Found(**attacked)

    def _kept(self, what: str, text: str, make: Callable[[], Any]) -> Any:
        """What was made once and is a function of `text`, in `folder`."""
        place = self.folder / f"{what}-{blake2b(text.encode(), digest_size=8).hexdigest()}.json"
        kept = read_json(place)
        if kept is None:
            kept = make()
            place.parent.mkdir(parents=True, exist_ok=True)
            write_json(place, kept)
        return kept

    def _scouted(
        self, density: Array, worst: tuple[Case, float] | None, *, limit: float, seed: int
    ) -> list[dict[str, Any]]:
        """The cases that scouts chose, worst known by then; kept in `folder`."""
        assert self.coarse is not None
        evaluate = self.coarse(density)
        case = None if worst is None else sorted(worst[0].items())
        text = repr((self.identity, self.space.hash, layout_name(density), case, limit, seed, self.scouts))
        found: list[dict[str, Any]] = self._kept(
            "scouts",
            text,
            lambda: worst_of_scouts(
                evaluate, self.space, response=self.model.response, limit=limit, known=worst,
                budget=self.scouts, attacked_by=self.budget, seed=seed,
            ),
        )  # fmt: skip
        return found

    def _attacked(
        self, density: Array, cases: Sequence[Case], *, limit: float, turn: int, to_the_end: bool
    ) -> Found:
        belief = self._belief(density, limit)
        known = belief(cases, purpose="cases")
        record = self._until_settled(density, belief, known, limit=limit, turn=turn, to_the_end=to_the_end)
        made = [*known, *(attempt.outcome for attempt in record.attempts)]
        found = self._found(made, belief, runs=record.runs, status=record.sentence)
        return Found(
            value=found.value, case=found.case, runs=found.runs, status=found.status, others=found.others,
            attack=record.to_dict(), disbelieved=found.disbelieved,
        )  # fmt: skip

    def _until_settled(
        self,
        density: Array,
        evaluate: Evaluator,
        known: Sequence[Outcome],
        *,
        limit: float,
        turn: int,
        to_the_end: bool,
    ) -> Attack:
        """An attack, its raid first, then what scouts chose; where it broke nothing and is not settled, more
        that begin at the worst known by then.

        What breaks the first limit breaks the layout, so a layout cannot pass by small rises of its worst.
        """
        name = self.model.response
        worst = max(
            ((o.parameters, o.outputs[name]) for o in known if o.status == "ok"), key=lambda one: one[1],
            default=None,
        )  # fmt: skip
        record: Attack | None = None
        for part in self._parts():
            replicate = turn + part.seed
            seed = int(stream(self.seed, "attack of a layout", replicate=replicate).integers(2**31))
            scouted = self._scouted(density, worst, limit=limit, seed=seed) if part.scouts else []
            if part.scouts and not scouted:
                continue
            made = attack(
                evaluate, self.space, value=limit, budget=len(scouted) or part.budget, seed=seed,
                response=name, split=part.split, known=[] if worst is None else [worst], scouted=scouted,
            )  # fmt: skip
            made = replace(made, scouts=part.scouts)
            if made.parameters is not None and made.largest is not None:
                if worst is None or made.largest > worst[1] + NOTICEABLE * abs(worst[1]):
                    # what climbs arrived at before is not the worst any more
                    record = None if record is None else replace(record, arrived=0)
                if worst is None or made.largest > worst[1]:
                    worst = (made.parameters, made.largest)
            record = made if record is None else record.and_then(made)
            ends, goes_on = part.is_last_of_an_attack, to_the_end or part.leads_on
            if (record.is_beaten and (ends or not goes_on)) or (ends and is_settled(record.to_dict())):
                break
        assert record is not None
        return record

    def _parts(self) -> list["_Part"]:
        """The raid and the rest of an attack, and those that may go on after it."""
        whole = _Part(seed=0, budget=self.budget, split=DEFAULT_SPLIT)
        raid = round(RAID * self.budget)
        first = [whole]
        if raid and SearchSpace.of(self.space).size > self.budget:
            first = [_Part(seed=RAIDS, budget=raid, split=CORNERS_FIRST, is_last_of_an_attack=False)]
            if self.coarse is not None and self.scouts:
                first.append(replace(first[0], seed=SCOUTED, scouts=self.scouts))
                first[0] = replace(first[0], leads_on=self.scouts_climb)
            first.append(_Part(seed=0, budget=self.budget - raid, split=THE_REST))
        if self.budget < fewest_runs(self.space.dimension):
            return first  # too short to say anything by its silence, however often
        return first + [replace(whole, seed=again * TURNS) for again in range(1, 1 + self.going_on)]

    def _belief(self, density: Array, limit: float) -> Believing:
        """The evaluator of a layout that runs at half the step what is beyond the limit."""
        return Believing(
            evaluate=self.evaluator(density), response=self.model.response, limit=limit,
            finer=lambda case: self._refined(density, self.space.canonical(case)),
        )  # fmt: skip

    def _found(self, outcomes: Sequence[Outcome], belief: Believing, *, runs: int, status: str) -> Found:
        """The worst believed run and others far from it."""
        left = list(outcomes)
        while True:  # without what is not believed, which hides its neighbours
            found = spread_out_worst(self.space, left, response=self.model.response, number=KEPT)
            doubtful = [outcome for _, outcome in found if not belief.believes(outcome)]
            if not doubtful:
                break
            left = [outcome for outcome in left if all(outcome is not other for other in doubtful)]
        disbelieved = [{**one, "case": self.space.canonical(one["case"])} for one in belief.disbelieved]
        if not found:
            raise NotEnoughRuns(
                f"all {len(disbelieved)} worst runs of a layout change beyond the tolerance at half the "
                "step: the model's step is too long"
                if disbelieved
                else "a layout gave a value in none of the cases; look at `holdfast failures`"
            )
        kept: list[dict[str, Any]] = [
            {"value": value, "case": self.space.canonical(outcome.parameters)} for value, outcome in found
        ]
        top, *others = kept
        return Found(
            value=top["value"], case=top["case"], runs=runs, status=status, others=others,
            disbelieved=disbelieved,
        )  # fmt: skip

    def _refined(self, density: Array, case: Case) -> float | None:
        """The response at half the step; None where the model has no such run, or it fails."""
        again = getattr(self.model, "refined", None)
        if again is None:
            return None
        try:
            return float(again(density, case)[self.model.response])
        except (ArithmeticError, ValueError, RuntimeError):
            return None  # a run that fails at half the step is no reason to call the case harmless

    def _corners(self, turn: int) -> list[dict[str, Any]]:
        """Random corners of the uncertainty, in equal shares of every combination of words."""
        if not self.corners:
            return []
        where = SearchSpace.of(self.space)
        rng = stream(self.seed, "corners", replicate=turn)
        points = Strata.of(where, rng=rng).corners(self.corners, rng)
        return [self.space.canonical(row) for row in where.rows(points)]
