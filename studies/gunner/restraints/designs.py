"""The layout problems of section 8.6, each with its ground, its objective and what is open in it.

| design | open | ground | objective |
|---|---|---|---|
| (8.29), (8.35) | belts | straight on, over 1 s | largest g1 |
| (8.30) | airbags, beside the belts of (8.29) | rollover, over 3 s | largest g2 |
| (8.31) | retractors at 1.5 s, beside those belts | rollover, over 2 s | least g2 |
| (8.32) | belts and airbags, one budget | braking, over 1 s | largest g1 |
| (8.33) | belts and airbags, a budget each | braking, over 1 s | largest g1 |
| (8.34) | retractors at 1.5, 1.6 and 1.7 s | rollover, over 2 s | least g2 |
| (8.36) | retractors at 1.7 s | rollover, 1 to 2 s | least g2 |
| (8.37) | airbags from 2 s on | rollover, 2 to 2.5 s | largest g1 |

(8.35) and (8.37) print the smallest g1 where their text says the largest; the text is taken. The gunner is
that of the source's worst cases: grips of 371 N, Table 8.8. Straight on, a balanced gunner does not move, so
there he sinks onto seat and hands ("torque-free"). Budgets are ours, the source gives none.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from workbench.engine import (
    Airbag,
    Coordinate,
    Deviation,
    Maximum,
    Minimum,
    Retractor,
    TreeSystem,
    gradient,
    simulate,
)
from workbench.engine.layout.formulation.problem import LayoutProblem, static_problem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem

from ..cases import Case, carrier, gunner, numbers_of
from ..figure import FIGURE
from ..occupant_responses import REFERENCE_HEIGHT, shares_of
from ..parts import Parts, joined
from ..proving_grounds import ProvingGround, braking, rollover, step_steer, straight
from ..uncertain import ROLLING
from .ground_structure import FLOOR, Kind, Site, restraints, sites

__all__ = [
    "AIRBAGS",
    "BELTS",
    "DESIGNS",
    "RETRACTORS",
    "WORST_GUNNER",
    "Budgets",
    "Design",
    "Place",
    "case_of",
    "layout_problem",
    "members",
    "objective_of",
    "places",
    "value_of",
]  # fmt: skip

Array = np.ndarray[Any, Any]
WORST_GUNNER: Mapping[str, Any] = MappingProxyType(
    {"grip": 371.0, "factors": {"shoulder_tx": 2.0, "wrist_tx": 0.5}}
)  # section 8.3: 371 N and Table 8.8
STEP = 2e-3  # s
BELTS, AIRBAGS, RETRACTORS = 9.0, 9.0, 3.6  # whole members: 5 % of 180 each, a tenth of 36; ours
ON: Mapping[str, ProvingGround] = {
    "straight": straight(), "braking": braking(), "step steer": step_steer(), "rollover": rollover(),
}  # fmt: skip
Goal = Literal["largest g1", "largest g2", "least g2"]
Budgets = tuple[tuple[tuple[Kind, ...], float], ...]  # kinds that share one, and its limit


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """A design variable: what kind of member at which site, and when it acts.

    at: s, the peak of a retractor, or the time from which an airbag is ready; None: always.
    """

    kind: Kind
    site: Site
    at: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Design:
    """One layout problem of section 8.6.

    opens: kinds, and the times at which they act.  budgets: sums of densities for groups of kinds.
    keeps: the name of the design whose layout stays in place.  first: share of the budgets at the start.
    evaluations: of its search; with them the first-order error is below 2 %.
    """

    name: str
    on: str
    goal: Goal
    window: tuple[float, float]
    opens: tuple[tuple[Kind, float | None], ...]
    budgets: Budgets
    keeps: str | None = None
    start: str = "balanced"
    first: float = 1.0
    evaluations: int = 30
    gunner: Mapping[str, Any] = field(default_factory=lambda: WORST_GUNNER)

    @property
    def t_end(self) -> float:
        """The end of its run, s: that of its window."""
        return self.window[1]


_BELTS: Budgets = ((("belt",), BELTS),)
_AIRBAGS: Budgets = ((("airbag",), AIRBAGS),)
_RETRACTORS: Budgets = ((("retractor",), RETRACTORS),)
DESIGNS: tuple[Design, ...] = (
    Design(
        name="(8.29)", on="straight", goal="largest g1", window=(0.0, 1.0), opens=(("belt", None),),
        budgets=_BELTS, start="torque-free",
    ),
    Design(
        name="(8.30)", on="rollover", goal="largest g2", window=(0.0, 3.0), opens=(("airbag", None),),
        budgets=_AIRBAGS, keeps="(8.29)",
    ),
    Design(
        name="(8.31)", on="rollover", goal="least g2", window=(0.0, 2.0), opens=(("retractor", 1.5),),
        budgets=_RETRACTORS, keeps="(8.29)",
    ),
    Design(
        name="(8.32)", on="braking", goal="largest g1", window=(0.0, 1.0),
        opens=(("belt", None), ("airbag", None)), budgets=((("belt", "airbag"), BELTS + AIRBAGS),),
        evaluations=150,
    ),
    Design(
        name="(8.33)", on="braking", goal="largest g1", window=(0.0, 1.0),
        opens=(("belt", None), ("airbag", None)), budgets=_BELTS + _AIRBAGS,
        evaluations=150,
    ),
    Design(
        name="(8.34)", on="rollover", goal="least g2", window=(0.0, 2.0),
        opens=(("retractor", 1.5), ("retractor", 1.6), ("retractor", 1.7)), budgets=_RETRACTORS,
    ),
    Design(
        name="(8.36)", on="rollover", goal="least g2", window=(1.0, 2.0), opens=(("retractor", 1.7),),
        budgets=_RETRACTORS,
    ),
    Design(
        name="(8.37)", on="rollover", goal="largest g1", window=(2.0, 2.5), opens=(("airbag", 2.0),),
        # bags that open on a man who has moved throw him out, so it starts with few; other starts are lost
        budgets=_AIRBAGS, first=0.01, evaluations=80,
    ),
)  # fmt: skip


def places(design: Design) -> tuple[Place, ...]:
    """The design variables: 180 sites for every kind that is open, 36 of them for retractors.

    >>> [len(places(design)) for design in DESIGNS]
    [180, 180, 36, 360, 360, 108, 36, 180]
    """
    return tuple(
        Place(kind=kind, site=site, at=at)
        for kind, at in design.opens
        for site in sites()
        if kind != "retractor" or site.layer == FLOOR
    )


def members(case: Case, some: tuple[Place, ...]) -> Parts:
    """The members of places, in their order."""
    numbers, found = numbers_of(case), []
    by_kind = {
        kind: restraints(numbers, (kind,), file=case.file).members for kind in {place.kind for place in some}
    }
    order = {site.number: i for i, site in enumerate(sites())}
    for place in some:
        member = by_kind[place.kind][order[place.site.number]]
        law: Any = member.law
        if place.at is not None:
            law = (
                replace(law, deploy=place.at)
                if isinstance(law, Airbag)
                else Retractor(f0=law.f0, sigma=law.sigma, t0=place.at)
            )
        found.append(replace(member, law=law))
    return Parts(members=tuple(found))


def case_of(design: Design) -> Case:
    """The gunner on the ground of a design; in the rollover with the seat that survives its start."""
    seat = ROLLING if design.on == "rollover" else {}
    return Case(on=ON[design.on], start=design.start, **seat, **design.gunner)  # type: ignore[arg-type]


def objective_of(design: Design, system: TreeSystem) -> Maximum | Minimum:
    """g1 (m2), or the height behind g2 (m, on the ground's scale: g2 + 0.77)."""
    seen: Any = {"bodies": FIGURE, "shares": shares_of(system), "reference": "vehicle"}
    if design.goal == "largest g1":
        return Maximum(quantity=Deviation(**seen, weights=(1.0,) * 3), window=design.window)
    height = Coordinate(**seen, direction=(0.0, 0.0, 1.0))
    kind = Maximum if design.goal == "largest g2" else Minimum
    return kind(quantity=height, window=design.window)


def layout_problem(
    design: Design, kept: tuple[tuple[Place, ...], Array] | None = None, *, step: float = STEP
) -> LayoutProblem:
    """The layout problem of a design.

    kept: places and densities of what stays in place. They stand behind the open members, fixed; those below
    1e-6 are left out. step: s.
    """
    case, some = case_of(design), places(design)
    stays = [] if kept is None else [(p, a) for p, a in zip(*kept, strict=True) if a > 1e-6]
    fixed = np.array([a for _, a in stays])
    system = joined(carrier(case), gunner(case), members(case, (*some, *(p for p, _ in stays))))
    count, steps = len(some), round(design.t_end / step)
    budgets = [
        (np.r_[[float(p.kind in kinds) for p in some], np.zeros(len(fixed))], limit)
        for kinds, limit in design.budgets
    ]
    share = design.first * min(limit / cost.sum() for cost, limit in budgets)
    start = np.r_[np.full(count, share), fixed]
    lower, upper = np.r_[np.zeros(count), fixed], np.r_[np.ones(count), fixed]
    objective = objective_of(design, system)
    if isinstance(objective, Maximum):
        return transient_problem(
            [Scenario(system=system, objective=objective, t_end=design.t_end, steps=steps, name=design.on)],
            start=start, lower=lower, upper=upper, budgets=budgets, title=design.name, response=design.goal,
        )  # fmt: skip

    def lowest(density: Array) -> tuple[float, Array]:
        # the least over time of a height is one smooth row until another dip becomes the deepest
        run = simulate(system, density, design.t_end, steps)
        return objective.value(run), gradient(system, density, run, objective)

    return static_problem(lowest, start=start, lower=lower, upper=upper, budgets=budgets, title=design.name)


def value_of(design: Design, objective: float) -> float:
    """What is told of an objective: the deviation behind g1, or g2, m."""
    return (
        float(np.sqrt(max(objective, 0.0))) if design.goal == "largest g1" else objective - REFERENCE_HEIGHT
    )
