"""Does a robust layout hold where an outsider looks, and is it better than what plainer ways give?

The occupant of the demo in random boxes inside its uncertainty, in steps of 4 ms. In each: the robust loop
with the demo's budgets, the sample approach (50 random corners optimised all at once, with as many engine
runs as the loop has made), uniform, and nominal only. Every layout is then tried by an outsider who shares
nothing with the loop's adversary: a third of the runs inside, a third in corners, the rest changes of one
parameter at a time from the worst. All layouts are judged over all cases found by anybody.

    excess      by how much the outsider beats the loop's stated worst, in per cent
    may exceed  what the loop said about that

`python -m studies.loop_rivals 3 1500` prints three boxes with 1 500 runs of the outsider on each layout.
"""

import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from studies.occupant_braking import NOMINAL, restraint
from workbench.engine.errors import EngineError
from workbench.engine.layout.bound.binding import ByScenario
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.optimise import optimise_layout
from workbench.models.evaluator import Evaluator, Outcome
from workbench.robust_layout.loop import find_robust_layout
from workbench.robust_layout.model import LayoutModel, layout_name
from workbench.robust_layout.record import LoopSettings
from workbench.robust_layout.scouts import coarse_runs
from workbench.space.box import Space
from workbench.study.loading import load_study

__all__ = ["CORNERS", "Runs", "box", "counting", "drawn_case", "outsider", "row", "sample_approach"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]
M = TypeVar("M", bound=LayoutModel)

SETTINGS = LoopSettings(scenarios=18, evaluations=12, budget=1500, corners=90, rounds=6, tolerance=0.02)
CORNERS = 50
KEPT = 0.6  # of a range at least stays in a box


@dataclass(slots=True)
class Runs:
    """True runs of layouts in memory, in two threads; `made` counts them, and those of scouts as if they
    cost as much."""

    model: LayoutModel
    known: dict[tuple[str, str], Outcome] = field(default_factory=dict)
    made: int = 0

    def of(self, density: Array) -> Evaluator:
        """The evaluator of one layout."""
        name = layout_name(density)

        def one(row: Case) -> Outcome:
            try:
                outputs = self.model.responses(density, row)
            except (EngineError, ArithmeticError) as error:
                return Outcome(parameters=row, status="failed", error=str(error))
            return Outcome(parameters=row, status="ok", outputs=outputs)

        def evaluate(rows: Sequence[Case], *, purpose: str) -> list[Outcome]:
            keys = [(name, repr(sorted(row.items()))) for row in rows]
            new = {key: row for key, row in zip(keys, rows, strict=True) if key not in self.known}
            with ThreadPoolExecutor(2) as threads:
                self.known |= dict(zip(new, threads.map(one, new.values()), strict=True))
            self.made += len(new)
            return [self.known[key] for key in keys]

        return evaluate

    def coarse(self, density: Array) -> Evaluator:
        """The evaluator of scouts for one layout."""
        of = coarse_runs(self.model, threads=1)
        assert of is not None
        inner = of(density)

        def evaluate(rows: Sequence[Case], *, purpose: str) -> list[Outcome]:
            self.made += len(rows)
            return inner(rows, purpose=purpose)

        return evaluate

    def values(self, density: Array, rows: Sequence[Case]) -> Array:
        """The response of a layout in these cases, minus infinity where it fails."""
        return self.read(self.of(density)(rows, purpose="study"))

    def read(self, outcomes: Sequence[Outcome]) -> Array:
        """The response of these runs, minus infinity where one failed."""
        return np.array([o.outputs.get(self.model.response, -np.inf) for o in outcomes])


def box(rng: np.random.Generator) -> Space:
    """A random box inside the demo's: each range keeps a part of at least `KEPT`, all words stay."""
    space = load_study(str(files("studies") / "occupant_demo.toml")).space
    narrowed = []
    for p in space.parameters:
        if p.lower is None or p.upper is None:
            narrowed.append(p)
            continue
        width = (p.upper - p.lower) * rng.uniform(KEPT, 1.0)
        low = p.lower + rng.random() * (p.upper - p.lower - width)
        if p.step is not None:
            low, width = p.lower + p.step * round((low - p.lower) / p.step), p.step * round(width / p.step)
        narrowed.append(replace(p, lower=low, upper=low + width))
    return Space(tuple(narrowed))


def nominal(space: Space) -> dict[str, Any]:
    """The nominal case, moved into the box."""
    return {
        p.name: NOMINAL[p.name] if p.lower is None or p.upper is None else
        float(np.clip(NOMINAL[p.name], p.lower, p.upper))
        for p in space.parameters
    }  # fmt: skip


def drawn_case(space: Space, rng: np.random.Generator, *, corner: bool) -> dict[str, Any]:
    """A random case of a space, or one of its corners."""
    case: dict[str, Any] = {}
    for p in space.parameters:
        if p.lower is None or p.upper is None:
            case[p.name] = str(rng.choice(p.levels))
        else:
            width = p.upper - p.lower
            share = float(rng.integers(2)) if corner else rng.random()
            if p.step is not None:
                share = p.step * round(share * width / p.step) / width
            case[p.name] = p.lower + share * width
    return space.canonical(case)


