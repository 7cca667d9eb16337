"""What the gunner was asked to show, beside what he shows: `python -m studies.gunner.occupant_acceptance`.

The checks are those of the specification; "s12" are the figures of its planar reduction. A miss stays a miss;
why, where it is known, stands in docs/explanation/the-gunner.md.
"""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import numpy as np

from workbench.engine import TreeTrajectory, simulate

from .cab import braked
from .cases import Case, numbers_of, system
from .figure import FIGURE, centre_of_mass
from .figure_numbers import JOINTS
from .occupant_responses import REFERENCE_HEIGHT, responses_of, shares_of
from .proving_grounds import braking, rough, straight
from .uncertain import STEP, responses
from .vehicle.acceptance import Row, between, near

__all__ = ["CHECKS", "at_rest", "held_back", "main", "table"]

CENTRE = (-1.848, -0.041, 1.758)  # m, Table 8.1
GRIPS = (350.0, 500.0, 700.0)  # N
TURNS = 0.5, 2.0  # factors of a stiffness, one at a time


def run_of(case: Case, t_end: float) -> TreeTrajectory:
    """A case over some time."""
    return simulate(system(case), np.zeros(0), t_end=t_end, steps=round(t_end / STEP))


def seen(run: TreeTrajectory) -> Any:
    """(steps + 1, 3) path of the mass centre in the vehicle's frame, from its start, m."""
    place = run.view(bodies=FIGURE, reference="vehicle", shares=shares_of(run.system)).series()
    return place - place[0]


def at_rest() -> Iterator[Row]:
    """G1, G2: mass, mass centre, and a second of straight driving."""
    numbers = numbers_of(Case())
    place = centre_of_mass(numbers) + numbers.posture.hip
    yield near("G1", "mass", 77.0, 1e-6, numbers.figure.mass, "kg")
    yield between("G1", "mass centre from Table 8.1", 0.0, 0.010, float(np.abs(place - CENTRE).max()), "m")
    yield between("G1", "g2 at the start", 0.976, 1.000, float(place[2] - REFERENCE_HEIGHT), "m")
    run = run_of(Case(on=straight()), 1.0)
    yield between("G2", "drift in 1 s straight on", 0.0, 0.020, float(np.abs(seen(run)).max()), "m")


def held_back() -> Iterator[Row]:
    """The planar reduction's figures: in a driven cab as there, and on the vehicle, which pitches."""
    for hands, what, asked in (("both", "hands on", 0.1124), ("none", "hands free", 0.3039)):
        found = responses_of(run_of(Case(on=braked(7.0), hands=hands), 1.0))
        yield near("s12", f"driven cab, {what}", asked, 0.03, found["deviation"], "m")
    run = run_of(Case(), 1.0)
    path, found = seen(run), responses_of(run)
    yield near("s12", "vehicle, deviation", 0.132, 0.03, found["deviation"], "m")
    yield near("s12", "vehicle, forward", 0.126, 0.03, float(path[:, 0].max()), "m")
    yield near("s12", "vehicle, up", 0.040, 0.05, found["rise"], "m")
    yield near("s12", "vehicle, force of a hand", 205.0, 0.05, found["grip_force"], "N")


def braking_checks() -> Iterator[Row]:
    """G3: hands free he leaves, each grip holds him, and he moves forward and upward first."""
    found = responses("braking", {"hands": "none"})
    yield between("G3", "hands free, 1.5 s: he leaves", 0.5, 1e9, found["deviation"], "m")
    for grip in GRIPS:
        run = run_of(Case(grip=grip, on=braking()), 1.5)
        found, path = responses_of(run), seen(run)
        yield between("G3", f"grip {grip:g} N: deviation", 0.0, 0.160, found["deviation"], "m")
        yield between("G3", f"grip {grip:g} N: grips lost", 0.0, 0.0, found["grip_lost"], "1")
        yield between("G3", f"grip {grip:g} N: rise", 0.020, 1.0, found["rise"], "m")
        moved = int((np.linalg.norm(path, axis=1) > 0.020).argmax())
        yield between("G3", f"grip {grip:g} N: forward at 20 mm", 0.0, 1.0, float(path[moved, 0]), "m")
        yield between("G3", f"grip {grip:g} N: up at 20 mm", 0.0, 1.0, float(path[moved, 2]), "m")


