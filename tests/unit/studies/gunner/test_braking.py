"""The gunner in a driven cab that brakes: the planar reduction's figures, and what holds him."""

import numpy as np
import pytest

from studies.gunner.cab import braked
from studies.gunner.cases import Case, system
from studies.gunner.occupant_responses import objectives, responses_of
from workbench.engine import simulate


def run_of(case, t_end=1.0):
    return simulate(system(case), np.zeros(0), t_end=t_end, steps=round(1000 * t_end))


@pytest.fixture(scope="module")
def held():
    return run_of(Case(on=braked(7.0)))


@pytest.fixture(scope="module")
def free():
    return run_of(Case(on=braked(7.0), hands="none"))


def test_he_moves_as_the_planar_reduction_does(held, free):
    """Section 12 of the note, with the same driven vehicle: mm and N, 3 %."""
    on, off = responses_of(held), responses_of(free)
    assert on["deviation"] == pytest.approx(0.1124, rel=0.03)
    assert on["rise"] == pytest.approx(0.041, rel=0.03)
    assert on["grip_force"] == pytest.approx(142.0, rel=0.03)
    assert on["head_speed"] == pytest.approx(0.79, rel=0.12)  # here the neck has two joints, there one
    assert off["deviation"] == pytest.approx(0.3039, rel=0.03)
    assert off["rise"] == pytest.approx(0.031, rel=0.03)
    assert (on["grip_lost"], on["seat_lost"], off["grip_lost"], off["seat_lost"]) == (0.0, 0.0, 0.0, 0.0)
    assert (on["grip_lost_at"], on["ejected_at"]) == (1.0, 1.0)
    assert on["min_g2"] == pytest.approx(0.9876, abs=1e-3)
    assert on["smooth_deviation"] < on["deviation"] < 1.15 * on["smooth_deviation"]
    assert 0.0 < on["rise"] - on["smooth_rise"] < 0.015


def test_he_stays_in_the_middle_and_rests_before_the_brakes(held):
    sides = [held.of(f"{side} hand") for side in ("left", "right")]
    assert sides[0][:, 1] + sides[1][:, 1] == pytest.approx(-0.082, abs=1e-9)
    before = held.times < 0.5
    assert np.abs(held.velocity[before] - held.velocity[0]).max() < 1e-9


def test_what_acts_on_him_sums_to_mass_times_acceleration(held):
    """Seat and grips carry 77 kg times the acceleration of his mass centre less gravity."""
    system = held.system
    force = sum(held.bushing_force(b.name) for b in system.bushings)
    mass = {b.name: b.mass for b in system.bodies}
    push = sum(mass[b.name] * acceleration(held, b) for b in system.bodies if b.mass > 0.0)
    weight = np.array([0.0, 0.0, -9.81 * sum(mass.values())])
    late = held.times > 0.7
    assert (force + weight)[late] == pytest.approx(push[late], abs=5.0)


def acceleration(run, body):
    f = run.frames(body.name)
    arm = f.axes @ np.asarray(body.centre)
    return f.acceleration + np.cross(f.spin_rate, arm) + np.cross(f.spin, np.cross(f.spin, arm))


def test_a_weak_hand_alone_is_lost_and_a_strong_one_holds():
    lost = responses_of(run_of(Case(on=braked(7.0), hands="one", grip=150.0), t_end=1.5))
    assert lost["grip_lost"] == 1.0
    assert 0.6 < lost["grip_lost_at"] < 1.5


def test_every_response_has_an_objective_with_slopes(free):
    ask = objectives(free.system, t_end=1.0)
    assert {"g1", "rise", "head_speed", "hic15", "chest_3ms", "comfort", "seat_lost_at"} <= ask.keys()
    assert ask["ejected_at"].quantity.values(free).max() < 0.0
    for refused in (
        lambda q: q.rates(free, np.arange(2)),
        lambda q: q.rate_slopes(free, 0),
    ):
        with pytest.raises(ValueError, match="the distance out of the hatch has no rates"):
            refused(ask["ejected_at"].quantity)


def test_the_cab_brakes_to_a_stand():
    motion = braked(7.0)
    t = np.linspace(0.4, 3.2, 15)
    h = 1e-4
    velocity = [(motion.position(x + h)[0] - motion.position(x - h)[0]) / (2 * h) for x in t]
    acceleration = [(motion.velocity(x + h)[0] - motion.velocity(x - h)[0]) / (2 * h) for x in t]
    assert velocity == pytest.approx([motion.velocity(x)[0] for x in t], abs=1e-6)
    assert acceleration == pytest.approx([motion.acceleration(x)[0] for x in t], abs=1e-4)
    assert motion.velocity(3.0)[0] == 0.0
    with pytest.raises(ValueError, match=r"deceleration needs 0 < value <= 340 m/s2, got 0"):
        braked(0.0)