def outsider(runs: Runs, density: Array, space: Space, *, budget: int, seed: int) -> list[Case]:
    """The worst cases that a plain search finds on a layout, worst first."""
    rng = np.random.default_rng([seed, 77])
    cases = [drawn_case(space, rng, corner=k % 2 == 0) for k in range(2 * budget // 3)]
    values = runs.values(density, cases)
    left = budget - len(cases)
    for start in np.argsort(-values)[:20]:
        case, value, gained = cases[start], values[start], True
        while gained and left > 0:
            near = []
            for p in space.parameters:
                ends = p.levels if p.lower is None else (p.lower, p.upper)
                near += [space.canonical({**case, p.name: end}) for end in ends if end != case[p.name]]
            near = [near[k] for k in rng.permutation(len(near))[:left]]
            found = runs.values(density, near)
            left -= len(near)
            cases, values = cases + near, np.append(values, found)
            best = int(found.argmax())
            gained = bool(found[best] > value)
            if gained:
                case, value = near[best], found[best]
    return [cases[k] for k in np.argsort(-values)[:10]]


def sample_approach(model: LayoutModel, space: Space, *, start: Case, evaluations: int, seed: int) -> Array:
    """The layout for the case `start` and random corners, optimised all at once."""
    rng = np.random.default_rng([seed, 50])
    cases = [start, *(drawn_case(space, rng, corner=True) for _ in range(CORNERS))]
    return optimise_layout(model.problem(cases), max_evaluations=evaluations).density


def counting(model: M) -> tuple[M, list[int]]:
    """The model, and the number of simulations that its problems have made since."""
    made = [0]

    class Counted:
        """Counts the simulations of optimisations; all else is the model's."""

        def __getattr__(self, name: str) -> Any:
            return getattr(model, name)

        def problem(self, scenarios: Sequence[Case]) -> LayoutProblem:
            problem = model.problem(scenarios)
            by_scenario = isinstance(problem.evaluate, ByScenario)
            kind = _CountedByScenario if by_scenario else _CountedObjective
            return replace(problem, evaluate=kind(problem.evaluate, len(scenarios), made))

    return cast(M, Counted()), made


@dataclass(slots=True)
class _CountedObjective:
    """An objective of so many scenarios, which adds them to `made` at every evaluation."""

    inner: Callable[..., Any]
    scenarios: int
    made: list[int]

    def __call__(self, *args: Any, **options: Any) -> Any:
        self.made[0] += self.scenarios
        return self.inner(*args, **options)


class _CountedByScenario(_CountedObjective):
    """One that can be evaluated in some of its scenarios: a search by those that bind stays one."""

    __slots__ = ()

    def of_scenarios(self, chosen: Sequence[int]) -> _CountedObjective:
        """The objective of these alone."""
        inner = cast(ByScenario, self.inner)
        return _CountedObjective(inner.of_scenarios(chosen), len(chosen), self.made)


def row(seed: int, *, budget: int, settings: LoopSettings = SETTINGS, steps: int = 500) -> dict[str, Any]:
    """One box: the loop's claims, what the outsider found, and the worst of each layout over all cases."""
    space = box(np.random.default_rng([seed, 3]))
    model = restraint(steps=steps)
    runs = Runs(model)
    counted, simulated = counting(model)
    with TemporaryDirectory() as folder:
        found = find_robust_layout(
            counted, space, evaluator=runs.of, folder=Path(folder), start=[nominal(space)],
            settings=replace(settings, seed=seed), identity="study", coarse=runs.coarse,
        )  # fmt: skip
    spent = runs.made + simulated[0]
    layouts = {
        "robust": found.layouts[found.robust],
        "sample approach": sample_approach(
            model, space, start=nominal(space), evaluations=spent // (CORNERS + 1), seed=seed
        ),
        "uniform": found.layouts["uniform"],
        "nominal only": found.layouts["nominal only"],
    }
    cases: list[Case] = list(found.cases)
    beaten = 0.0
    for name, density in layouts.items():
        worst = outsider(runs, density, space, budget=budget, seed=seed)
        if name == "robust":
            stated = found.worst[found.robust].value
            beaten = max(0.0, runs.values(density, worst[:1])[0] / stated - 1)
        cases += worst
    return {
        "seed": seed, "closed": found.closed, "stated": found.worst[found.robust].value,
        "may exceed": found.may_exceed, "excess": beaten, "runs": spent,
        **{name: float(runs.values(density, cases).max()) for name, density in layouts.items()},
    }  # fmt: skip


def main(boxes: int, budget: int, first: int) -> None:
    """Print a line for every box."""
    print("seed  closed  stated  may exceed  excess    runs  robust  sample  uniform  nominal")
    for seed in range(first, first + boxes):
        r = row(seed, budget=budget)
        print(
            f"{seed:4d}  {'yes' if r['closed'] else 'no':6s}  {r['stated']:6.4f}  "
            f"{100 * r['may exceed']:8.2f} %  {100 * r['excess']:4.1f} %  {r['runs']:6d}  "
            f"{r['robust']:6.4f}  {r['sample approach']:6.4f}  {r['uniform']:7.4f}  {r['nominal only']:7.4f}",
            flush=True,
        )


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]]
    main(*(numbers + [3, 1500, 100][len(numbers) :]))
