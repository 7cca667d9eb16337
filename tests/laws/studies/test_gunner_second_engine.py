"""The vehicle, alone and with the gunner, beside the traces that a second engine left: check V14.

The traces, every 20 ms, are those of Exudyn: `tests/peers/studies/test_vehicle_exudyn.py`.
"""

import csv
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from studies.gunner.cases import Case, system
from studies.gunner.figure import FIGURE
from studies.gunner.occupant_responses import shares_of
from studies.gunner.parameters import read
from studies.gunner.parts import joined
from studies.gunner.proving_grounds import braking, rollover, step_steer
from studies.gunner.vehicle.assembly import vehicle
from studies.gunner.vehicle.numbers import VehicleParameters
from studies.gunner.vehicle.states import first_time, vehicle_states
from workbench.engine import TreeSystem, simulate

pytestmark = pytest.mark.slow

TRACES = Path(__file__).parent / "gunner_by_exudyn.csv"
STEP = 1e-3  # s
ANGLES, G2, TIPPED_WITHIN = 0.01, 0.02, 0.020  # of the range, rms; s
LIFTED = 1.0  # N
CASES = {
    "rollover": 2.54, "step steer with gunner": 1.0, "braking with gunner": 1.0,
}  # s; in the rollover to just beyond 45 deg, before the shell strikes the ground  # fmt: skip


def of_case(name: str) -> tuple[TreeSystem, float]:
    """System and time of a case."""
    if name == "rollover":
        ground = rollover()
        parameters = read(VehicleParameters, "vehicle")
        return joined(vehicle(parameters, ground.ground, ground.manoeuvre)), CASES[name]
    grounds = {"step steer with gunner": step_steer(), "braking with gunner": braking()}
    return system(Case(on=grounds[name])), CASES[name]


def traces() -> dict[str, dict[str, Any]]:
    """What the second engine said: histories by case and name."""
    with TRACES.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    found: dict[str, dict[str, Any]] = {}
    for name in CASES:
        own = [row for row in rows if row["case"] == name]
        keys = [key for key in ("time", "roll", "yaw", "g2") if own[0][key]]
        found[name] = {key: np.array([float(row[key]) for row in own]) for key in keys}
    return found


def compared(name: str, theirs: dict[str, Any]) -> None:
    """Ours beside theirs: angles to the first lift of a wheel, time of 45 deg, g2 over all of its range."""
    body, t_end = of_case(name)
    run = simulate(body, np.zeros(0), t_end=t_end, steps=round(t_end / STEP))
    states = vehicle_states(run)
    nodes = np.rint(theirs["time"] / STEP).astype(int)
    lifts = np.flatnonzero(states.wheel_loads.min(axis=1) < LIFTED)
    on_ground = nodes < (lifts[0] if len(lifts) else len(run.times))
    moved = 0
    for key in ("roll", "yaw"):
        ours = getattr(states, key)[nodes]
        if np.ptp(ours) < 1e-3:
            continue  # straight on
        moved += 1
        off = ours - theirs[key]
        share = np.sqrt((off[on_ground] ** 2).mean()) / np.ptp(ours[on_ground])
        print(f"{name}: {key} {100 * share:.4f} % of its range to the first lift")
        assert share < ANGLES
    if name == "rollover":
        assert len(lifts)
        tipped = [
            first_time(t, np.abs(roll), float(np.radians(45.0)))
            for t, roll in ((run.times, states.roll), (theirs["time"], theirs["roll"]))
        ]
        print(f"{name}: 45 deg at {tipped[0]:.4f} and {tipped[1]:.4f} s")
        assert tipped[0] == pytest.approx(tipped[1], abs=TIPPED_WITHIN)
    if "g2" in theirs:
        moved += 1
        ours = run.view(bodies=FIGURE, reference="vehicle", shares=shares_of(body)).series()[nodes, 2]
        share = np.sqrt(((ours - theirs["g2"]) ** 2).mean()) / np.ptp(ours)
        print(f"{name}: g2 {100 * share:.4f} % of its range")
        assert share < G2
    assert moved


@pytest.mark.parametrize("name", CASES)
def test_a_second_engine_says_the_same(name):
    compared(name, traces()[name])
