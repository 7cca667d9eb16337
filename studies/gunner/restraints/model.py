"""The layout model of the gunner's restraints: densities and a row of uncertain parameters in, responses out.

    model = restraint(on="braking", belts=6, airbags=6)
    model.responses(density, {"grip": 371.0, "hands": "one"})        # one true run
    model.problem([{}, {"mass": 95.0}])                              # the largest g1 over two cases

A row names any of `uncertain.NOMINAL`; what it does not name has its nominal value.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import sqrt
from typing import Any

import numpy as np

from workbench.engine import Case as EngineCase
from workbench.engine import (
    Deviation,
    Maximum,
    TreeSystem,
    TreeTrajectory,
    acting_members,
    simulate,
    simulate_cases,
)
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.motion.frames import Motion

from ..cases import carrier, gunner, numbers_of
from ..drawing.bodies import motion_of
from ..figure import FIGURE
from ..occupant_responses import responses_of, shares_of
from ..parts import joined
from ..uncertain import NOMINAL, TIMES, case_of
from .ground_structure import KINDS, Kind, restraints, sites

__all__ = ["GunnerRestraint", "restraint"]

Array = np.ndarray[Any, Any]
STEP = 1e-3  # s
COARSEST = 1.3e-3  # s: the filter of the chest, class 180, ends at 1.34 ms


@dataclass(frozen=True, slots=True, kw_only=True)
class GunnerRestraint:
    """180 sites for every kind, densities kind by kind; a budget (sum of densities) for each kind.

    steps: of a true run.  searched: of the runs of a search, 0 for as many; its peaks need no filter.

    See `workbench.robust_layout.model.LayoutModel`.
    """

    on: str
    kinds: tuple[Kind, ...]
    limits: Mapping[Kind, float]
    t_end: float
    steps: int
    title: str = "the gunner's restraints"
    response: str = "deviation"
    unit: str = "m"
    searched: int = 0

    @property
    def members(self) -> int:
        """Number of densities."""
        return len(self.kinds) * len(sites())

    def system(self, uncertain: Mapping[str, Any]) -> TreeSystem:
        """Vehicle, gunner and all candidate members in a case.

        Raises ValueError for a gunner who does not face forward at level L0, for whom nobody gave members.
        """
        case = case_of(self.on, uncertain)
        if case.facing != 0.0 or case.level != "L0":
            raise ValueError(
                "restraints are those of a gunner who faces forward at level L0; "
                f"got facing={case.facing:g} and level='{case.level}'"
            )
        late = float(uncertain.get("fires_late", NOMINAL["fires_late"]))
        held = restraints(numbers_of(case), self.kinds, file=case.file, late=late)
        return joined(carrier(case), gunner(case), held)

    def problem(self, scenarios: Sequence[Mapping[str, Any]]) -> LayoutProblem:
        """Minimise the largest g1 over scenarios and time, (8.33)."""
        costs = {kind: np.repeat([float(k == kind) for k in self.kinds], len(sites())) for kind in self.kinds}
        systems = [self.system(u) for u in scenarios]
        problem = transient_problem(
            [
                Scenario(
                    system=system, t_end=self.t_end, steps=self.searched or self.steps,
                    objective=Maximum(quantity=_deviation(system)),
                )
                for system in systems
            ],
            start=min(1.0, *(limit / len(sites()) for limit in self.limits.values())),
            budgets=[(costs[kind], limit) for kind, limit in self.limits.items()],
            names=tuple(self.limits), title=self.title, response="g1", unit="m2",
        )  # fmt: skip
        assert problem.geometry is not None
        kinds = tuple(kind for kind in self.kinds for _ in sites())
        return replace(problem, geometry=replace(problem.geometry, kind=kinds))

    def as_response(self, objective: float) -> float:
        """The deviation behind a g1."""
        return sqrt(max(objective, 0.0))

    def run(self, density: Array, uncertain: Mapping[str, Any]) -> TreeTrajectory:
        """One run with every member that acts."""
        return self._run(density, uncertain, self.steps)

    def _run(self, density: Array, uncertain: Mapping[str, Any], steps: int) -> TreeTrajectory:
        system, few = acting_members(self.system(uncertain), self._checked(density))
        return simulate(system, few, self.t_end, steps)

    def _checked(self, density: Array) -> Array:
        density = np.asarray(density, dtype=float)
        outside = ~((density >= 0.0) & (density <= 1.0))
        if density.shape != (self.members,) or outside.any():
            came = f"shape {density.shape}" if density.shape != (self.members,) else density[outside][0]
            raise ValueError(f"density needs {self.members} values in [0, 1], got {came}")
        return density

    def responses(self, density: Array, uncertain: Mapping[str, Any]) -> dict[str, float]:
        """Responses of the restrained gunner in one case, see `responses_of`."""
        return responses_of(self.run(density, uncertain))

    def responses_of_cases(
        self, density: Array, cases: Sequence[Mapping[str, Any]], *, threads: int = 0
    ) -> list[dict[str, float] | Exception]:
        """The same in many cases at once, or what kept a case from giving any."""
        return self._many(density, cases, responses_of, self.steps, threads)

    def coarsened(
        self, density: Array, cases: Sequence[Mapping[str, Any]], *, threads: int = 0
    ) -> list[dict[str, float] | Exception]:
        """The deviation alone, at four times the step, see `studies.longer_steps`."""
        return self._many(density, cases, _deviation_of, max(1, self.steps // 4), threads)

    def _many(
        self,
        density: Array,
        cases: Sequence[Mapping[str, Any]],
        then: Callable[[Any], dict[str, float]],
        steps: int,
        threads: int,
    ) -> list[dict[str, float] | Exception]:
        density = self._checked(density)

        def made(uncertain: Mapping[str, Any]) -> EngineCase:
            system, few = acting_members(self.system(uncertain), density)
            return EngineCase(system=system, density=few)

        runs = [partial(made, uncertain) for uncertain in cases]
        found = simulate_cases(runs, then, t_end=self.t_end, steps=steps, threads=threads)
        return [run.error if run.found is None else run.found for run in found]

    def refined(self, density: Array, uncertain: Mapping[str, Any]) -> dict[str, float]:
        """The same at half the step, before a case that breaks a layout is believed."""
        return responses_of(self._run(density, uncertain, 2 * self.steps))

    def motion(self, layouts: Mapping[str, Array], uncertain: Mapping[str, Any]) -> Motion:
        """The layouts in one case, side by side, for the report."""
        runs = {label: self.run(density, uncertain) for label, density in layouts.items()}
        return motion_of(runs, case_of(self.on, uncertain), title=self.title)

    def places(self) -> tuple[list[str], list[str], list[tuple[int, int]]]:
        """The layout matrix: points of Table C.2 by those of C.1, floor last, and every member's cell."""
        rows = {s.gunner_point: f"{s.gunner_point} {s.segment.split()[0]} {s.side}" for s in sites()}
        columns = sorted({(s.layer, s.vehicle_point) for s in sites()})
        order = sorted(rows)
        cells = [(order.index(s.gunner_point), columns.index((s.layer, s.vehicle_point))) for s in sites()]
        names = [f"{point}, layer {layer}" for layer, point in columns]
        return [rows[number] for number in order], names, cells * len(self.kinds)


