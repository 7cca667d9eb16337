"""The robust loop: a layout for the worst cases found so far, and the worst case of that layout, in turn.

    S <- nominal case (and the worst case found without restraints)
    repeat   layout <- min over densities of max over S, by the engine        lower end: its worst over S
             worst  <- look at random corners; when they do not break the bound, search the whole uncertainty
             stop when the search exceeds the bound by less than the tolerance, else S <- S + what broke it

(cutting sets with a pessimising oracle, Mutapcic and Boyd 2009). A layout that random corners break needs no
search yet. The search treats every combination of words (hands on, hands off) on its own: a Kriging of all of
them together follows the combination that was worst without a layout, and misses the one that is worst with
it. Of the cases that broke the bound several join, far from each other (`workbench.cuts`).

A layout is judged by true runs alone. Every round also judges all earlier layouts and the trivial ones, so
what is returned is never worse than those over all cases found. The lower end is that of a local optimiser,
the upper end that of a search: both are stated as found, not proven.

The loop is a function of the study and of the runs' answers. Runs are kept by `LayoutRuns`, optimised layouts
and ended searches in `rounds/`, so after a kill the same call goes on: it repeats at most one optimisation.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from hashlib import blake2b
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.atomic import read_json, write_json
from workbench.case_layouts import Optimised, optimise_for_cases, trivial_layouts
from workbench.cuts import spread_out_worst
from workbench.engine.errors import EngineError
from workbench.errors import NotEnoughRuns, StudyError
from workbench.evaluator import Evaluator, Outcome
from workbench.layout_model import LayoutModel, layout_name
from workbench.space import Space
from workbench.streams import stream
from workbench.worst_case import search_worst_case

__all__ = [
    "NEAR",
    "SECOND",
    "Found",
    "LoopSettings",
    "RobustLayout",
    "Round",
    "find_robust_layout",
]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

SECOND = "second start"
MOST_COMBINATIONS = 6  # of words that are searched one by one
CORNERS_KEPT = 10  # known runs that a search begins with, the worst ones
NEAR = 0.6  # of the bound: cases below it are left out of an optimisation
JOINING = 6  # cases that join the next optimisation at most
BATCH = 4  # runs a search proposes at once, whatever the number of workers: the same numbers with 1 and 2


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopSettings:
    """evaluations: of the optimiser per round.  budget: runs of each search, one for every combination of
    words.  corners: random corners looked at before.  rounds: at most.  tolerance: relative excess of the
    worst case over the bound that is accepted."""

    evaluations: int = 30
    budget: int = 60
    corners: int = 100
    rounds: int = 6
    tolerance: float = 0.02
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The worst true run of a layout, and the credible excess that the search leaves open (model-based).

    others: further cases, far from it and from each other, with their values, largest first.
    """

    value: float
    case: Case
    runs: int
    status: str
    open_gap: float | None
    others: Sequence[Mapping[str, Any]] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Round:
    """bound: worst over the cases known at its start; worst: what the search found on the chosen layout."""

    number: int
    cases: int
    layout: str
    bound: float
    worst: float
    case: Case
    gap: float
    runs: int
    optimiser: str
    note: str = ""


@dataclass(slots=True, kw_only=True)
class RobustLayout:
    """What the loop found. `layouts`: name -> densities; `worst`: name -> the worst true run known."""

    robust: str
    certified: bool
    status: str
    layouts: dict[str, Array]
    worst: dict[str, Found]
    cases: list[dict[str, Any]]
    values: dict[str, list[float | None]]  # name -> value in every case
    rounds: list[Round]
    failures: list[str]
    document: Mapping[str, Any] = field(default_factory=dict)  # of the robust layout, as `layout.json`

    @property
    def bound(self) -> float:
        """The best layout's worst over all cases found."""
        return _largest(self.values[self.robust])


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
    loop = _Loop(
        model=model, space=space, evaluator=evaluator, folder=folder, settings=settings, identity=identity,
        tell=tell,
    )  # fmt: skip
    return loop.run(start)


