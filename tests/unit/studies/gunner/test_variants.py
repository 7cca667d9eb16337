"""Postures and orientations of section 9.2, both seats and both starts."""

import numpy as np
import pytest

from studies.gunner.cab import straight
from studies.gunner.cabin.facing import faced
from studies.gunner.cases import Case, numbers_of, system
from studies.gunner.figure import centre_of_mass, figure, supports
from studies.gunner.figure_numbers import figure_numbers
from studies.gunner.occupant_responses import responses_of
from studies.gunner.uncertain import case_of
from workbench.engine import simulate

REST = 1e-9  # m/s2


def run_of(case, t_end=0.002, steps=2):
    return simulate(system(case), np.zeros(0), t_end, steps)


@pytest.mark.parametrize("seat_rate", [10_000.0, 20_000.0])
@pytest.mark.parametrize("start", ["balanced", "torque-free"])
@pytest.mark.parametrize("posture", ["seated", "standing"])
def test_both_postures_with_both_seats_at_both_starts(posture, start, seat_rate):
    row = {"posture": posture, "start": start, "seat_rate": seat_rate, "facing": 90.0}
    case = case_of("braking", row)
    assert (case.posture, case.start, case.seat_rate, case.facing) == tuple(row[k] for k in (
        "posture", "start", "seat_rate", "facing",
    ))  # fmt: skip
    still = Case(on=straight(), posture=posture, start=start, seat_rate=seat_rate, facing=90.0)
    push = np.abs(run_of(still).acceleration).max()
    assert (push < REST) == (start == "balanced")
    carried = system(still).bushings[2:]
    assert sum(b.k for b in carried) == pytest.approx(seat_rate)
    assert sum(b.preload[2] for b in carried) == pytest.approx(77.0 * 9.81)


def test_he_stands_on_the_floor_with_his_hands_on_the_same_bars():
    standing = {b.name: b.point_b for b in system(Case(on=straight(), posture="standing")).bushings}
    seated = {b.name: b.point_b for b in system(Case(on=straight())).bushings}
    assert set(standing) == {"left grip", "right grip", "left foot", "right foot"}
    for side in ("left", "right"):
        assert standing[f"{side} grip"] == pytest.approx(seated[f"{side} grip"], abs=1e-6)
        assert standing[f"{side} foot"][2] == pytest.approx(0.76 + 0.08, abs=1e-6)  # a sole above the floor
    numbers = figure_numbers(posture="standing")
    place = centre_of_mass(numbers) + numbers.posture.hip
    assert place[0] == pytest.approx((centre_of_mass(figure_numbers()) + figure_numbers().posture.hip)[0])
    assert 0.0 < supports(numbers, "balanced")["left foot"][0] < 0.158


def test_stops_stay_where_they_are_on_the_body():
    """Seated the hip extends by 0.872 rad from 45 deg, the knee stretches as far from its 45 deg."""
    springs = {(s.body, s.coordinate): s for s in figure(figure_numbers(posture="standing")).springs}
    hip, knee, wrist = (springs[f"left {x}", 0] for x in ("thigh", "shank", "hand"))
    assert (hip.lower, hip.upper) == pytest.approx((0.488 + np.radians(37.0), 0.872 - np.radians(37.0)))
    assert (knee.lower, knee.upper) == pytest.approx((0.872 - np.radians(29.0), 1.483 + np.radians(29.0)))
    assert (wrist.lower, wrist.upper) == pytest.approx((1.378, 0.523))


def test_a_gunner_who_faces_left_is_the_same_gunner_turned():
    """In a cab that moves straight on, which way he faces changes nothing he feels."""
    row = {"hands": "one", "start": "torque-free", "on": straight()}
    ahead, left = (run_of(Case(**row, facing=facing), 0.3, 300) for facing in (0.0, 90.0))
    for name in ("head", "left foot"):
        seen = ahead.of(name) - (17.0 * ahead.times)[:, None] * (1.0, 0.0, 0.0)
        turned = left.of(name) - (17.0 * left.times)[:, None] * (1.0, 0.0, 0.0)
        assert turned == pytest.approx(np.array([faced(x, 90.0) for x in seen]), abs=1e-8)
    a, b = responses_of(ahead), responses_of(left)
    for name in ("deviation", "rise", "grip_force", "seat_force", "hic15"):
        assert b[name] == pytest.approx(a[name], rel=1e-6, abs=1e-9), name


def test_his_weight_on_the_springs_turns_with_him():
    loads = {
        facing: sum(s.torque for s in system(Case(facing=facing)).springs if s.body.startswith("front left"))
        for facing in (0.0, 180.0)
    }
    assert loads[0.0] != pytest.approx(loads[180.0], rel=1e-6)
    assert numbers_of(Case(posture="standing")).posture.thigh == 8.0