def _deviation(system: TreeSystem) -> Deviation:
    """g1: the squared distance of the mass centre from its start, in the vehicle's frame, m2."""
    return Deviation(bodies=FIGURE, shares=shares_of(system), reference="vehicle", weights=(1.0,) * 3)


def _deviation_of(run: TreeTrajectory) -> dict[str, float]:
    """The largest deviation of a run, m, and no other response."""
    return {"deviation": sqrt(_deviation(run.system).values(run).max())}


def restraint(
    *, on: str = "braking", belts: float = 6.0, airbags: float = 6.0, retractors: float = 0.0,
    t_end: float | None = None, step: float = STEP, search_step: float | None = None,
) -> GunnerRestraint:  # fmt: skip
    """Restraints with so many full members of each kind; a kind with none is left out.

    on: "braking", "step steer" or "rollover". t_end: s, None for the time of that proving ground. step: s.
    search_step: s, of the runs of which a layout is made; it is judged by those of `step`. None: the same.

    Raises ValueError for another proving ground, a negative budget, no kind at all, or a step that is none or
    too long for the responses.

    >>> restraint(airbags=0).members
    180
    """
    if on not in TIMES:
        raise ValueError(f"on needs one of {', '.join(TIMES)}, got '{on}'")
    wanted = dict(zip(KINDS, (belts, airbags, retractors), strict=True))
    for kind, limit in wanted.items():
        if not limit >= 0.0:
            raise ValueError(f"{kind}s needs a budget >= 0, got {limit}")
    kinds = tuple(kind for kind in KINDS if wanted[kind] > 0.0)
    if not kinds:
        raise ValueError("a restraint needs a budget > 0 of belts, airbags or retractors")
    last = TIMES[on] if t_end is None else t_end
    if not 0.0 < step <= last:
        raise ValueError(f"step needs 0 < step <= t_end = {last:g} s, got {step}")
    if last / round(last / step) > COARSEST:
        raise ValueError(
            f"step needs at most {COARSEST:g} s, for the filter of the chest's acceleration, got {step}"
        )
    if search_step is not None and not 0.0 < search_step <= last:
        raise ValueError(f"search_step needs 0 < search_step <= t_end = {last:g} s, got {search_step}")
    return GunnerRestraint(
        on=on, kinds=kinds, limits={kind: float(wanted[kind]) for kind in kinds}, t_end=last,
        steps=round(last / step), searched=0 if search_step is None else round(last / search_step),
    )  # fmt: skip