@dataclass(slots=True, kw_only=True)
class _Loop:
    model: LayoutModel
    space: Space
    evaluator: Callable[[Array], Evaluator]
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
    rounds: list[Round] = field(default_factory=list)
    failures: list[str] = field(default_factory=list)

    def run(self, start: Sequence[Case]) -> RobustLayout:
        self.cases = _distinct([self.space.canonical(case) for case in start])
        nominal = self.optimised([0], None)
        if nominal is None:
            raise StudyError(f"the nominal case cannot be optimised: {self.failures[-1]}")
        self.layouts = {
            **trivial_layouts(self.model.problem(self.cases[:1])),
            "nominal only": nominal.density,
        }
        self.documents["nominal only"] = nominal.document
        certified = False
        for number in range(1, self.settings.rounds + 1):
            certified = self.round(number)
            if certified:
                break
        best = self.best()
        for name in [*self.layouts]:
            if name == best or (name != "none" and not name.startswith("round")):
                self.tell(f"worst case of the layout '{name}'")
                self.search(name)
        self.tell("the layout from a second start")
        self.second_start()
        return self.result(certified)

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
        bound = _largest(self.values(self.layouts[chosen]))
        limit = bound + self.settings.tolerance * abs(bound)
        found = self.look(chosen)
        if found.value <= limit:
            self.tell(
                f"round {number}: search the worst case of '{chosen}', bound {bound:.6g} {self.model.unit}"
            )
            found = self.search(chosen)
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
        self.cases = _distinct([*self.cases, dict(found.case), *also[: JOINING - 1]])
        return False

    def best(self) -> str:
        """The layout whose worst over the known cases is smallest."""
        known = {name: _largest(self.values(a)) for name, a in self.layouts.items()}
        return min(known, key=lambda name: known[name])

    def active(self, values: Sequence[float | None]) -> list[int]:
        """Cases for the optimiser: the new ones, and those near the bound of the layout it starts from.

        The others cost time and change nothing; every layout is judged in them all the same, and one that
        breaks there is not chosen.
        """
        bound = _largest(values)
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

    def look(self, name: str) -> Found:
        """The worst of the known cases and of random corners."""
        evaluate = self.evaluator(self.layouts[name])
        known = [*evaluate(self.cases, purpose="cases"), *evaluate(self.corners(), purpose="corners")]
        (value, top), *others = self.spread(known)
        self.worst[name] = Found(
            value=value, case=self.space.canonical(top.parameters), runs=len(known),
            status="random corners were looked at; a search was not needed", open_gap=None,
            others=[{"value": v, "case": dict(o.parameters)} for v, o in others],
        )  # fmt: skip
        return self.worst[name]

    def spread(self, outcomes: Sequence[Outcome]) -> list[tuple[float, Outcome]]:
        """The worst of these runs and others far from it, twice as many as may join."""
        found = spread_out_worst(self.space, outcomes, response=self.model.response, number=2 * JOINING)
        if not found:
            raise NotEnoughRuns("a layout gave a value in none of the cases; look at `holdfast failures`")
        return found

    def search(self, name: str) -> Found:
        """The worst case of a layout over the whole uncertainty; the known cases count as runs made."""
        parts = (self.identity, self.space.hash, layout_name(self.layouts[name]), self.cases, self.settings)
        text = repr(parts)
        place = self.folder / "rounds" / f"search-{_digest(text)}.json"
        found = read_json(place)
        if found is None:
            found = self._searched(self.layouts[name])
            place.parent.mkdir(parents=True, exist_ok=True)
            write_json(place, found)
        self.worst[name] = Found(**found)
        return self.worst[name]

    def _searched(self, density: Array) -> dict[str, Any]:
        """A look at random corners, then a search for every combination of words."""
        evaluate = self.evaluator(density)
        known = [*evaluate(self.cases, purpose="cases"), *evaluate(self.corners(), purpose="corners")]
        worst: list[dict[str, Any]] = []
        made = [*known]
        for words in _combinations(self.space):
            here = [o for o in known if all(o.parameters[name] == word for name, word in words.items())]
            worst.append(self._in_words(evaluate, words, here, made))
        top = max(worst, key=lambda found: found["value"])
        gaps = [found["open_gap"] for found in worst if found["open_gap"] is not None]
        return {
            "value": top["value"],
            "case": top["case"],
            "runs": sum(found["runs"] for found in worst) + self.settings.corners,
            "status": top["status"],
            "open_gap": max(gaps, default=None),
            "others": [
                {"value": v, "case": self.space.canonical(o.parameters)} for v, o in self.spread(made)[1:]
            ],
        }

    def _in_words(
        self, evaluate: Evaluator, words: Mapping[str, Any], known: Sequence[Outcome], made: list[Outcome]
    ) -> dict[str, Any]:
        """The worst case with these words fixed, from the worst known there; its runs go to `made`."""

        def read(o: Outcome) -> float:
            return o.outputs[self.model.response] if o.status == "ok" else -np.inf

        def fixed(rows: Sequence[Case], *, purpose: str) -> list[Outcome]:
            outcomes = evaluate([{**row, **words} for row in rows], purpose=purpose)
            made.extend(outcomes)
            return [replace(o, parameters=_without(o.parameters, words)) for o in outcomes]

        start = sorted(known, key=read, reverse=True)[:CORNERS_KEPT]
        found = search_worst_case(
            fixed,
            Space(tuple(p for p in self.space.parameters if p.name not in words), self.space.constraints),
            response=self.model.response,
            unit=self.model.unit,
            budget=self.settings.budget,
            seed=self.settings.seed,
            start=[replace(o, parameters=_without(o.parameters, words)) for o in start],
            workers=BATCH,
            tolerance=self.settings.tolerance / 4,
        )
        return {
            "value": found.value,
            "case": self.space.canonical({**found.parameters, **words}),
            "runs": found.evaluations,
            "status": found.status.value,
            "open_gap": float(found.gap.width) if np.isfinite(found.gap.width) else None,
        }

    def corners(self) -> list[dict[str, Any]]:
        """Random corners of the uncertainty; samples inside hardly ever meet one."""
        rng = stream(self.settings.seed, "corners")
        u = rng.integers(0, 2, (self.settings.corners, self.space.dimension)).astype(float)
        for j, parameter in enumerate(self.space.parameters):
            if not parameter.is_numeric:
                levels = parameter.unit_levels
                assert levels is not None
                u[:, j] = rng.choice(levels, len(u))
        rows = self.space.rows(u)
        return _distinct([row for row in rows if self.space.violated(row) is None])

    def second_start(self) -> None:
        """The last layout once more, from the start of the problem; searched when it looks better."""
        self.fresh = len(self.cases)
        made = self.optimised(self.active(self.values(self.layouts[self.best()])), None)
        if made is None:
            return
        known = _largest(self.values(self.layouts[self.best()]))
        for name in self.add(SECOND, made):
            if _largest(self.values(self.layouts[name])) < known:
                self.tell(f"worst case of the layout '{name}'")
                self.search(name)

    def result(self, certified: bool) -> RobustLayout:
        """Choose the layout whose worst known case is smallest."""
        self.cases = _distinct([*self.cases, *(dict(found.case) for found in self.worst.values())])
        values = {name: self.values(density) for name, density in self.layouts.items()}
        known = {name: _largest(row) for name, row in values.items()}
        robust = min(known, key=lambda name: known[name])
        for name, row in values.items():
            k = int(np.argmax([-np.inf if v is None else v for v in row]))
            before = self.worst.get(name)
            if before is None or known[name] > before.value:
                self.worst[name] = Found(
                    value=known[name], case=self.cases[k], runs=before.runs if before else 0,
                    status=before.status if before else "judged in the cases of the others alone",
                    open_gap=before.open_gap if before else None,
                )  # fmt: skip
        last = self.rounds[-1]
        # a layout that was chosen in the end without being the last one searched has to stand its own search
        found = self.worst[robust]
        held = certified and found.value <= max(last.bound, last.worst) * (1 + self.settings.tolerance)
        status = (
            f"The search found nothing more than {100 * last.gap:.2g} % above the bound: the loop is closed."
            if held
            else f"The rounds were spent with the worst case {100 * last.gap:.3g} % above the bound."
        )
        return RobustLayout(
            robust=robust, certified=held, status=status, layouts=self.layouts, worst=self.worst,
            cases=self.cases, values=values, rounds=self.rounds, failures=self.failures,
            document=self.documents.get(robust, {}),
        )  # fmt: skip


def _largest(values: Sequence[float | None]) -> float:
    """The worst of the values there are; a layout that runs in no case is as bad as can be."""
    there = [value for value in values if value is not None]
    if not there:
        raise NotEnoughRuns("a layout gave a value in none of the cases; look at `holdfast failures`")
    return max(there)


def _combinations(space: Space) -> list[dict[str, Any]]:
    """The combinations of words to search one by one; a single empty one when there are none, or too many."""
    words = [p for p in space.parameters if not p.is_numeric]
    found = [
        dict(zip((p.name for p in words), choice, strict=True))
        for choice in product(*(p.levels for p in words))
    ]
    few = len(found) <= MOST_COMBINATIONS and len(words) < len(space.parameters) and not space.constraints
    return found if few else [{}]


def _without(row: Case, names: Mapping[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in row.items() if name not in names}


def _digest(text: str) -> str:
    return blake2b(text.encode(), digest_size=8).hexdigest()


def _distinct(cases: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Cases in order, repeated ones once."""
    seen: dict[str, dict[str, Any]] = {}
    for case in cases:
        seen.setdefault(repr(sorted(case.items())), dict(case))
    return list(seen.values())
