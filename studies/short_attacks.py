"""What does the silence of a short attack say? Loops with attacks of 130 to 1 500 runs, against an outsider.

A drawn model has ten members that share one budget, and eight loads on them, of which the largest counts:

    f(a, u) = (sum over k of (s_k(u)^2/(0.1 + b_k a))^4)^(1/4)
    s_k(u) = r_k(word) e_k(u) max(0, c_k + w_k u)

over five to ten numbers in [0, 1] and one word of three. A load vanishes where its direction turns (a kink),
is r_k times as large under one of the words, and e_k times as large beyond a threshold of one number (a
cliff, as where a seat lets go). A run costs nothing, so that the outsider of `studies.loop_claims` may have
ten times the runs of any attack.

    held        the last attack broke nothing, whether it was long enough to close the loop or not
    beaten      by how much the outsider goes beyond the stated worst, in per cent
    may exceed  what the loop says about that
    gaps        by how much the layout of each round broke, in per cent

`python -m studies.short_attacks 0 20 130 400` prints twenty loops with attacks of 130 runs, and with 400;
with `--rounds 3` they are cut short. `--rivals` adds by how much uniform, nominal only and 50 random corners
optimised all at once are worse, over all cases found by anybody; the corners get as many runs as the loop
has made, those of its optimiser included.
"""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.loop_claims import ALLOWED, outsider
from studies.loop_rivals import CORNERS, Runs, counting, sample_approach
from workbench.engine.layout.formulation.problem import LayoutProblem, static_problem
from workbench.robust_layout.loop import find_robust_layout
from workbench.robust_layout.record import LoopSettings
from workbench.space.box import Space
from workbench.space.parameter import Parameter

