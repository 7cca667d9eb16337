"""Level L1: a start at rest on shelf or feet, what touches him, and slips of the file and the case."""

import numpy as np
import pytest

from studies.gunner.cab import braked, straight
from studies.gunner.cabin.contacts import SHELF, balls, cabin_numbers, shapes
from studies.gunner.cases import Case, system
from studies.gunner.checks.contacts import random_case, straps
from studies.gunner.figure_numbers import figure_numbers
from studies.gunner.occupant_responses import responses_of
from studies.gunner.parameters import FILE
from studies.gunner.uncertain import STEPS, case_of
from workbench.engine import simulate

REST = 1e-9  # m/s2: what rounding leaves of 9.81


def run_of(case, t_end=0.002, steps=2):
    return simulate(system(case), np.zeros(0), t_end, steps)


@pytest.mark.parametrize("posture", ["seated", "standing"])
@pytest.mark.parametrize("facing", [0.0, 90.0, -37.0])
def test_he_rests_on_shelf_or_feet_whichever_way_he_faces(posture, facing):
    run = run_of(Case(level="L1", on=straight(), posture=posture, facing=facing, mass=83.0))
    assert np.abs(run.acceleration).max() < REST
    force = run.contact_forces().force[0]
    pressed = {c.a: c.b for c, f in zip(run.system.contacts, force, strict=True) if f.any()}
    assert force.sum(axis=0) == pytest.approx((0.0, 0.0, 83.0 * 9.81), abs=1e-6)
    feet = {f"{side} foot": "vehicle" for side in ("left", "right")}
    assert pressed == ({"lower torso": SHELF} if posture == "seated" else feet)


def test_braked_hands_free_he_slides_against_the_ring_and_stays():
    free = run_of(Case(level="L1", on=braked(7.0), hands="none"), t_end=1.2, steps=2400)
    found = responses_of(free)
    assert found["ejected"] == 0.0
    assert found["seat_lost_at"] < 1.0  # he has left his place by 0.16 m
    assert 1000.0 < found["touch_force"] < 10_000.0
    assert found["seat_force"] > 0.9 * 77.0 * 9.81
    ring = [c.b == "vehicle" and type(c.shape).__name__ == "Ring" for c in free.system.contacts]
    assert np.abs(free.contact_forces().force[:, ring]).max() > 500.0


def test_a_shelf_that_is_let_go_lets_him_drop():
    runs = {
        at: run_of(Case(level="L1", on=straight(), hands="none", shelf_drops_at=at), t_end=0.4, steps=400)
        for at in (None, 0.1)
    }
    drop = responses_of(runs[None])["min_g2"] - responses_of(runs[0.1])["min_g2"]
    assert drop == pytest.approx(0.5 * 9.81 * 0.25**2, rel=0.15)  # falls freely from 0.15 s on


def test_25_balls_may_meet_14_shapes():
    numbers, given = figure_numbers(), cabin_numbers()
    assert len(balls(numbers, given.skin)) == 25
    assert len(shapes(given.cabin)) == 14


def test_rows_and_random_cases_name_the_level():
    assert (case_of("braking", {"level": "L1"}).level, case_of("braking", {}).level) == ("L1", "L0")
    assert STEPS["L1"] < STEPS["L0"]
    assert random_case(4) == random_case(4)
    assert {random_case(seed).on.name for seed in range(6)} == {
        "straight", "braking", "step steer", "rollover", "rough", "kerb trip",
    }  # fmt: skip


def test_twelve_straps_share_a_force_and_reach_the_floor_layer():
    members = straps(1200.0, 1.5).members
    assert len(members) == 12
    assert {m.law.f0 for m in members} == {100.0}
    feet = np.array([m.point_b for m in members])
    assert np.hypot(feet[:, 0] + 1.848, feet[:, 1] + 0.041) == pytest.approx(np.full(12, 0.4))
    assert feet[:, 2] == pytest.approx(np.full(12, 0.759))


def test_slips_are_told(tmp_path):
    with pytest.raises(ValueError, match="level needs one of L0, L1, got 'L2'"):
        system(Case(level="L2"))
    with pytest.raises(ValueError, match="shelf_drops_at needs level='L1'"):
        system(Case(shelf_drops_at=1.0))
    with pytest.raises(ValueError, match="posture needs one of seated, standing, got 'kneeling'"):
        system(Case(posture="kneeling"))
    own = tmp_path / "own.toml"
    text = FILE.read_text()
    start = text.index("[gunner.standing]")
    own.write_text(text[:start] + text[start:].replace("knee = { value = 16.0", "knee = { value = 8.0", 1))
    with pytest.raises(
        ValueError, match=r"a standing gunner needs his mass centre above his feet, 0 to 0\.158"
    ):
        system(Case(level="L1", posture="standing", file=own))
