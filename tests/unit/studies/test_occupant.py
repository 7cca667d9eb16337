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