__all__ = ["DrawnLoads", "Held", "arguments", "counted", "drawn_loads", "held"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

MEMBERS, LOADS, POWER = 10, 8, 4
WORDS = ("low", "middle", "high")
NUMBERS = (5, 10)  # of numbers beside the word
CLIFFS = 0.4  # share of the loads that have one
OUTSIDER = 15000  # runs


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnLoads:
    """offset (k,), slopes (k, d) of loads; carried (k, n) by members; by_word (k, 3); cliff: input, where, by
    which factor (k,), a factor of 1 where there is none."""

    offset: Array
    slopes: Array
    carried: Array
    by_word: Array
    cliff_at: NDArray[np.intp]
    threshold: Array
    factor: Array

    title = "drawn loads"
    response = "load"
    unit = ""
    members = MEMBERS

    @property
    def names(self) -> list[str]:
        """Of the numbers."""
        return [f"x{k}" for k in range(self.slopes.shape[1])]

    @property
    def space(self) -> Space:
        """The numbers and the word."""
        numbers = tuple(Parameter(name, lower=0.0, upper=1.0) for name in self.names)
        return Space((*numbers, Parameter("word", kind="categorical", levels=WORDS)))

    def _loads(self, case: Case) -> Array:
        u = np.array([case[name] for name in self.names])
        size = np.maximum(0.0, self.offset + self.slopes @ (2 * u - 1))
        size = size * self.by_word[:, WORDS.index(case["word"])]
        return np.where(u[self.cliff_at] > self.threshold, self.factor, 1.0) * size

    def value(self, density: Array, case: Case) -> tuple[float, Array]:
        """f and its slopes (n,)."""
        room = 0.1 + self.carried @ density
        parts = self._loads(case) ** 2 / room
        worst = float(parts.max())
        if worst == 0.0:
            return 0.0, np.zeros(MEMBERS)
        shares = (parts / worst) ** POWER
        value = worst * shares.sum() ** (1 / POWER)
        return value, -(value * shares / shares.sum() / room) @ self.carried

    def problem(self, scenarios: Sequence[Case]) -> LayoutProblem:
        """Over these cases."""

        def function(density: Array) -> tuple[Array, Array]:
            rows = [self.value(density, case) for case in scenarios]
            return np.array([value for value, _ in rows]), np.array([slope for _, slope in rows])

        start = np.full(MEMBERS, 1 / MEMBERS)
        return static_problem(function, start=start, budgets=[(np.ones(MEMBERS), 1.0)], names=("all",))

    def as_response(self, objective: float) -> float:
        """The same."""
        return objective

    def responses(self, density: Array, uncertain: Case) -> dict[str, float]:
        """One true run."""
        return {self.response: self.value(density, uncertain)[0]}


def drawn_loads(seed: int) -> DrawnLoads:
    """The model of a seed."""
    rng = np.random.default_rng([seed, 1717])
    d = int(rng.integers(NUMBERS[0], NUMBERS[1] + 1))
    by_word = np.ones((LOADS, len(WORDS)))
    by_word[np.arange(LOADS), rng.integers(0, len(WORDS), LOADS)] = rng.uniform(1.0, 1.5, LOADS)
    return DrawnLoads(
        offset=rng.uniform(0.0, 0.5, LOADS),
        slopes=rng.standard_normal((LOADS, d)) * (rng.random((LOADS, d)) < 0.6) / np.sqrt(d),
        carried=rng.random((LOADS, MEMBERS)) * (rng.random((LOADS, MEMBERS)) < 0.4),
        by_word=by_word,
        cliff_at=rng.integers(0, d, LOADS),
        threshold=rng.uniform(0.7, 0.98, LOADS),
        factor=np.where(rng.random(LOADS) < CLIFFS, rng.uniform(1.1, 1.4, LOADS), 1.0),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
    """What a loop said, and what the outsider found.    beaten: share beyond the stated worst.

    gaps: of the rounds, the last one last.    worse: by which share each rival is, over all cases found.
    """

    closed: bool
    holds: bool
    runs: int
    stated: float
    may_exceed: float
    beaten: float
    gaps: tuple[float, ...]
    worse: Mapping[str, float] = field(default_factory=dict)

    @property
    def is_true(self) -> bool:
        """Whether the outsider stayed within what was said."""
        return self.beaten <= (ALLOWED if self.closed else self.may_exceed)


def held(seed: int, *, budget: int, rounds: int = 12, rivals: bool = False) -> Held:
    """A loop with attacks of so many runs on the model of a seed.

    rivals: also judge what it is compared with, and 50 corners at once, over all cases found by anybody.
    """
    model = drawn_loads(seed)
    space, runs, (counted_model, optimised) = model.space, Runs(model), counting(model)
    settings = LoopSettings(
        scenarios=12, evaluations=12, budget=budget, corners=min(60, budget // 2), rounds=rounds, seed=seed
    )
    start = space.canonical({**{name: 0.5 for name in model.names}, "word": WORDS[0]})
    with TemporaryDirectory() as folder:
        found = find_robust_layout(
            counted_model, space, evaluator=runs.of, folder=Path(folder), start=[start],
            settings=settings, identity="drawn loads",
        )  # fmt: skip
    robust, stated = found.layouts[found.robust], found.worst[found.robust]
    spent = runs.made + optimised[0]
    worst, case = outsider(runs, robust, space, budget=OUTSIDER, seed=seed)
    worse = {}
    if rivals:
        others = {name: found.layouts[name] for name in ("uniform", "nominal only")}
        evaluations = max(1, spent // (CORNERS + 1))
        others["50 corners"] = sample_approach(model, space, start=start, evaluations=evaluations, seed=seed)
        cases = [*found.cases, case]
        cases += [outsider(runs, it, space, budget=OUTSIDER // 3, seed=seed)[1] for it in others.values()]
        least = runs.values(robust, cases).max()
        worse = {name: float(runs.values(it, cases).max() / least - 1.0) for name, it in others.items()}
    attack = stated.attack or {}
    return Held(
        closed=found.closed, holds=attack.get("excess") == 0.0, runs=attack.get("runs", 0),
        stated=stated.value, may_exceed=found.may_exceed, beaten=max(0.0, worst / stated.value - 1.0),
        gaps=tuple(r.gap for r in found.rounds), worse=worse,
    )  # fmt: skip


def main(first: int, loops: int, budgets: Sequence[int], rounds: int, *, rivals: bool) -> None:
    """Print a line for every loop, and what they count up to."""
    for budget in budgets:
        print(f"attacks of {budget} runs")
        print("seed  closed  held   runs  stated  may exceed   beaten  is true  gaps")
        made = []
        for seed in range(first, first + loops):
            made.append(one := held(seed, budget=budget, rounds=rounds, rivals=rivals))
            closed, holds, true = ("yes" if said else "no" for said in (one.closed, one.holds, one.is_true))
            gaps = " ".join(f"{100 * gap:.1f}" for gap in one.gaps)
            print(
                f"{seed:4d}  {closed:6s}  {holds:4s}  {one.runs:5d}  {one.stated:6.3f}  "
                f"{100 * one.may_exceed:8.2f} %  {100 * one.beaten:5.1f} %  {true:7s}  {gaps}",
                flush=True,
            )
            if rivals:
                worse = ", ".join(f"{name} {100 * share:.1f} % worse" for name, share in one.worse.items())
                print(f"      {worse}", flush=True)
        print(counted(made))


def counted(made: Sequence[Held]) -> str:
    """In how many of the loops that say the same it is true."""
    lines = []
    for title, among in (
        ("closed", [one for one in made if one.closed]),
        ("held, not closed", [one for one in made if one.holds and not one.closed]),
        ("open", [one for one in made if not one.holds]),
    ):
        if among:
            said = 100 * float(np.median([one.may_exceed for one in among]))
            true = sum(one.is_true for one in among)
            lines.append(f"{title}: true in {true} of {len(among)}, median of what is said {said:.3g} %")
    for name in made[0].worse:
        shares = np.array([one.worse[name] for one in made])
        lines.append(
            f"{name}: worse by {100 * np.median(shares):.3g} % in the median, at least by "
            f"{100 * shares.min():.2g} %, better in {(shares < 0).sum()} of {len(made)}"
        )
    return "\n".join(lines)


def arguments(words: Sequence[str]) -> Namespace:
    """The command line; what does not fit ends with a sentence and code 2."""
    parser = ArgumentParser(
        prog="python -m studies.short_attacks", description="What does the silence of a short attack say?"
    )
    parser.add_argument("first", nargs="?", type=int, default=0, help="seed of the first loop")
    parser.add_argument("loops", nargs="?", type=int, default=5, help="how many")
    parser.add_argument("budgets", nargs="*", type=int, default=[130, 1500], help="runs of every attack")
    parser.add_argument("--rounds", type=int, default=12, help="of every loop, at most")
    parser.add_argument("--rivals", action="store_true", help="uniform, nominal only and 50 corners, too")
    asked = parser.parse_args(words)
    for name, value in (
        ("loops", asked.loops),
        ("rounds", asked.rounds),
        *(("budget", b) for b in asked.budgets),
    ):
        if value < 1:
            parser.error(f"{name} needs to be 1 or more, got {value}")
    return asked


if __name__ == "__main__":
    said = arguments(sys.argv[1:])
    main(said.first, said.loops, said.budgets, said.rounds, rivals=said.rivals)
