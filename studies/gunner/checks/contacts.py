"""Level L1 beside what it was asked to show: `python -m studies.gunner.checks.contacts`.

G5: seated and braked he is retained, hands free and grasping. G7: straps that pull the upper torso to the
floor lower him the more the harder and the earlier they pull; the shelf is let go before. Own checks: runs of
3 s in every manoeuvre, their energy, half the step, and random cases.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from workbench.engine import NotConverged, Retractor, SpatialMember, TreeTrajectory, simulate

from ..cabin.facing import HATCH
from ..cases import Case, carrier, gunner
from ..figure import FIGURE
from ..figure_numbers import JOINTS
from ..occupant_responses import REFERENCE_HEIGHT, responses_of, shares_of
from ..parts import Parts, joined, triple
from ..proving_grounds import ProvingGround, braking, kerb_trip, rollover, rough, step_steer, straight
from ..uncertain import STEPS
from ..vehicle.acceptance import Row, between
from ..vehicle.balances import energies

__all__ = ["CHECKS", "GROUNDS", "main", "random_case", "run_of", "straps", "table"]

T_END = 3.0  # s
STEP = STEPS["L1"]
GROUNDS: Mapping[str, ProvingGround] = {
    ground.name: ground
    for ground in (straight(), braking(), step_steer(), rollover(), rough(t_end=T_END), kerb_trip())
}
PULLS = (1000.0, 1500.0, 2000.0)  # N, of all straps
FIRED = (1.5, 1.6, 1.7)  # s
RELEASED, LATER = 0.1, 0.1  # s: the shelf goes so long before the straps pull, and a look so long after
# Table C.2, upper torso: x up, y forward, z left of its origin 0.268 m above the hip, m
UPPER = ((0.137, 0.114, 0.0), (0.137, -0.0024, 0.160), (0.137, -0.122, 0.0), (0.137, -0.0024, -0.160))
ORIGIN, BELOW, RADIUS = 0.268, -0.011, 0.4  # m: bottom layer of Table C.1 from the vehicle's mass centre


def run_of(case: Case, *, t_end: float = T_END, step: float = STEP, straps: Parts | None = None) -> Any:
    """A case over some time, with straps of a restraint."""
    parts = Parts() if straps is None else straps
    system = joined(carrier(case), gunner(case), parts)
    return simulate(system, np.ones(len(system.members)), t_end, round(t_end / step))


def straps(force: float, at: float) -> Parts:
    """Twelve retractors that together pull with `force` (N) at a time: each point of the upper torso to the
    column beside it in the floor layer and that column's neighbours.
    """
    up = ORIGIN + UPPER[0][0] - 0.3689  # above the joint of the upper torso
    members = []
    for i, (_, ahead, left) in enumerate(UPPER):
        for column in (2 * i - 1, 2 * i, 2 * i + 1):
            angle = 0.25 * np.pi * column
            foot = (
                HATCH[0] + RADIUS * np.cos(angle), HATCH[1] + RADIUS * np.sin(angle), REFERENCE_HEIGHT + BELOW
            )  # fmt: skip
            members.append(
                SpatialMember(
                    a="upper torso", b="vehicle", point_a=(ahead, left, up), point_b=triple(foot),
                    law=Retractor(f0=force / 12.0, t0=at),
                )
            )  # fmt: skip
    return Parts(members=tuple(members))


def every_manoeuvre() -> Iterator[Row]:
    """G5, and energy and half the step in every manoeuvre."""
    for name, ground in GROUNDS.items():
        for hands in ("both", "none"):
            case = Case(level="L1", on=ground, hands=hands)
            run = run_of(case)
            found, what = responses_of(run), f"{name}, hands {hands}"
            if name == "braking":
                yield between("G5", f"{what}: ejected", 0.0, 0.0, found["ejected"], "1")
            yield between("L1", f"{what}: energy gap", 0.0, 0.01, energy_gap(run), "1")
            if name != "straight":
                finer = responses_of(run_of(case, step=0.5 * STEP))
                change = abs(finer["deviation"] - found["deviation"]) / found["deviation"]
                yield between("L1", f"{what}: half the step, deviation", 0.0, 0.02, change, "1")


def energy_gap(run: TreeTrajectory) -> float:
    """The largest gap over the largest energy exchanged."""
    found = energies(run)
    parts = (found.kinetic, found.dampers, found.brakes, found.tyres, found.contacts, found.holds)
    return float(np.abs(found.gap).max() / max(np.abs(part).max() for part in parts))


def retractors() -> Iterator[Row]:
    """G7: least g2 over 2 s of the rollover by the force of the straps and their time, and g2 on the way."""
    case = Case(level="L1", on=rollover())

    def lowered(force: float, at: float) -> tuple[float, float]:
        run = run_of(replace(case, shelf_drops_at=at - RELEASED), t_end=2.0, straps=straps(force, at))
        way = run.view(bodies=FIGURE, reference="vehicle", shares=shares_of(run.system)).series()[:, 2]
        return responses_of(run)["min_g2"], float(way[round((at + LATER) / STEP)]) - REFERENCE_HEIGHT

    found = [lowered(force, FIRED[0]) for force in PULLS]
    middle, late = (lowered(PULLS[-1], at) for at in FIRED[1:])
    for what, i in (("least g2", 0), (f"g2 {LATER} s later", 1)):
        for (weak, strong), force in zip(pairwise(found), PULLS[1:], strict=True):
            yield between("G7", f"{force:g} N, {what}, below the weaker", 0.0, 1.0, weak[i] - strong[i], "m")
    yield between("G7", f"{FIRED[0]} s, least g2, below {FIRED[2]} s", 0.0, 1.0, late[0] - found[-1][0], "m")
    yield between("G7", f"{FIRED[1]} s, least g2, reported", 0.0, 0.976, middle[0], "m")


def random_case(seed: int) -> Case:
    """A manoeuvre (in turn) and a gunner drawn from wide ranges."""
    rng = np.random.default_rng(seed)
    names = list(GROUNDS)
    return Case(
        level="L1", on=GROUNDS[names[seed % len(names)]], grip=float(rng.uniform(350.0, 700.0)),
        hands=str(rng.choice(["none", "one", "both"])), mass=float(rng.uniform(60.0, 95.0)),
        start=("balanced", "torque-free")[int(rng.integers(2))],
        factors={joint: float(rng.uniform(0.5, 2.0)) for joint in JOINTS},
    )  # fmt: skip


def random_cases(count: int = 100, finer: int = 30) -> Iterator[Row]:
    """Runs of 3 s: how many stop, how many steps were halved, and what half the step changes in the first of
    them, where he stays in the hatch.
    """
    stopped = parts = out = 0
    changes = []
    for seed in range(count):
        case = random_case(seed)
        try:
            run = run_of(case)
            parts += len(run.diagnosis.halved)
            if seed < finer:
                found, again = (responses_of(r) for r in (run, run_of(case, step=0.5 * STEP)))
                if found["ejected"] or again["ejected"]:
                    out += 1
                else:
                    changes.append(abs(again["deviation"] - found["deviation"]) / found["deviation"])
        except NotConverged as told:
            stopped += 1
            print(f"       seed {seed}, {case.on.name}: {told}")
    yield between("L1", f"of {count} random cases, stopped", 0, 0, stopped, "1")
    yield between("L1", "steps of them that were halved, reported", 0, 6000 * count, parts, "1")
    if changes:
        yield between("L1", "half the step, deviation, median", 0.0, 0.01, float(np.median(changes)), "1")
        yield between("L1", "the same, largest, reported", 0.0, 1.0, max(changes), "1")
        yield between("L1", f"of {finer}, ejected, not compared", 0, finer, out, "1")


CHECKS = (every_manoeuvre, retractors, random_cases)


def table(checks: Any = CHECKS) -> Iterator[Row]:
    """All rows."""
    for check in checks:
        yield from check()


def main() -> None:
    """Print the table."""
    for row in table():
        verdict = "pass" if row.passes else "MISS"
        print(f"{row.check:4} {row.what:45} {row.asked:28} {row.ours:12.5g}  {verdict}", flush=True)


if __name__ == "__main__":
    main()
