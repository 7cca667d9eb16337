"""The planar occupant: masses, geometry, statics and what braking does to it."""

import numpy as np
import pytest

from studies.occupant import CG, JOINTS, MASSES, ONSET, SEGMENTS, Case, braking, member_sites, system
from workbench.engine import Deviation, GeneralisedAlpha, simulate

STEPS, T_END = 1250, 2.5
LOST = 1.0  # m: an occupant that moved further has left the seat for good


def test_masses_and_centre_of_gravity():
    assert sum(MASSES) == pytest.approx(77.0, abs=1e-9)
    assert CG == pytest.approx((0.177, 0.986), abs=1e-3)
    assert len(SEGMENTS) == 10
    assert len(JOINTS) == 9


def test_members_are_those_of_table_c3_on_an_octagon():
    sites = member_sites()
    assert [site.number for site in sites] == list(range(1, 181))
    assert sum(site.layer == 5 for site in sites) == 36
    lengths = [np.hypot(np.hypot(*np.subtract(s.on_occupant, s.on_vehicle)), s.offset) for s in sites]
    assert min(lengths) == pytest.approx(0.180, abs=1e-3)
    assert max(lengths) == pytest.approx(1.345, abs=1e-3)
    assert max(abs(site.offset) for site in sites) == pytest.approx(0.283, abs=1e-3)
    assert {site.segment for site in sites} == {"upper torso", "central torso", "lower torso"}


@pytest.mark.parametrize("deceleration", [6.0, 7.0, 9.0])
def test_the_vehicle_brakes_smoothly_until_it_stands(deceleration):
    motion = braking(deceleration)
    t = np.linspace(0.0, 4.0, 4001)
    v = np.array([motion.speed(s)[0] for s in t])
    a = np.array([motion.push(s)[0] for s in t])
    assert v[t <= ONSET] == pytest.approx(-17.0)
    assert v[-1] == pytest.approx(0.0, abs=1e-9)
    assert a.max() == pytest.approx(deceleration)
    np.testing.assert_allclose(np.gradient(v, t)[1:-1], a[1:-1], atol=0.2)
    x = np.array([motion.place(s)[0] for s in t])
    np.testing.assert_allclose(np.gradient(x, t)[1:-1], v[1:-1], atol=2e-3)


ANATOMY = {  # degrees the distal segment may turn from the reference posture: (forward or flexed, back)
    # flexion of all but the knee turns the distal segment clockwise, seen with x rearward to the right
    "shoulder TX": {"raise the arm": -45.0, "let the arm hang back": 62.0},
    "elbow": {"flex": -95.0, "extend": 30.0},
    "wrist TX": {"flex": -79.0, "extend": 30.0},
    "hip TX": {"raise the thigh": -28.0, "extend": 50.0},
    "knee": {"flex": 85.0, "extend": -50.0},
    "ankle": {"raise the toes": -20.0, "point the toes": 50.0},
}


@pytest.mark.parametrize("name", ANATOMY)
def test_the_stops_let_a_joint_turn_as_far_as_a_body_does(name):
    """Each stop stands on its own side: a hanging segment swings back by the + stop of Table 8.6."""
    allowed = ANATOMY[name].values()
    assert np.degrees(JOINTS[name].up) == pytest.approx(max(allowed), abs=0.6)
    assert -np.degrees(JOINTS[name].down) == pytest.approx(min(allowed), abs=0.6)


def test_an_elbow_that_extends_draws_the_hand_away_from_the_shoulder():
    """The sign rule itself, by geometry: the elbow's + stop is on the side on which the arm gets longer."""
    shoulder, elbow = np.array(JOINTS["shoulder TX"].at), np.array(JOINTS["elbow"].at)
    wrist = np.array(JOINTS["wrist TX"].at)

    def reach(degrees: float) -> float:
        c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        forearm = np.array([[c, -s], [s, c]]) @ (wrist - elbow)
        return float(np.linalg.norm(elbow + forearm - shoulder))

    assert reach(np.degrees(JOINTS["elbow"].up)) > reach(0.0) > reach(-np.degrees(JOINTS["elbow"].down))


def test_his_arms_fold_in_braking_and_the_elbow_never_bends_backwards():
    body = system(Case())
    run = simulate(body, body.density(0.0), t_end=2.0, steps=1000)
    forearm, upper_arm = (run.position[:, body.coordinate(n)][:, 2] for n in ("forearms", "upper arms"))
    turned = np.degrees(forearm - upper_arm)
    assert turned.min() < -35.0  # the stop on the wrong side held it at 30
    assert turned.max() < 35.0


def deviation(case: Case) -> np.ndarray:
    """Distance of the occupant's mass centre from its start in the vehicle frame, m."""
    body = system(case)
    run = simulate(body, body.density(0.0), t_end=T_END, steps=STEPS, scheme=GeneralisedAlpha(rho=0.8))
    g1 = Deviation(bodies=tuple(SEGMENTS), reference="vehicle", shares=MASSES)
    return np.sqrt(g1.values(run))


@pytest.mark.slow
def test_hands_off_leaves_and_both_hands_hold():
    assert deviation(Case(hands=0)).max() > LOST
    for grip in (350.0, 500.0, 700.0):
        assert deviation(Case(hands=2, grip=grip)).max() < 0.15


@pytest.mark.slow
def test_with_one_hand_the_grip_strength_decides():
    peaks = [deviation(Case(hands=1, grip=grip, deceleration=9.0)).max() for grip in (350.0, 700.0)]
    assert peaks[0] > LOST > peaks[1]


@pytest.mark.slow
def test_out_of_plane_joints_are_without_effect():
    plain = deviation(Case())
    turned = deviation(Case(factors={"shoulder TZ": 2.0, "hip TZ": 0.5}))
    np.testing.assert_array_equal(plain, turned)


def test_bad_input_is_named():
    with pytest.raises(ValueError, match="hands needs 0, 1 or 2, got 3"):
        system(Case(hands=3))
    with pytest.raises(ValueError, match=r"kinds needs names out of belt, airbag, retractor, got \['rope'\]"):
        system(Case(), kinds=("rope",))
    with pytest.raises(ValueError, match=r"factors needs joints of Table 8.6 .* got \['jaw'\]"):
        system(Case(factors={"jaw": 1.0}))
    with pytest.raises(ValueError, match="deceleration needs 0 < value <= 340 m/s2, got 400"):
        braking(400.0)