def rollover_checks() -> Iterator[Row]:
    """G4, G9: ejection times in the order of the grips, at both starts."""
    for start in ("balanced", "torque-free"):
        free = responses("rollover", {"hands": "none", "start": start})
        by = {grip: responses("rollover", {"grip": grip, "start": start}) for grip in GRIPS}
        out = [free["ejected_at"], *(found["ejected_at"] for found in by.values())]
        pairs = ("350 N - free", "500 - 350 N", "700 - 500 N")
        for name, first, later in zip(pairs, out[:-1], out[1:], strict=True):
            yield between("G4", f"{start}: ejected, {name}", 0.0, 1.0, later - first, "s")
        lost = [found["grip_lost_at"] for found in by.values()]
        yield between("G4", f"{start}: 350 N lost before", 0.0, 1.0, min(lost[1:]) - lost[0], "s")
        yield between("G4", f"{start}: g2, 350 - 500 N", 0.0, 9.0, by[350.0]["g2"] - by[500.0]["g2"], "m")
        if start == "balanced":
            grid = {g: responses("rollover", {"grip": float(g)})["ejected_at"] for g in range(350, 701, 35)}
            worst = min(grid, key=grid.__getitem__)
            yield between("G9", "grip that is ejected first", 350.0, 450.0, worst, "N")


def waves() -> Iterator[Row]:
    """G6: the head moves faster over higher waves."""
    cases = [Case(on=rough(amplitude=a)) for a in (0.03, 0.04, 0.05)]
    rms = [responses_of(run_of(case, 5.0))["head_speed_rms"] for case in cases]
    for asked, found in zip((0.90, 1.18, 1.49), rms, strict=True):
        yield near("G6", "head speed, rms", asked, 0.10, found, "m/s")
    yield between("G6", "least growth", 1e-6, 9.0, float(np.diff(rms).min()), "m/s")


def screening() -> Iterator[Row]:
    """G8, G10: factors one at a time in the step steer; half the step."""
    for start, seat in (("balanced", 1e4), ("balanced", 2e4), ("settled", 1e4), ("settled", 2e4)):
        row: Mapping[str, Any] = {"start": start, "seat_rate": seat}
        base = responses("step steer", row)["rise"]
        effect = {joint: max(abs(rise - base) for rise in rises(row, joint)) for joint in JOINTS}
        order = sorted(effect, key=lambda joint: -effect[joint])
        what = f"{start}, {seat / 1e3:g} kN/m"
        leaders = len({"elbow", "hip_tx"} & set(order[:2]))
        yield between("G8", f"{what}: elbow, hip TX of the top two", 2, 2, leaders, "")
        share = effect["ankle"] / effect[order[0]]
        yield between("G8", f"{what}: ankle over the leader", 0.0, 0.01, share, "1")
        finer = responses("step steer", row, step=0.5 * STEP)["rise"]
        change = abs(finer - base) / max(effect.values())
        yield between("G10", f"{what}: half the step over the range", 0.0, 0.02, change, "1")


def rises(row: Mapping[str, Any], joint: str) -> list[float]:
    """The rise at both factors of a joint; with soft elbows he does not settle, which leaves one."""
    factors = TURNS[1:] if (row["start"], joint) == ("settled", "elbow") else TURNS
    return [responses("step steer", {**row, f"k_{joint}": factor})["rise"] for factor in factors]


CHECKS = (at_rest, held_back, braking_checks, rollover_checks, waves, screening)


def table(checks: tuple[Callable[[], Iterator[Row]], ...] = CHECKS) -> list[Row]:
    """All rows."""
    return [row for check in checks for row in check()]


def main() -> None:
    """Print the table."""
    for row in table():
        verdict = "pass" if row.passes else "MISS"
        print(f"{row.check:4} {row.what:45} {row.asked:28} {row.ours:12.5g}  {verdict}")


if __name__ == "__main__":
    main()
