"""Whole members of small two-body systems, enumerated: what a search finds in 300 simulations.

Random systems: a body joined to a carrier by 12 to 24 springs between random points, one to four cases of a
force and a moment on the carrier, at most a quarter to a half of the springs on. All choices are simulated
once, so that the optimum is known; the search sees none of them.

Run `python -m studies.whole_members 20 1000` for the table of twenty problems, from seed 1000 on (minutes).
"""

import itertools
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from workbench.engine import Body, Deviation, Load, Maximum, Member, Spring, System
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.whole_members import whole_members

__all__ = ["enumerated", "largest_densities", "random_problem", "random_scenarios", "run", "told"]

MOST = 20_000  # choices that are enumerated


def random_scenarios(seed: int, *, most: int = MOST) -> tuple[list[Scenario], int]:
    """One to four cases of 12 to 24 springs between two bodies, and how many of them may be on.

    There are at most `most` choices.
    """
    rng = np.random.default_rng(seed)
    while True:
        members = int(rng.integers(12, 25))
        count = int(rng.integers(max(3, members // 5), members // 2 + 1))
        if _choices(members, count) <= most:
            break
    inner, outer = rng.uniform(-0.4, 0.4, (members, 2)), rng.uniform(-1.2, 1.2, (members, 2))
    stiffness = rng.uniform(0.5, 2.0) * 4e3
    springs = tuple(
        Member(a="1", point_a=tuple(a), b="2", point_b=tuple(b), law=Spring(k=stiffness))
        for a, b in zip(inner, outer, strict=True)
    )
    scenarios = []
    for case in range(int(rng.integers(1, 5))):
        angle, turn = rng.uniform(0, 2 * np.pi), rng.uniform(-20, 20)
        system = System(
            bodies=(Body(name="1", mass=60.0, inertia=10.0), Body(name="2", mass=2000.0, inertia=6000.0)),
            members=springs,
            loads=(Load(
                body="2", force=(19600.0 * np.cos(angle), 19600.0 * np.sin(angle)), torque=6000.0 * turn
            ),),
        )  # fmt: skip
        scenarios.append(Scenario(
            system=system, objective=Maximum(quantity=Deviation(bodies=("1",), reference="2"), refine=False),
            t_end=0.6, steps=60, name=f"case {case}",
        ))  # fmt: skip
    return scenarios, count


def random_problem(seed: int, *, most: int = MOST) -> tuple[LayoutProblem, int]:
    """A problem of 12 to 24 members and the largest number of members on, with at most `most` choices."""
    scenarios, count = random_scenarios(seed, most=most)
    members = len(scenarios[0].system.members)
    return transient_problem(
        scenarios, start=count / members, budgets=[], lower=1e-4, title=f"springs {seed}", unit="m^2",
        response="largest squared displacement",
    ), count  # fmt: skip


def _choices(members: int, count: int) -> int:
    total, term = 1, 1
    for k in range(count):
        term = term * (members - k) // (k + 1)
        total += term
    return total


def enumerated(problem: LayoutProblem, count: int) -> tuple[float, tuple[int, ...]]:
    """The optimum over all choices of at most `count` members, and which they are.

    Cases are run one by one, those first that have refused most, until one is no better than the best.
    """
    cases = [problem.evaluate.of_scenarios([k]) for k in range(len(problem.evaluate.scenarios))]  # type: ignore[attr-defined]
    refused = np.zeros(len(cases))
    best = np.inf
    which: tuple[int, ...] = ()
    for k in range(count, -1, -1):
        for on in itertools.combinations(range(problem.members), k):
            density = problem.lower.copy()
            density[list(on)] = problem.upper[list(on)]
            worst = -np.inf
            for case in np.argsort(-refused):
                worst = max(worst, float(np.max(cases[case](density).values)))
                if worst >= best:
                    refused[case] += 1
                    break
            if worst < best:
                best, which = worst, on
    return best, which


def largest_densities(problem: LayoutProblem, count: int) -> float:
    """The value of the `count` largest densities of the relaxed layout, put on."""
    relaxed = optimise_layout(
        replace(problem, costs=np.ones((1, problem.members)), limits=np.array([float(count)]), names=("on",)),
        max_evaluations=60,
    )
    density = problem.lower.copy()
    on = np.argsort(-relaxed.density, kind="stable")[:count]
    density[on] = problem.upper[on]
    return float(np.max(problem.evaluate(density).values))


def run(problems: int = 20, *, first: int = 0, most: int = MOST, evaluations: int = 300) -> xr.Dataset:
    """Each problem: the value found and that of the largest densities over the optimum, simulations, members,
    cases, choices, and the price of rounding beside the relaxed layout.
    """
    names = ("found", "rounded", "simulations", "members", "cases", "choices", "price")
    table: dict[str, list[float]] = {name: [] for name in names}
    for seed in range(first, first + problems):
        problem, count = random_problem(seed, most=most)
        optimum, _ = enumerated(problem, count)
        found = whole_members(problem, count, evaluations=evaluations)
        row: dict[str, Any] = {
            "found": found.value / optimum, "rounded": largest_densities(problem, count) / optimum,
            "simulations": found.evaluations, "members": problem.members,
            "cases": len(np.atleast_2d(problem.evaluate(problem.start).values)),
            "choices": _choices(problem.members, count), "price": found.price_of_rounding,
        }  # fmt: skip
        for name in names:
            table[name].append(float(row[name]))
        print(seed, {k: round(float(v), 5) for k, v in row.items()}, found.status.name, flush=True)
    return xr.Dataset({name: ("problem", values) for name, values in table.items()})


def told(found: xr.Dataset) -> str:
    """How many problems were solved, and how nearly."""
    ratio = found["found"].values
    return (
        f"within 2 %: {int((ratio <= 1.02).sum())} of {len(ratio)}, the optimum itself: "
        f"{int((ratio <= 1.0 + 1e-9).sum())}; at most {int(found['simulations'].max())} simulations"
    )


if __name__ == "__main__":
    given = [int(text) for text in sys.argv[1:3]]
    print(told(run(given[0] if given else 20, first=given[1] if len(given) > 1 else 0)))
