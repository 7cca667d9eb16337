"""The robust loop: a layout for the cases found so far, and an attack on that layout, in turn.

    S <- nominal case, the worst case found without restraints, a stratified set over the uncertainty
    repeat   layout <- min over densities of max over S, by the engine, from the best layout so far (the
                       first from the layout of the nominal case); that one itself, where it is as good
             worst  <- look at random corners; when they do not break the bound, spend evaluations until the
                       first-order condition holds, and send the adversary
             stop within the tolerance of the bound, or where rounds gain nothing; else S <- S + what broke it
    look at the layouts it is compared with, and optimise from other starts until one agrees with the best
    (`workbench.robust_layout.other_starts`); go on when they change it, or a sample goes beyond it

(cutting sets with a pessimising oracle, Mutapcic and Boyd 2009; the stratified set is the sample approach of
Calafiore and Campi 2006; the oracle is `workbench.robust_layout.oracle`). Of the cases that broke the bound
several join, far from each other (`workbench.robust_layout.cuts`).

True runs alone judge. At the end every layout ever made, the trivial ones included, is judged over all cases
found for any of them, and the best is the result. The lower end is that of a local optimiser, the upper end
that of an adversary: as found, not proven. Runs are kept by `LayoutRuns`, optimised layouts and ended attacks
in `rounds/`: after a kill the same call goes on, and repeats at most one optimisation.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.errors import StudyError
from workbench.models.evaluator import Evaluator
from workbench.robust_layout.cases import Optimised, Search, failing, optimise_for_cases, trivial_layouts
from workbench.robust_layout.cuts import distinct
from workbench.robust_layout.judged import ROUNDS, JudgedLayouts
from workbench.robust_layout.model import LayoutModel
from workbench.robust_layout.oracle import Found, LayoutOracle, is_settled, is_too_short
from workbench.robust_layout.other_starts import OtherStarts, starts_of
from workbench.robust_layout.record import (
    LoopSettings,
    OtherStartsFound,
    RobustLayout,
    Round,
    excess,
    is_as_good,
    loop_status,
    may_exceed,
    passed_over,
    reasons_against_green,
    rounds_are_spent,
)
from workbench.robust_layout.scenarios import stratified_cases
from workbench.robust_layout.scouts import SCOUTS
from workbench.space.box import Space

__all__ = ["NEAR", "find_robust_layout"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

NEAR = 0.6  # of the bound: cases below it are left out of an optimisation
LONGER = 2  # optimisations more, at most, of a layout that is not settled
LAST = 3  # layouts at least that may be attacked one after the other when the rounds are spent
SETTLED = 2  # best layouts that get more evaluations after the rounds, at most
GAIN = 1e-3  # relative improvement that is worth another one
RESTARTS = 2  # times that a sample beyond the bound sends the loop back


def find_robust_layout(
    model: LayoutModel,
    space: Space,
    *,
    evaluator: Callable[[Array], Evaluator],
    folder: Path,
    start: Sequence[Case],
    settings: LoopSettings,
    identity: str,
    tell: Callable[[str], None] = lambda text: None,
    coarse: Callable[[Array], Evaluator] | None = None,
    broken: Callable[[RobustLayout], Case | None] = lambda found: None,
) -> RobustLayout:
    """Run the loop from the cases in `start`, the nominal one first, and a stratified set.

    Args:
        evaluator: density -> evaluator of its true runs.    folder: where `rounds/` is kept.
        identity: changes when the model changes, so that stored layouts are not taken for current.
        coarse: density -> evaluator of its runs at a longer step, for scouts; None: no scouts are sent.
        broken: result -> a case beyond it, None without any. One sends the loop back, with all that it has.

    Raises:
        StudyError: the nominal case cannot be run, by the optimiser or at all.
        NotEnoughRuns: a layout fails in almost all cases.
    """
    oracle = LayoutOracle(
        model=model, space=space, evaluator=evaluator, folder=folder / "rounds", identity=identity,
        budget=settings.budget, corners=settings.corners, seed=settings.seed, going_on=settings.going_on,
        coarse=coarse, scouts=SCOUTS * settings.budget if settings.scouts is None else settings.scouts,
    )  # fmt: skip
    drawn = stratified_cases(space, settings.scenarios, seed=settings.seed)
    cases = distinct([space.canonical(case) for case in [*start, *drawn]])
    loop = _Loop(
        model=model, oracle=oracle, folder=folder, settings=settings, identity=identity, tell=tell,
        judged=JudgedLayouts(evaluator=evaluator, model=model, cases=cases),
    )  # fmt: skip
    found, left = loop.run(), RESTARTS
    while (case := broken(found)) is not None and left:
        found, left = loop.again(case), left - 1
    return found


@dataclass(slots=True, kw_only=True)
class _Loop:
    model: LayoutModel
    oracle: LayoutOracle
    folder: Path
    settings: LoopSettings
    identity: str
    tell: Callable[[str], None]
    judged: JudgedLayouts
    fresh: int = 0  # the first case that was added since the last optimisation
    unusable: set[int] = field(default_factory=set)  # cases that the optimiser cannot run
    worst: dict[str, Found] = field(default_factory=dict)
    bounds: dict[str, float] = field(default_factory=dict)  # of layouts that were attacked, at that time
    broke: dict[str, float] = field(default_factory=dict)  # bounds before, of those attacked again at the end
    rounds: list[Round] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)
    gained: dict[str, float | None] = field(default_factory=dict)  # too little, by evaluations at the end
    compared: bool = False  # with the layouts that are looked at once
    begins_at: Array | None = None  # the first round
    others: OtherStarts = field(init=False)
    earlier: int = 0  # rounds, before a sample sent the loop back
    searched: int = 0  # layouts that had got more evaluations by then
    as_they_are: set[str] = field(default_factory=set)  # those attacked again since

    def run(self) -> RobustLayout:
        nominal = self.optimised([0], None)
        if nominal is None:
            raise StudyError(f"the nominal case cannot be optimised: {self.failures[-1]}")
        problem = self.model.problem(self.judged.cases[:1])
        self.judged.layouts |= {**trivial_layouts(problem), "nominal only": nominal.density}
        self.judged.documents["nominal only"] = nominal.document
        self.judged.origins["nominal only"] = ROUNDS
        self.begins_at = nominal.density
        alone = None
        if len(self.judged.cases) > 1:  # for the other case in which the layout of the nominal one is worst
            alone = self.optimised([self.judged.worst_of("nominal only", since=1)], None)
        self.others = OtherStarts(
            judged=self.judged,
            optimised=lambda best, start, search: self.optimised(self.active(best), start, search),
            starts=starts_of(problem, None if alone is None else alone.density, seed=self.settings.seed),
            tolerance=self.settings.tolerance, tell=self.tell,
        )  # fmt: skip
        return self.to_the_end()

    def again(self, case: Case) -> RobustLayout:
        """Go on with every layout and case, and as many rounds more, from a case that breaks the result."""
        self.fresh = 0  # those near the bound were not enough
        self.judged.join([case])
        self.earlier, self.searched, self.as_they_are = len(self.rounds), len(self.gained), set()
        return self.to_the_end()

    def to_the_end(self) -> RobustLayout:
        """Rounds, other starts and last attacks, until the best layout holds or nothing is left."""
        while True:
            agreed = self.until_it_holds() and self.others.agree()
            self.others.first()
            robust = self.attacked_best()
            if agreed and self.holds(robust) and not self.others.agrees():  # what was found since parts them
                self.others.agree()
                robust = self.attacked_best()
            if self.holds(robust) or self.is_spent():
                return self.result(robust, self.others.found(robust))

    def until_it_holds(self) -> bool:
        """Rounds, until the best layout of all holds against an attack or they are spent; whether it does."""
        while not self.is_spent():
            if not self.round(len(self.rounds) + 1):
                continue
            if not self.compared:
                self.compared = True
                self.compare()
            if self.holds(self.chosen()):
                return True
        return False

    def is_spent(self) -> bool:
        """Whether no round is left, or the last ones gained nothing."""
        return rounds_are_spent(self.rounds[self.earlier :], self.judged.worst, self.settings)

    def limit(self, bound: float) -> float:
        """What a worst case may reach without breaking a bound."""
        return bound + self.settings.tolerance * abs(bound)

    def holds(self, name: str) -> bool:
        """Whether a layout was attacked, and neither that nor any case found since breaks its bound."""
        if name not in self.bounds:
            return False
        worst = max(self.worst[name].value, self.judged.worst(name))
        return worst <= self.limit(self.bounds[name])

    def chosen(self) -> str:
        """The best layout; one that holds, where none is better by half of what may be found beyond it."""
        holding = [name for name in self.bounds if self.holds(name)]
        return self.judged.best(rather=holding, within=self.settings.tolerance / 2)

    def round(self, number: int) -> bool:
        """One layout, looked at and perhaps attacked, at once where scouts climb or a round could make none
        that is better; True when nothing breaks the bound."""
        chosen, looked = self.judged.best(), None
        worst = self.judged.worst(chosen)
        if chosen not in self.bounds and is_as_good(worst, self.rounds, self.settings):
            count, optimiser = 0, ""
            note = "none is made, the best is as good in all cases as what the last round was made for"
            self.tell(f"round {number}: {note}")
        else:
            count, optimiser, note = self.improved(number)
            chosen = self.judged.best()
            if not self.oracle.scouts_climb:
                chosen, looked = self.settled_by_looks(number)
        bound = self.judged.worst(chosen)
        broken = looked if looked is not None and looked.value > self.limit(bound) else None
        found = broken or self.attack(chosen, number)
        self.rounds.append(Round(
            number=number, cases=count, layout=chosen, bound=bound, worst=found.value, case=found.case,
            gap=excess(found.value, bound), runs=found.runs, attacked=broken is None, optimiser=optimiser,
            note=note,
        ))  # fmt: skip
        if found.value <= self.limit(bound):
            return True
        self.tell(f"round {number}: broken, {found.value:.6g} {self.model.unit} instead of {bound:.6g}")
        if count:
            self.fresh = len(self.judged.cases)
        self.join(found, bound)
        return False

    def settled_by_looks(self, turn: int) -> tuple[str, Found]:
        """The best layout, with more evaluations as long as random corners do not break it."""
        for spent in range(1, LONGER + 2):
            name = self.judged.best()
            found = self.look_at(name, turn)
            broken = found.value > self.limit(self.judged.worst(name))
            if broken or spent > LONGER or not self.longer(name, f"round {turn}, evaluations added {spent}"):
                break
        return name, found

    def improved(self, number: int) -> tuple[int, str, str]:
        """Make the layout of a round, from the best one, at first from the nominal one whatever it is worth:
        for how many cases, how it ended, why there is none."""
        note = ""
        while True:
            best = self.judged.best()
            usable = self.active(best)
            self.tell(f"round {number}: layout for {len(usable)} of {len(self.judged.cases)} cases")
            start = self.judged.layouts[best] if self.rounds else self.begins_at
            made = self.optimised(usable, start)
            if made is not None:
                origin = self.judged.origins.get(best, ROUNDS)  # a trivial layout is where rounds begin
                self.judged.add(f"round {number}", made, origin=origin)
                return len(usable), str(made.document["status"]), note
            culprits = failing(self.model, [self.judged.cases[k] for k in usable], start)
            self.unusable |= {usable[k] for k in culprits}  # they still judge every layout by true runs
            note = self.failures[-1]
            if len(usable) == 1:
                return len(usable), "", note

    def longer(self, name: str, new: str) -> bool:
        """Spend more evaluations where the optimiser had not ended; True when they gave a better layout."""
        if not self.judged.is_unsettled(name):
            return False
        before = self.judged.worst(name)
        self.tell(f"more evaluations for the layout '{name}'")
        made = self.optimised(self.active(name), self.judged.layouts[name], "binding cases")
        if made is None:
            return False
        added = self.judged.add(new, made, origin=self.judged.origins[name], after=name)
        return min(self.judged.worst(n) for n in added) < before - GAIN * abs(before)

    def searched_on(self, name: str) -> str:
        """The best layout after more evaluations for this one.

        One that holds gives way only as in `chosen`; what gains less, or nothing, is left out and told.
        """
        known, before = set(self.judged.layouts), self.judged.worst(name)
        self.longer(name, f"evaluations added {len(self.gained) + 1}")
        made = set(self.judged.layouts) - known
        gain = max((excess(before, self.judged.worst(new)) for new in made), default=None)
        is_little = gain is not None and gain < self.settings.tolerance / 2
        self.gained[name] = gain if is_little else None  # what was worth an attack is told by that
        if gain == 0.0 or (is_little and self.holds(name)):
            self.judged.leave_out(made)
        return self.chosen()

    def join(self, found: Found, bound: float) -> None:
        """Let what broke a bound judge every layout from now on."""
        also = [dict(other["case"]) for other in found.others if other["value"] > self.limit(bound)]
        self.judged.join([found.case, *also[: self.settings.joining - 1]])

    def active(self, best: str) -> list[int]:
        """Cases for the optimiser: the new ones, and those near the bound for the layout it starts from or
        for the one made last. The others cost time and change nothing; they judge every layout all the same.
        """
        near = self.judged.near([best, self.judged.latest], share=NEAR, since=self.fresh)
        return [k for k in near if k not in self.unusable] or [0]

    def optimised(
        self, indices: Sequence[int], start: Array | None, search: Search = "all cases"
    ) -> Optimised | None:
        """The layout for these cases; None, with the reason in `failures`, when it cannot be made."""
        found = optimise_for_cases(
            self.model, [self.judged.cases[k] for k in indices], start=start, folder=self.folder / "rounds",
            evaluations=self.settings.evaluations, identity=self.identity, search=search,
        )  # fmt: skip
        if isinstance(found, str):
            self.failures.append(found)
            return None
        return found

    def look_at(self, name: str, turn: int) -> Found:
        limit = self.limit(self.judged.worst(name))
        found = self.oracle.look(self.judged.layouts[name], self.judged.cases, limit=limit, turn=turn)
        return self.keep(name, found)

    def attack(self, name: str, turn: int, *, to_the_end: bool = False) -> Found:
        """Against the worst known of a layout, which is its bound from now on."""
        bound = self.bounds[name] = self.judged.worst(name)
        self.tell(f"attack on the layout '{name}', bound {bound:.6g} {self.model.unit}")
        found = self.oracle.attack(
            self.judged.layouts[name], self.judged.cases, limit=self.limit(bound), turn=turn,
            to_the_end=to_the_end,
        )  # fmt: skip
        return self.keep(name, found)

    def keep(self, name: str, found: Found) -> Found:
        """Keep what was found; a look at a layout that was attacked leaves it its attack and a worse case."""
        self.worst[name] = found if found.attack is not None else found.after(self.worst.get(name))
        return found

    def compare(self) -> None:
        """Look at the layouts that it is compared with; what breaks the best one joins the cases."""
        best, turn = self.judged.best(), len(self.rounds)
        bound = self.judged.worst(best)
        for name in ("uniform", "nominal only"):
            found = self.look_at(name, turn)
            broken = self.judged.beyond(self.limit(bound), best, found)
            if broken:
                self.tell(f"broken by a case of the layout '{name}'")
                self.fresh = min(self.fresh, len(self.judged.cases))
                self.judged.join(broken[: self.settings.joining])

    def attacked_best(self) -> str:
        """The best layout over all cases found, settled and attacked; rounds that are left start there.

        Where none is left, each that is the best for the first time meets a raid; after as many as there were
        rounds, but three, the next is returned as it is. One that broke and is the best again, its bound
        raised to what broke it, meets a whole attack with numbers of its own, once: the last word.
        """
        self.fresh = len(self.judged.cases)
        turn, is_spent = len(self.rounds) + 1, self.is_spent()
        left = max(LAST, self.settings.rounds) if is_spent else None
        while True:
            self.judged.join([found.case for found in self.worst.values()])
            name = self.chosen()
            searched_on = name in self.gained or len(self.gained) - self.searched >= SETTLED
            if left != 0 and not searched_on and self.judged.is_unsettled(name):
                name = self.searched_on(name)
            if name not in self.bounds:
                if left == 0:
                    return name
                left = None if left is None else left - 1
                self.attack(name, turn)
            elif is_spent and not self.holds(name) and name not in self.as_they_are:
                self.as_they_are.add(name)
                self.broke[name] = self.bounds[name]
                self.attack(name, turn + 1, to_the_end=True)
            else:
                return name

    def result(self, robust: str, others: OtherStartsFound | None) -> RobustLayout:
        """Every layout judged over all cases found; `robust` is the best of them."""
        worst = self.judged.with_all_cases(self.worst)
        found, bound, holds = worst[robust], self.bounds.get(robust), self.holds(robust)
        held = found.attack if holds else None
        closed = held is not None and is_settled(held) and not is_too_short(held)
        broke, gained, document = self.broke.get(robust), self.gained.get(robust), self.judged.told(robust)
        attacked = self.bounds if bound is None else {robust: bound if broke is None else broke}
        breaks = [excess(worst[name].value, before) for name, before in attacked.items()]
        last = None if bound is None or broke is None else excess(found.value, bound)
        off = may_exceed(self.rounds, breaks, self.settings.tolerance, closed=closed, held=held, last=last)
        off = np.inf if self.oracle.tells_nothing and not closed else off
        status = loop_status(
            found, bound, closed=closed, holds=holds, broke=broke, off=off,
            idle=len(self.rounds) - self.earlier < self.settings.rounds,
        ) + passed_over(self.judged.best(), self.judged.worst, robust)  # fmt: skip
        return RobustLayout(
            robust=robust, closed=closed, may_exceed=off, status=status, document=document or {},
            layouts=dict(self.judged.layouts), worst=worst, cases=self.judged.cases,
            values={name: self.judged.values(name) for name in self.judged.layouts},
            rounds=list(self.rounds), failures=self.failures, other_starts=others,
            reasons=reasons_against_green(found, document, others, closed=closed, gained=gained),
        )  # fmt: skip
