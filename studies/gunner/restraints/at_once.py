"""All kinds at once over three manoeuvres, beside a sequence of parts, for as many runs of the engine.

    python -m studies.gunner.restraints.at_once [evaluations of each part] [hands: none, one or both]
    python -m studies.gunner.restraints.at_once 20 drawn [seed] [how many]

180 belts, 180 airbags and 36 retractors, a budget for each kind; the largest g1 over severe braking (1.5 s),
step steer (1 s) and rollover (2.5 s). In parts: belts in braking, then airbags beside them in the rollover,
then retractors beside both, as the decomposition by active status does, with one objective for all. At once:
all variables over all three grounds, from its own start and from where the parts end. An evaluation of a part
is one run, one of the whole three. The gunner is that of the source's worst cases, or drawn: hands, grip,
mass, seat and joints anywhere in the ranges of the rollover's study.
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


def drawn(rng: np.random.Generator) -> dict[str, Any]:
    """A gunner of the rollover's study, but for road and retractors."""
    joints = ("shoulder_tx", "elbow", "hip_tx")
    return {
        "hands": str(rng.choice(["none", "one", "both"])), "grip": float(rng.uniform(350.0, 700.0)),
        "mass": float(rng.uniform(60.0, 95.0)), "seat_cap": float(rng.uniform(300.0, 1000.0)),
        "factors": {joint: float(2.0 ** rng.uniform(-1.0, 1.0)) for joint in joints},
    }  # fmt: skip


def whole(
    grounds: Mapping[str, float] = GROUNDS, *, gunner_is: Mapping[str, Any] = WORST_GUNNER
) -> LayoutProblem:
    """All kinds over some grounds; gunner_is: what of `Case` is his."""
    scenarios = []
    for ground, t_end in grounds.items():
        design = Design(
            name=ground, on=ground, goal="largest g1", window=(0.0, t_end), opens=KINDS, budgets=BUDGETS,
            gunner=gunner_is,
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


def compare(evaluations: int = 20, *, gunner_is: Mapping[str, Any] = WORST_GUNNER) -> Compared:
    """Parts and at once, for as many runs."""
    problem = whole(gunner_is=gunner_is)
    braked = whole({"braking": GROUNDS["braking"]}, gunner_is=gunner_is)
    rolled = whole({"rollover": GROUNDS["rollover"]}, gunner_is=gunner_is)
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
    who, *rest = sys.argv[2:] or ["both"]
    if who != "drawn":
        print(
            "\n".join(lines(compare(evaluations, gunner_is={**WORST_GUNNER, "hands": who}), f"hands {who}"))
        )
        return
    seed, count = (*(int(text) for text in rest), *(1, 3)[len(rest) :])
    rng = np.random.default_rng([seed, 18])
    for _ in range(count):
        one = drawn(rng)
        said = f"{one['mass']:.0f} kg, hands {one['hands']}, grip {one['grip']:.0f} N"
        print("\n".join(lines(compare(evaluations, gunner_is=one), said)), flush=True)


def lines(c: Compared, who: str) -> list[str]:
    """What is printed of a comparison."""
    return [
        f"{who}: worst deviation without members {c.nothing:.4f} m; in parts {c.in_parts:.4f} m for "
        f"{c.runs_in_parts} runs; at once {c.own_start:.4f} m for {c.runs_at_once} "
        f"({100 * (c.own_start / c.in_parts - 1):+.1f} %), from where the parts end {c.from_parts:.4f} m "
        f"for as many more",
        *(
            f"    {ground:10} in parts {sequence:.4f} m, at once {together:.4f} m"
            for ground, (sequence, together) in c.by_ground.items()
        ),
    ]


if __name__ == "__main__":
    main()
