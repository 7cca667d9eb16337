"""The robust loop: a layout for the worst cases found so far, and the worst case of that layout, in turn.

    S <- nominal case (and the worst case found without restraints)
    repeat   layout <- min over densities of max over S, by the engine        lower end: its worst over S
             worst  <- look at random corners; when they do not break the bound, search the whole uncertainty
             stop when the search exceeds the bound by less than the tolerance, else S <- S + what broke it
    search the layouts it is compared with; go on when a worst case of theirs breaks the bound

(cutting sets with a pessimising oracle, Mutapcic and Boyd 2009; the oracle is
`workbench.robust_layout.oracle`). Of the cases that broke the bound several join, far from each other
(`workbench.robust_layout.cuts`).

A layout is judged by true runs alone. Every round also judges all earlier layouts and the trivial ones, so
what is returned is never worse than those over all cases found. The lower end is that of a local optimiser,
the upper end that of a search: both are stated as found, not proven.

The loop is a function of the study and of the runs' answers. Runs are kept by `LayoutRuns`, optimised layouts
and ended searches in `rounds/`, so after a kill the same call goes on: it repeats at most one optimisation.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.engine.errors import EngineError
from workbench.errors import StudyError
from workbench.models.evaluator import Evaluator
from workbench.robust_layout.cases import Optimised, optimise_for_cases, trivial_layouts
from workbench.robust_layout.cuts import distinct
from workbench.robust_layout.model import LayoutModel
from workbench.robust_layout.oracle import Found, LayoutOracle
from workbench.robust_layout.record import LoopSettings, RobustLayout, Round, largest, loop_status
from workbench.space.box import Space

__all__ = ["NEAR", "SECOND", "find_robust_layout"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

SECOND = "second start"
NEAR = 0.6  # of the bound: cases below it are left out of an optimisation
JOINING = 6  # cases that join the next optimisation at most


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
) -> RobustLayout:
    """Run the loop from the cases in `start`, the nominal one first.

    Args:
        evaluator: density -> evaluator of its true runs.    folder: where `rounds/` is kept.
        identity: changes when the model changes, so that stored layouts are not taken for current.

    Raises:
        StudyError: the nominal case cannot be run, by the optimiser or at all.
        NotEnoughRuns: a layout fails in almost all cases.
    """
    oracle = LayoutOracle(
        model=model, space=space, evaluator=evaluator, folder=folder / "rounds", identity=identity,
        budget=settings.budget, corners=settings.corners, tolerance=settings.tolerance, seed=settings.seed,
    )  # fmt: skip
    loop = _Loop(
        model=model, space=space, evaluator=evaluator, oracle=oracle, folder=folder, settings=settings,
        identity=identity, tell=tell,
    )  # fmt: skip
    return loop.run(start)


@dataclass(slots=True, kw_only=True)
class _Loop:
    model: LayoutModel
    space: Space
    evaluator: Callable[[Array], Evaluator]
    oracle: LayoutOracle
    folder: Path
    settings: LoopSettings
    identity: str
    tell: Callable[[str], None]
    cases: list[dict[str, Any]] = field(default_factory=list)
    fresh: int = 0  # the first case that the last round added
    unusable: set[int] = field(default_factory=set)  # cases that the optimiser cannot run
    layouts: dict[str, Array] = field(default_factory=dict)
    documents: dict[str, Mapping[str, Any]] = field(default_factory=dict)
    worst: dict[str, Found] = field(default_factory=dict)
    searched: set[str] = field(
        default_factory=set
    )  # layouts whose worst case was searched, not just looked at
    rounds: list[Round] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def run(self, start: Sequence[Case]) -> RobustLayout:
        self.cases = distinct([self.space.canonical(case) for case in start])
        nominal = self.optimised([0], None)
        if nominal is None:
            raise StudyError(f"the nominal case cannot be optimised: {self.failures[-1]}")
        self.layouts = {
            **trivial_layouts(self.model.problem(self.cases[:1])),
            "nominal only": nominal.density,
        }
        self.documents["nominal only"] = nominal.document
        compared = [name for name in self.layouts if name != "none"]
        certified, number = False, 0
        while True:
            while not certified and number < self.settings.rounds:
                number += 1
                certified = self.round(number)
            for name in compared:
                if name not in self.searched:
                    self.search(name)
            if not certified or number == self.settings.rounds or not self.opened_again():
                break
            certified = False
        self.tell("the layout from a second start")
        self.second_start()
        return self.result(certified)

    def opened_again(self) -> bool:
        """Whether a case that was found for another layout breaks the best one; it joins the next round."""
        limit, known = self.limit(), len(self.cases)
        worst = largest(self.values(self.layouts[self.searched_best()]))
        if worst <= limit:
            return False
        self.tell(f"broken by the worst case of another layout, {worst:.6g} {self.model.unit}")
        self.fresh = known
        return True

    def searched_best(self) -> str:
        """The best layout over all cases found for any layout, its own worst case searched."""
        while True:
            self.cases = distinct([*self.cases, *(dict(found.case) for found in self.worst.values())])
            name = self.best()
            if name in self.searched:
                return name
            self.search(name)

    def limit(self) -> float:
        """What the layout of the last round may reach in cases found later for the loop to stay closed."""
        last = self.rounds[-1]
        return max(last.bound, last.worst) + self.settings.tolerance * abs(last.bound)

    def round(self, number: int) -> bool:
        """One layout, one search; True when the search does not break the bound."""
        best = self.best()
        usable = self.active(self.values(self.layouts[best]))
        self.tell(f"round {number}: layout for {len(usable)} of {len(self.cases)} cases")
        made = self.optimised(usable, self.layouts[best])
        name, note = f"round {number}", ""
        if made is None:
            self.unusable |= self.culprits(usable)  # they still judge every layout by true runs
            note = self.failures[-1]
            if len(usable) > 1:
                return self.round(number)
        else:
            self.add(name, made)
        chosen = self.best()
        bound = largest(self.values(self.layouts[chosen]))
        limit = bound + self.settings.tolerance * abs(bound)
        found = self.look_at(chosen)
        if found.value <= limit:
            found = self.search(chosen, bound)
        gap = max(0.0, found.value - bound) / abs(found.value) if found.value else 0.0
        self.rounds.append(
            Round(
                number=number, cases=len(usable), layout=chosen, bound=bound, worst=found.value,
                case=found.case, gap=gap, runs=found.runs,
                optimiser=str(made.document["status"]) if made else "", note=note,
            )
        )  # fmt: skip
        if gap <= self.settings.tolerance:
            return True
        self.tell(f"round {number}: broken, {found.value:.6g} {self.model.unit} instead of {bound:.6g}")
        self.fresh = len(self.cases)
        also = [dict(other["case"]) for other in found.others if other["value"] > limit]
        self.cases = distinct([*self.cases, dict(found.case), *also[: JOINING - 1]])
        return False

    def best(self) -> str:
        """The layout whose worst over the known cases is smallest."""
        known = {name: largest(self.values(a)) for name, a in self.layouts.items()}
        return min(known, key=lambda name: known[name])

    def active(self, values: Sequence[float | None]) -> list[int]:
        """Cases for the optimiser: the new ones, and those near the bound of the layout it starts from.

        The others cost time and change nothing; every layout is judged in them all the same, and one that
        breaks there is not chosen.
        """
        bound = largest(values)
        near = [k for k, v in enumerate(values) if k >= self.fresh or (v is not None and v >= NEAR * bound)]
        return [k for k in near if k not in self.unusable] or [0]

    def culprits(self, usable: Sequence[int]) -> set[int]:
        """Cases that fail on their own; the one added last when none does."""
        found = set()
        for k in usable:
            try:
                problem = self.model.problem([self.cases[k]])
                problem.checked(problem.into_budgets(problem.start.copy()))
            except (EngineError, ArithmeticError):
                found.add(k)
        return found or {usable[-1]}

    def add(self, name: str, made: Optimised) -> list[str]:
        """Judge an optimised layout from now on, and its purified form where that is no worse."""
        self.layouts[name], self.documents[name] = made.density, made.document
        clean = made.document.get("purified")
        if not clean or not clean["accepted"] or clean["value"] > clean["before"]:
            return [name]
        pure = f"{name}, purified"
        self.layouts[pure], self.documents[pure] = np.array(clean["density"]), made.document
        return [name, pure]

    def optimised(self, indices: Sequence[int], start: Array | None) -> Optimised | None:
        """The layout for these cases; None, with the reason in `failures`, when it cannot be made."""
        found = optimise_for_cases(
            self.model, [self.cases[k] for k in indices], start=start, folder=self.folder / "rounds",
            evaluations=self.settings.evaluations, identity=self.identity,
        )  # fmt: skip
        if isinstance(found, str):
            self.failures.append(found)
            return None
        return found

    def values(self, density: Array) -> list[float | None]:
        """The response of a layout in every case; None where it cannot be run."""
        outcomes = self.evaluator(density)(self.cases, purpose="cases")
        return [o.outputs[self.model.response] if o.status == "ok" else None for o in outcomes]

    def look_at(self, name: str) -> Found:
        self.worst[name] = self.oracle.look(self.layouts[name], self.cases)
        return self.worst[name]

    def search(self, name: str, bound: float | None = None) -> Found:
        until = "" if bound is None else f", bound {bound:.6g} {self.model.unit}"
        self.tell(f"search the worst case of the layout '{name}'{until}")
        self.searched.add(name)
        self.worst[name] = self.oracle.search(self.layouts[name], self.cases)
        return self.worst[name]

    def second_start(self) -> None:
        """The last layout once more, from the start of the problem; searched when it looks better."""
        self.fresh = len(self.cases)
        made = self.optimised(self.active(self.values(self.layouts[self.best()])), None)
        if made is None:
            return
        known = largest(self.values(self.layouts[self.best()]))
        for name in self.add(SECOND, made):
            if largest(self.values(self.layouts[name])) < known:
                self.search(name)

    def result(self, certified: bool) -> RobustLayout:
        """Choose the layout whose worst known case is smallest."""
        robust = self.searched_best()
        values = {name: self.values(density) for name, density in self.layouts.items()}
        known = {name: largest(row) for name, row in values.items()}
        for name, row in values.items():
            k = int(np.argmax([-np.inf if v is None else v for v in row]))
            before = self.worst.get(name)
            if before is None or known[name] > before.value:
                self.worst[name] = Found(
                    value=known[name], case=self.cases[k], runs=before.runs if before else 0,
                    status=before.status if before else "judged in the cases of the others alone",
                    open_gap=before.open_gap if before else None,
                )  # fmt: skip
        held = certified and self.worst[robust].value <= self.limit()
        status = loop_status(self.rounds[-1], self.worst[robust].value, certified=certified, held=held)
        return RobustLayout(
            robust=robust, certified=held, status=status, layouts=self.layouts, worst=self.worst,
            cases=self.cases, values=values, rounds=self.rounds, failures=self.failures,
            document=self.documents.get(robust, {}),
        )  # fmt: skip
