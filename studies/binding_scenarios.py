"""Do starts agree, and how near do they come, when a layout is searched by the cases that bind?

Every seed draws a box around that of the demo (`studies.loop_claims`), belts, airbags, and 10 to 18
stratified cases of the occupant besides the nominal one. The layout for all of them is searched from

    nominal   the layout of the nominal case           its worst   that of the case in which it is worst
    middle    half way between these two               uniform     the same density everywhere
    random    densities drawn evenly

with all cases at every step, with those that bind (`workbench.engine.layout.bound.binding`), and with those
that bind from several starts, of which the one above is the first (`bound.binding_starts`); as many
evaluations each. Excess is over the best of all searches of a problem; the optimum itself is not known.

`python -m studies.binding_scenarios 516 4 12` prints four problems with 12 evaluations of each search;
`python -m studies.binding_scenarios 700 8 24 125 several,binding` eight with steps of 16 ms, in two ways.
"""

import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.loop_claims import drawn_space
from studies.loop_rivals import nominal
from studies.occupant_braking import OccupantRestraint, restraint
from workbench.engine.layout.optimise import optimise_layout
from workbench.robust_layout.cuts import distinct
from workbench.robust_layout.other_starts import random_densities
from workbench.robust_layout.scenarios import stratified_cases

__all__ = ["WAYS", "Searched", "drawn_problem", "searched", "starts_of", "told"]

Array = NDArray[np.float64]
Case = Mapping[str, Any]

STEPS = 500  # of the two seconds
FIRST = 12  # evaluations of the layouts of single cases that searches begin at
WAYS = ("all", "binding", "several")
AGREE, SETTLED = 0.02, 0.02  # relative spread of the starts, first-order error


def drawn_problem(seed: int, *, steps: int = STEPS) -> tuple[OccupantRestraint, list[dict[str, Any]]]:
    """A layout model and its cases, the nominal one first."""
    rng = np.random.default_rng([seed, 41])
    space = drawn_space(rng)
    model = restraint(belts=float(rng.integers(4, 10)), airbags=float(rng.integers(4, 10)), steps=steps)
    number = int(rng.integers(10, 19))
    drawn = [nominal(space), *stratified_cases(space, number, seed=seed)]
    return model, distinct([space.canonical(case) for case in drawn])


def starts_of(model: OccupantRestraint, cases: Sequence[Case], *, seed: int) -> dict[str, Array]:
    """Densities to begin with, by name."""

    def alone(k: int) -> Array:
        return optimise_layout(model.problem([cases[k]]), max_evaluations=FIRST, compare=False).density

    first = alone(0)
    values = [answer["peak_deviation"] if isinstance(answer, dict) else -np.inf
              for answer in model.responses_of_cases(first, cases, threads=1)]  # fmt: skip
    worst = alone(1 + int(np.argmax(values[1:])))
    problem = model.problem(cases[:1])
    return {
        "nominal": first, "its worst": worst, "middle": 0.5 * (first + worst), "uniform": problem.start,
        "random": random_densities(problem, seed=seed),
    }  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Searched:
    """value: m, largest over all cases.    error: to first order, as a share.    spent: processor seconds."""

    value: float
    error: float
    spent: float


def searched(
    model: OccupantRestraint, cases: Sequence[Case], start: Array, *, way: str, evaluations: int
) -> Searched:
    """One search."""
    problem = model.problem(cases)
    begun = time.process_time()
    found = optimise_layout(
        replace(problem, start=problem.into_budgets(start.copy())), max_evaluations=evaluations,
        compare=False, multi_start=way == "several", probes=0,
        scenarios="all" if way == "all" else "binding",
    )  # fmt: skip
    return Searched(value=model.as_response(found.value), error=found.kkt, spent=time.process_time() - begun)


def told(made: Mapping[int, Mapping[str, Mapping[str, Searched]]]) -> str:
    """How often starts agree and errors are small, and how far the searches of either way are from the best.

    made: seed -> way -> start -> search.
    """
    best = {seed: min(s.value for way in ways.values() for s in way.values()) for seed, ways in made.items()}
    lines = []
    for way in next(iter(made.values())):
        rows = {seed: ways[way] for seed, ways in made.items()}
        excess = [s.value / best[seed] - 1.0 for seed, row in rows.items() for s in row.values()]
        ends = [[s.value for s in row.values()] for row in rows.values()]
        agree = sum(max(row) <= (1.0 + AGREE) * min(row) for row in ends)
        top = [min(row.values(), key=lambda s: s.value) for row in rows.values()]
        spent = [s.spent for row in rows.values() for s in row.values()]
        lines.append(
            f"{way:8s} all starts within {100 * AGREE:.0f} %: {agree} of {len(rows)}; "
            f"first-order error of the best at most {100 * SETTLED:.0f} %: "
            f"{sum(s.error <= SETTLED for s in top)}; above the best known: "
            f"{100 * np.mean(excess):.1f} % in the mean, {100 * max(excess):.1f} % at most; "
            f"{np.mean(spent):.1f} CPU s a search"
        )
    return "\n".join(lines)


def main(
    first: int = 516, problems: int = 4, evaluations: int = 12, steps: int = STEPS,
    *, ways: Sequence[str] = WAYS,
) -> None:  # fmt: skip
    """Print a line for every problem and way: value in m and first-order error from each start."""
    made: dict[int, dict[str, dict[str, Searched]]] = {}
    for seed in range(first, first + problems):
        model, cases = drawn_problem(seed, steps=steps)
        starts = starts_of(model, cases, seed=seed)
        made[seed] = {}
        for way in ways:
            row = {
                name: searched(model, cases, start, way=way, evaluations=evaluations)
                for name, start in starts.items()
            }
            made[seed][way] = row
            ends = "  ".join(f"{name} {s.value:.4f} ({100 * s.error:.1f} %)" for name, s in row.items())
            print(f"{seed}  {len(cases)} cases  {way:8s}  {ends}", flush=True)
    print(told(made))


if __name__ == "__main__":
    chosen = sys.argv[5].split(",") if len(sys.argv) > 5 else WAYS
    main(*[int(text) for text in sys.argv[1:5]], ways=chosen)
