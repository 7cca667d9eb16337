"""The study of any hands takes what the worst over everything takes, and what was found there stays."""

from importlib.resources import files

import pytest

from studies.gunner.checks.preset import space
from studies.gunner.uncertain import NOMINAL, responses
from workbench.study.loading import load_study

# where the study's search and its adversary ended
WORST = {
    "grip": 700.0, "hands": "one", "k_shoulder_tx": 0.5, "k_shoulder_tz": 0.5, "k_elbow": 2.0,
    "k_wrist_tx": 2.0, "k_hip_tx": 0.5, "k_hip_tz": 0.5, "k_knee": 0.5, "k_ankle": 2.0,
    "seat_rate": 40_000.0, "seat_cap": 1000.0, "mass": 95.0, "friction": 1.25, "turn": 720.0,
}  # fmt: skip


def test_it_takes_what_the_worst_over_everything_takes():
    own = load_study(str(files("studies.gunner") / "checks" / "any_hands.toml")).space
    wanted = space("rollover")
    assert set(own.names) == set(wanted.names) == set(WORST)
    assert set(own.names) <= set(NOMINAL)
    for parameter in wanted.parameters:
        twin = next(p for p in own.parameters if p.name == parameter.name)
        assert (twin.lower, twin.upper, twin.levels, twin.scale) == (
            parameter.lower, parameter.upper, parameter.levels, parameter.scale,
        )  # fmt: skip


@pytest.mark.slow
def test_one_strong_hand_throws_him_out_first():
    times = {h: responses("rollover", {**WORST, "hands": h})["ejected_at"] for h in ("none", "one", "both")}
    assert times["one"] == pytest.approx(2.2621, abs=2e-3)
    assert times["one"] < times["none"] - 0.05
    assert times["none"] < times["both"] - 0.1
    assert times["one"] < responses("rollover", {**WORST, "grip": 350.0})["ejected_at"] - 0.01
    half = responses("rollover", WORST, step=0.5e-3)["ejected_at"]
    assert half == pytest.approx(times["one"], abs=5e-3)
