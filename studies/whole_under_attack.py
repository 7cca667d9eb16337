"""At most so many whole members beside fractions of members, both under attack, for any layout model.

    in fractions   the same sum of densities, each between 0 and 1
    whole          `whole_members`: members that are there or not, in groups where they belong together

Both are made for the cases known and attacked by the adversary of the robust loop, with its scouts where the
model has runs at a longer step; what breaks one of them joins the cases, and both are searched on from the
best known while there are rounds. At the end an outsider with a sampler of his own (`studies.loop_claims`)
tries every layout, and all are judged over all cases that anybody found for any of them. The search takes
longer steps than the true runs, which alone are told.
"""

from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import numpy as np

from studies.loop_claims import outsider, runs_of_an_outsider
from studies.loop_rivals import Runs
from workbench.engine import optimise_layout
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.whole.spending import Spending
from workbench.engine.layout.whole_members import whole_members
from workbench.robust_layout.judged import JudgedLayouts
from workbench.robust_layout.model import LayoutModel
from workbench.robust_layout.oracle import LayoutOracle
from workbench.robust_layout.scenarios import stratified_cases
from workbench.robust_layout.scouts import SCOUTS
from workbench.space.box import Space

__all__ = ["Counted", "Effort", "Subject", "asked_effort", "count_members", "parser"]

Array = np.ndarray[Any, Any]
Case = Mapping[str, Any]

ALLOWED = 0.02  # by which an attack may exceed the known worst
NEAR = 0.6  # of the worst: cases below it are left out of a search


