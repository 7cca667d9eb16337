"""All kinds at once over three manoeuvres, beside a sequence of parts, for as many runs of the engine.

    python -m studies.gunner.restraints.at_once [evaluations of each part] [hands: none, one or both]

180 belts, 180 airbags and 36 retractors, a budget for each kind; the largest g1 over severe braking (1.5 s),
step steer (1 s) and rollover (2.5 s). In parts: belts in braking, then airbags beside them in the rollover,
then retractors beside both, as the decomposition by active status does, with one objective for all. At once:
all variables over all three grounds, from its own start and from where the parts end. An evaluation of a part
is one run, one of the whole three.
"""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workbench.engine import Maximum, optimise_layout
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.engine.layout.parts import Part, optimise_in_parts

from ..cases import carrier, gunner
from ..parts import joined
from .designs import (
    AIRBAGS,
    BELTS,
    RETRACTORS,
    WORST_GUNNER,
    Budgets,
    Design,
    case_of,
    members,
    objective_of,
    places,
)  # fmt: skip
from .ground_structure import Kind

__all__ = ["GROUNDS", "Compared", "compare", "main", "whole"]

Array = np.ndarray[Any, Any]
STEPS = 1000
GROUNDS: Mapping[str, float] = {"braking": 1.5, "step steer": 1.0, "rollover": 2.5}  # s
KINDS: tuple[tuple[Kind, float | None], ...] = (("belt", None), ("airbag", None), ("retractor", 1.5))
BUDGETS: Budgets = ((("belt",), BELTS), (("airbag",), AIRBAGS), (("retractor",), RETRACTORS))


@dataclass(frozen=True, slots=True, kw_only=True)
class Compared:
    """The worst deviation, m, over the grounds: of nothing, of parts, at once; and the runs of either.

    by_ground: deviation on each, of parts and at once from its own start.  parts, at_once: densities, kind by
    kind, the latter of the better start.
    """

    nothing: float
    in_parts: float
    own_start: float
    from_parts: float
    runs_in_parts: int
    runs_at_once: int
    by_ground: Mapping[str, tuple[float, float]]
    parts: Array
    at_once: Array


def whole(grounds: Mapping[str, float] = GROUNDS, *, hands: str = "both") -> LayoutProblem:
    """All kinds over some grounds; hands: as in `Case`."""
    scenarios = []
    for ground, t_end in grounds.items():
        design = Design(
            name=ground, on=ground, goal="largest g1", window=(0.0, t_end), opens=KINDS, budgets=BUDGETS,
            gunner={**WORST_GUNNER, "hands": hands},
        )  # fmt: skip
        case, some = case_of(design), places(design)
        system = joined(carrier(case), gunner(case), members(case, some))
        objective = objective_of(design, system)
        assert isinstance(objective, Maximum)
        scenarios.append(Scenario(system=system, objective=objective, t_end=t_end, steps=STEPS, name=ground))
    rows = [(np.array([float(p.kind in kinds) for p in some]), limit) for kinds, limit in BUDGETS]
    start = sum(limit / row.sum() * row for row, limit in rows)
    return transient_problem(
        scenarios, start=start, budgets=rows, names=("belts", "airbags", "retractors"), title="at once",
        response="g1", unit="m2",
    )  # fmt: skip


def compare(evaluations: int = 20, *, hands: str = "both") -> Compared:
    """Parts and at once, for as many runs."""
    problem = whole(hands=hands)
    braked = whole({"braking": GROUNDS["braking"]}, hands=hands)
    rolled = whole({"rollover": GROUNDS["rollover"]}, hands=hands)
    belts, airbags, retractors = (np.flatnonzero(row) for row in problem.costs)
    parts = [
        Part(name="belts", variables=belts.tolist(), problem=braked),
        Part(name="airbags", variables=airbags.tolist(), problem=rolled),
        Part(name="retractors", variables=retractors.tolist(), problem=rolled),
    ]
    found = optimise_in_parts(problem, parts, max_evaluations=evaluations)
    runs = sum(part.evaluations for part in found.parts) + len(GROUNDS)
    each = max(1, runs // len(GROUNDS))
    own = optimise_layout(problem, max_evaluations=each)
    further = optimise_layout(_from(problem, found.density), max_evaluations=each)
    best = min((own, further), key=lambda result: result.value)
    told = [np.sqrt(problem.evaluate(density).values.max(axis=1)) for density in (found.density, own.density)]
    return Compared(
        nothing=float(np.sqrt(problem.evaluate(np.zeros(problem.members)).values.max())),
        in_parts=float(np.sqrt(found.value)), own_start=float(np.sqrt(own.value)),
        from_parts=float(np.sqrt(further.value)), runs_in_parts=runs, runs_at_once=len(GROUNDS) * each,
        by_ground={name: (float(told[0][i]), float(told[1][i])) for i, name in enumerate(GROUNDS)},
        parts=found.density, at_once=best.density,
    )  # fmt: skip


def _from(problem: LayoutProblem, design: Array) -> LayoutProblem:
    return replace(problem, start=np.clip(design, problem.lower, problem.upper))


def main() -> None:
    """Print the comparison."""
    evaluations = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    hands = sys.argv[2] if len(sys.argv) > 2 else "both"
    c = compare(evaluations, hands=hands)
    print(
        f"hands {hands}: worst deviation without members {c.nothing:.4f} m; in parts {c.in_parts:.4f} m for "
        f"{c.runs_in_parts} runs; at once {c.own_start:.4f} m for {c.runs_at_once}, from where the parts end "
        f"{c.from_parts:.4f} m for as many more"
    )
    for ground, (sequence, together) in c.by_ground.items():
        print(f"    {ground:10} in parts {sequence:.4f} m, at once {together:.4f} m")


if __name__ == "__main__":
    main()
