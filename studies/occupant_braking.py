"""The occupant in severe braking: an uncertain case in, responses out, and the layout that restrains him.

    braking_occupant(grip=..., hands="both", ...)      the model of the study, without any restraint
    restraint(belts=6, airbags=6)                      the layout model of the robust loop

Deviations are those of the whole-body mass centre seen from the vehicle. Who moved more than `LEFT` has left
grips and seat behind; how far he then flies within the window says little, only that he left.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.occupant import (
    KINDS,
    MASSES,
    SEGMENTS,
    Case,
    member_sites,
    system,
)
from studies.occupant_drawing import motion_of, outlines
from workbench.engine import Case as EngineCase
from workbench.engine import (
    Deviation,
    GeneralisedAlpha,
    Impulse,
    Maximum,
    System,
    Trajectory,
    acting_members,
    simulate,
    simulate_cases,
)
from workbench.engine.layout.formulation.problem import LayoutProblem
from workbench.engine.layout.formulation.transient import Scenario, transient_problem
from workbench.motion.frames import Motion

__all__ = ["FACTORS", "LEFT", "NOMINAL", "OccupantRestraint", "braking_occupant", "restraint"]

Array = NDArray[np.float64]

T_END, STEPS = 2.0, 1000
FEWEST = 100  # steps of the two seconds
# of runs at a longer step, believed after a true one alone: peaks within 2e-9 for a quarter less Newton steps
ROUGH = GeneralisedAlpha(tolerance=1e-8)
LEFT = 1.0  # m
LOST = 0.5  # of the damage: the grip is gone
HANDS = {"none": 0, "one": 1, "both": 2}
FACTORS = {  # parameter: joint of Table 8.6
    "k_shoulder_tx": "shoulder TX",
    "k_shoulder_tz": "shoulder TZ",
    "k_elbow": "elbow",
    "k_wrist": "wrist TX",
    "k_hip_tx": "hip TX",
    "k_hip_tz": "hip TZ",
    "k_knee": "knee",
    "k_ankle": "ankle",
}
NOMINAL: Mapping[str, Any] = {
    "grip": 525.0, "hands": "both", **dict.fromkeys(FACTORS, 1.0), "seat_rate": 10_000.0, "seat_cap": 1000.0,
    "deceleration": 7.0, "mass": 77.0,
}  # fmt: skip
DEVIATION = Deviation(bodies=tuple(SEGMENTS), reference="vehicle", shares=MASSES)
RETRACTOR = Impulse(f0=500.0, sigma=300.0, t0=0.6)  # fired 0.1 s after the brakes


def braking_occupant(**uncertain: Any) -> dict[str, float]:
    """Responses of the unrestrained occupant; the parameters are those of `NOMINAL`.

    Returns: peak_deviation, peak_rise (m), head_speed (m/s, seen from the vehicle), torso_acceleration
        (m/s2), grip_lost (1 when a held grip is gone), grip_lost_at (s, the window's end when it is not).

    Raises ValueError for a case that is none, NotConverged when it cannot be computed.

    >>> found = braking_occupant(**NOMINAL)
    >>> round(found["peak_deviation"], 3), found["grip_lost"]
    (0.12, 0.0)
    """
    body = system(case_of(uncertain))
    return responses_of(simulate(body, body.density(0.0), t_end=T_END, steps=STEPS))


def case_of(uncertain: Mapping[str, Any]) -> Case:
    """The case of a row of the study's parameters."""
    missing, unknown = sorted(NOMINAL.keys() - uncertain), sorted(uncertain.keys() - NOMINAL)
    if missing or unknown:
        raise ValueError(f"a case needs {', '.join(NOMINAL)}; missing {missing}, unknown {unknown}")
    if uncertain["hands"] not in HANDS:
        raise ValueError(f"hands needs one of {', '.join(HANDS)}, got {uncertain['hands']!r}")
    return Case(
        grip=uncertain["grip"],
        hands=HANDS[uncertain["hands"]],
        factors={joint: uncertain[name] for name, joint in FACTORS.items()},
        seat_rate=uncertain["seat_rate"],
        seat_cap=uncertain["seat_cap"],
        deceleration=uncertain["deceleration"],
        mass=uncertain["mass"],
    )


def responses_of(trajectory: Trajectory) -> dict[str, float]:
    """The responses of a run."""
    shares = np.array(MASSES) / sum(MASSES)
    head, torso = (trajectory.system.coordinate(name) for name in ("head", "upper torso"))
    height = trajectory.position[:, 1::3] @ shares
    speed = trajectory.velocity[:, head][:, :2] - trajectory.tables.motion[:, 1, :2]
    gone = trajectory.damage[:, 0] > LOST
    held = trajectory.system.bushings[0].hold > 0
    return {
        "peak_deviation": float(np.sqrt(DEVIATION.values(trajectory).max())),
        "peak_rise": float((height - height[0]).max()),
        "head_speed": float(np.hypot(*speed.T).max()),
        "torso_acceleration": float(np.hypot(*trajectory.acceleration[:, torso][:, :2].T).max()),
        "grip_lost": float(held and gone.any()),
        "grip_lost_at": float(trajectory.times[gone.argmax()] if held and gone.any() else T_END),
    }


@dataclass(frozen=True, slots=True, kw_only=True)
class OccupantRestraint:
    """180 sites of Table C.3 for every kind, densities kind by kind, and one budget or one for each kind.

    A budget is the sum of densities, "so many full members"; see `workbench.robust_layout.model.LayoutModel`.
    """

    kinds: tuple[str, ...]
    limits: Mapping[str, float]  # kind, or "all kinds" -> sum of densities
    steps: int = STEPS
    title: str = "the occupant in severe braking"
    response: str = "peak_deviation"
    unit: str = "m"

    @property
    def members(self) -> int:
        """Number of densities."""
        return len(self.kinds) * len(member_sites())

    def system(self, uncertain: Mapping[str, Any]) -> System:
        """The multibody system in one case."""
        return system(case_of(uncertain), kinds=self.kinds, retractor=RETRACTOR)

    def problem(self, scenarios: Sequence[Mapping[str, Any]]) -> LayoutProblem:
        """Minimise the largest squared deviation over scenarios and time, (7.12) with (7.13)."""
        sites = len(member_sites())
        costs = {kind: np.repeat([float(k == kind) for k in self.kinds], sites) for kind in self.kinds}
        costs["all kinds"] = np.ones(self.members)
        share = min(limit / costs[name].sum() for name, limit in self.limits.items())
        problem = transient_problem(
            [
                Scenario(
                    system=self.system(u),
                    objective=Maximum(quantity=DEVIATION),
                    t_end=T_END,
                    steps=self.steps,
                )
                for u in scenarios
            ],
            start=min(share, 1.0),
            budgets=[(costs[name], limit) for name, limit in self.limits.items()],
            names=tuple(self.limits),
            title=self.title,
            response="squared deviation",
            unit="m2",
        )
        assert problem.geometry is not None
        kinds = tuple(np.repeat(self.kinds, sites).tolist())
        return replace(problem, geometry=replace(problem.geometry, kind=kinds))

    def as_response(self, objective: float) -> float:
        """The deviation behind a squared one."""
        return float(np.sqrt(max(objective, 0.0)))

    def run(self, density: Array, uncertain: Mapping[str, Any]) -> Trajectory:
        """The restrained occupant in one case, with every member."""
        return simulate(self.system(uncertain), self._checked(density), t_end=T_END, steps=self.steps)

    def _responses(self, density: Array, uncertain: Mapping[str, Any], steps: int) -> dict[str, float]:
        system, few = acting_members(self.system(uncertain), self._checked(density))
        return responses_of(simulate(system, few, t_end=T_END, steps=steps))

    def _checked(self, density: Array) -> Array:
        density = np.asarray(density, dtype=float)
        outside = ~((density >= 0.0) & (density <= 1.0))
        if density.shape != (self.members,) or outside.any():
            came = f"shape {density.shape}" if density.shape != (self.members,) else density[outside][0]
            raise ValueError(f"density needs {self.members} values in [0, 1], got {came}")
        return density

    def responses(self, density: Array, uncertain: Mapping[str, Any]) -> dict[str, float]:
        """Responses of the restrained occupant in one case."""
        return self._responses(density, uncertain, self.steps)

    def responses_of_cases(
        self, density: Array, cases: Sequence[Mapping[str, Any]], *, threads: int = 0
    ) -> list[dict[str, float] | Exception]:
        """Responses of the restrained occupant in many cases at once, or what kept a case from giving any."""
        return self._many(density, cases, self.steps, threads, GeneralisedAlpha())

    def coarsened(
        self, density: Array, cases: Sequence[Mapping[str, Any]], *, threads: int = 0
    ) -> list[dict[str, float] | Exception]:
        """The same at four times the step, 20 ms at most, see `studies.longer_steps`, solved less closely."""
        return self._many(density, cases, max(FEWEST, self.steps // 4), threads, ROUGH)

    def _many(
        self,
        density: Array,
        cases: Sequence[Mapping[str, Any]],
        steps: int,
        threads: int,
        scheme: GeneralisedAlpha,
    ) -> list[dict[str, float] | Exception]:
        density = self._checked(density)

        def made(uncertain: Mapping[str, Any]) -> EngineCase:
            system, few = acting_members(self.system(uncertain), density)
            return EngineCase(system=system, density=few)

        runs = [partial(made, uncertain) for uncertain in cases]
        found = simulate_cases(runs, responses_of, t_end=T_END, steps=steps, scheme=scheme, threads=threads)
        return [run.error if run.found is None else run.found for run in found]

    def refined(self, density: Array, uncertain: Mapping[str, Any]) -> dict[str, float]:
        """The same responses at half the step, before a case that breaks a layout is believed."""
        return self._responses(density, uncertain, 2 * self.steps)

    def motion(self, layouts: Mapping[str, Array], uncertain: Mapping[str, Any]) -> Motion:
        """Layouts in the same case, to look at."""
        runs = {name: self.run(density, uncertain) for name, density in layouts.items()}
        return motion_of(runs, kinds=self.kinds, title=self.title, deviation=DEVIATION)

    def outlines(self) -> list[list[list[float]]]:
        """The occupant behind a drawing of the layout: closed lines in the vehicle frame, m."""
        return outlines()

    def places(self) -> tuple[list[str], list[str], list[tuple[int, int]]]:
        """The layout matrix: points of Table C.2 by those of C.1, floor last, and every member's cell."""
        sites = member_sites()
        rows = {site.occupant_point: f"{site.segment.split()[0]} {site.side}" for site in sites}
        columns = sorted({(site.layer, site.vehicle_point) for site in sites})
        order = sorted(rows)
        cells = [
            (order.index(site.occupant_point), columns.index((site.layer, site.vehicle_point)))
            for site in sites
        ]
        return (
            [f"{number} {rows[number]}" for number in order],
            [f"{point}, layer {layer}" for layer, point in columns],
            cells * len(self.kinds),
        )


def restraint(
    *,
    belts: float = 6.0,
    airbags: float = 6.0,
    retractors: float = 0.0,
    budget: str = "each",
    steps: int = STEPS,
) -> OccupantRestraint:
    """Restraints with so many full members of each kind; a kind with none is left out.

    budget: "each" kind has its own, (8.33), or "shared": one for all together, (8.32).
    steps: of the two seconds. In 150 random corners of the uncertainty over five layouts the peak deviation
    is off by 4e-6 in the median and 1e-4 in 99 of 100 with 1000 steps, by 2e-5 and 6e-4 with 500.

    Raises ValueError for a negative budget, no kind at all, an unknown way to share, or less than 100 steps.

    >>> restraint(airbags=0).members
    180
    """
    wanted = dict(zip(KINDS, (belts, airbags, retractors), strict=True))
    if budget not in ("each", "shared"):
        raise ValueError(f"budget needs 'each' or 'shared', got {budget!r}")
    if steps < FEWEST:
        raise ValueError(f"steps needs at least {FEWEST} for two seconds, got {steps}")
    negative = next((kind for kind, limit in wanted.items() if not limit >= 0), None)
    if negative is not None:
        raise ValueError(f"{negative}s needs a budget >= 0, got {wanted[negative]}")
    kinds = tuple(kind for kind, limit in wanted.items() if limit > 0) or ("belt",)
    limits = {kind: float(wanted[kind]) for kind in kinds}
    if budget == "shared":
        limits = {"all kinds": sum(limits.values())}
    return OccupantRestraint(kinds=kinds, limits=limits, steps=steps)