class Subject(Protocol):
    """What is laid out, for a number of members."""

    @property
    def space(self) -> Space:
        """The uncertainty."""

    @property
    def nominal(self) -> Case:
        """The nominal case."""

    def model(self, count: int) -> LayoutModel:
        """The layout model with a budget of so many members; its true runs do not depend on it."""

    def searched(self, count: int, cases: Sequence[Case]) -> LayoutProblem:
        """The problem of these cases in the steps of the search."""

    def groups(self, problem: LayoutProblem) -> Sequence[Sequence[int]]:
        """Members that are on or off together."""

    def spending(self, problem: LayoutProblem) -> Spending | None:
        """What anchors cost, where they are counted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """What each number of members may cost.

    scenarios: of the stratified set that it begins with.  fractions, whole: evaluations of each search.
    rounds: searches at most.  attack, outsider: true runs against each layout.  joining: cases at most that
    join after an attack.  seed: of all of these.
    """

    scenarios: int = 6
    fractions: int = 16
    whole: int = 50
    rounds: int = 1
    attack: int = 60
    outsider: int = 100
    joining: int = 4
    seed: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Counted:
    """What so many members give: worst responses over all cases found for any layout.

    stated: the worst of both layouts before the outsider came.  beyond: by which share he went beyond it.
    whole_density (members,): of zeros and ones.  anchors: points of what holds them that these members use,
    where they are counted.  rounds: searches that were made.
    """

    count: int
    uniform: float
    fractions: float
    whole: float
    stated: tuple[float, float]
    beyond: tuple[float, float]
    whole_density: Array
    anchors: int
    status: str
    rounds: int = 1

    @property
    def price(self) -> float:
        """What whole members cost beside fractions, relative to these."""
        return self.whole / self.fractions - 1.0


def count_members(
    subject: Subject, counts: Sequence[int], *, effort: Effort | None = None,
    tell: Callable[[str], None] = lambda text: None,
) -> list[Counted]:  # fmt: skip
    """Layouts of so many whole members and of fractions, attacked.

    tell: called with what is being done.
    """
    effort, any_model = effort or Effort(), subject.model(counts[0])
    runs = Runs(any_model)
    cases = [dict(subject.nominal), *stratified_cases(subject.space, effort.scenarios, seed=effort.seed)]
    judged = JudgedLayouts(evaluator=runs.of, model=any_model, cases=cases)
    made = [_Search(subject, count, judged, runs, effort, tell).made() for count in counts]
    stated = [(judged.worst(one.names[0]), judged.worst(one.names[1])) for one in made]
    beyond = []
    for one, worst in zip(made, stated, strict=True):
        met = []
        for name, value in zip(one.names, worst, strict=True):
            tell(f"{name}: the outsider")
            found, case = outsider(
                runs, judged.layouts[name], subject.space, budget=effort.outsider, seed=effort.seed
            )
            judged.join([case])
            met.append(max(0.0, found / value - 1.0))
        beyond.append((met[0], met[1]))
    return [
        Counted(
            count=one.count, uniform=judged.worst(one.uniform), fractions=judged.worst(one.names[0]),
            whole=judged.worst(one.names[1]), stated=stated[k], beyond=beyond[k],
            whole_density=judged.layouts[one.names[1]], anchors=one.anchors, status=one.status,
            rounds=one.rounds,
        )
        for k, one in enumerate(made)
    ]  # fmt: skip


@dataclass(slots=True, kw_only=True)
class _Made:
    """The layouts of one number of members, by their names among all that are judged."""

    count: int
    uniform: str
    names: tuple[str, str] = ("", "")
    anchors: int = -1
    status: str = ""
    rounds: int = 0
    known: dict[str, tuple[int, str]] = field(default_factory=dict)  # anchors and status of whole layouts


@dataclass(frozen=True, slots=True)
class _Search:
    """Both layouts of a number of members: searched, attacked, searched again for what broke them."""

    subject: Subject
    count: int
    judged: JudgedLayouts
    runs: Runs
    effort: Effort
    tell: Callable[[str], None]

    def made(self) -> _Made:
        """The best of each kind when nothing breaks them or the rounds are spent."""
        judged, effort, count = self.judged, self.effort, self.count
        model = self.subject.model(count)
        one = _Made(count=count, uniform=f"{count} spread evenly")
        judged.layouts[one.uniform] = np.full(model.members, count / model.members)
        fractions, whole = [one.uniform], [one.uniform]
        with TemporaryDirectory() as folder:
            oracle = LayoutOracle(
                model=model, space=self.subject.space, evaluator=judged.evaluator, folder=Path(folder),
                identity="study", budget=effort.attack, corners=0, seed=effort.seed, going_on=0,
                coarse=self.runs.coarse if hasattr(model, "coarsened") else None,
                scouts=SCOUTS * effort.attack,
            )  # fmt: skip
            for turn in range(1, effort.rounds + 1):
                one.rounds = turn
                active = self.active([*fractions, *whole])
                self.tell(f"{count} members, round {turn}: {len(active)} of {len(judged.cases)} cases")
                problem = self.subject.searched(count, active)
                # a whole layout is one of fractions, too: else a short search makes its price look small
                start = judged.layouts[judged.best([*fractions, *whole])]
                start_whole = judged.layouts[judged.best(whole)]
                relaxed = optimise_layout(
                    replace(problem, start=start), max_evaluations=effort.fractions, multi_start=turn == 1,
                    compare=False, probes=0,
                )  # fmt: skip
                fractions.append(f"{count} in fractions, round {turn}")
                judged.layouts[fractions[-1]] = relaxed.density
                found = whole_members(
                    replace(problem, start=start_whole), count, evaluations=effort.whole, seed=effort.seed,
                    groups=self.subject.groups(problem), spending=self.subject.spending(problem),
                )  # fmt: skip
                whole.append(f"{count} whole, round {turn}")
                judged.layouts[whole[-1]] = found.density
                one.known[whole[-1]] = found.anchors, found.status.name
                one.names = judged.best(fractions[1:]), judged.best(whole[1:])
                if not self.attacked(one.names, oracle, turn=turn):
                    break
        one.names = judged.best(fractions[1:]), judged.best(whole[1:])
        one.anchors, one.status = one.known[one.names[1]]
        return one

    def active(self, names: Sequence[str]) -> list[Case]:
        """Cases near the worst of one of these layouts, of all made so far: each forgets the others'."""
        near = set()
        for name in names:
            values, worst = self.judged.values(name), self.judged.worst(name)
            near |= {k for k, v in enumerate(values) if v is not None and v >= NEAR * worst}
        return [self.judged.cases[k] for k in sorted(near)]

    def attacked(self, names: Sequence[str], oracle: LayoutOracle, *, turn: int) -> bool:
        """Whether the adversary broke one of these layouts; what broke them joins the cases."""
        judged, broken = self.judged, False
        for name in names:
            bound = judged.worst(name)
            limit = (1.0 + ALLOWED) * bound
            found = oracle.attack(judged.layouts[name], judged.cases, limit=limit, turn=turn)
            unit = oracle.model.unit
            self.tell(f"attack {turn} on {name}: {bound:.4f} {unit}, attacked {found.value:.4f} {unit}")
            if found.value > limit:
                broken = True
                worse = [dict(other["case"]) for other in found.others if other["value"] > limit]
                judged.join([found.case, *worse[: self.effort.joining - 1]])
        return broken


def parser(module: str, purpose: str, *, counts: Sequence[int], effort: Effort) -> ArgumentParser:
    """What the command lines of these studies have in common."""
    ask = ArgumentParser(prog=f"python -m {module}", description=purpose)
    ask.add_argument("counts", nargs="?", default=tuple(counts), type=_counts, help="numbers, as 4,8,12")
    ask.add_argument("--rounds", type=int, default=effort.rounds, help="searches at most, each attacked")
    ask.add_argument("--scenarios", type=int, default=effort.scenarios, help="cases to begin with")
    ask.add_argument("--attack", type=int, default=effort.attack, help="runs of the adversary a layout")
    ask.add_argument(
        "--outsider", type=runs_of_an_outsider, default=effort.outsider, help="runs of the outsider a layout"
    )
    ask.add_argument("--seed", type=int, default=effort.seed, help="of cases, attacks and outsider")
    return ask


def asked_effort(given: Namespace, effort: Effort) -> Effort:
    """The effort with what the command line says of it."""
    names = ("rounds", "scenarios", "attack", "outsider", "seed")
    return replace(effort, **{name: getattr(given, name) for name in names})


def _counts(text: str) -> tuple[int, ...]:
    return tuple(int(number) for number in text.split(","))
