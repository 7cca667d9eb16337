"""Dampers and brakes on coordinates against closed forms of a cart."""

import numpy as np
import pytest

from workbench.engine import (
    CoordinateDamper,
    Maximum,
    PointAcceleration,
    Prismatic,
    SpatialBody,
    TreeSystem,
    parameter_slopes,
    simulate,
)
from workbench.engine.errors import InvalidSystem

MASS = 3.0


def cart(speed, *dampers):
    body = SpatialBody(name="cart", joint=Prismatic(speed=speed), mass=MASS)
    return TreeSystem(bodies=(body,), dampers=dampers)


def run_of(system, t_end=1.0, steps=1000):
    return simulate(system, np.zeros(0), t_end=t_end, steps=steps)


@pytest.mark.parametrize(("speed", "rate"), [(2.0, 4.0), (-2.0, 9.0)])
def test_a_shock_absorber_has_a_rate_for_each_way(speed, rate):
    run = run_of(cart(speed, CoordinateDamper(body="cart", forward=4.0, backward=9.0, slow=1e-6)))
    assert run.velocity[:, 0] == pytest.approx(speed * np.exp(-rate / MASS * run.times), abs=1e-5)


def test_one_rate_serves_both_ways():
    run = run_of(cart(-2.0, CoordinateDamper(body="cart", forward=4.0)))
    assert run.velocity[-1, 0] == pytest.approx(-2.0 * np.exp(-4.0 / MASS), abs=1e-5)


def test_a_brake_stops_and_holds():
    """12 N from 0.2 s on take 2 m/s away within 0.5 s, and nothing runs back."""
    brake = CoordinateDamper(body="cart", friction=lambda t: 12.0 * (t > 0.2), slow=1e-3)
    run = run_of(cart(2.0, brake))
    moving = run.times < 0.69
    due = 2.0 - 4.0 * np.maximum(run.times - 0.2, 0.0)
    assert run.velocity[moving, 0] == pytest.approx(due[moving], abs=5e-3)
    assert np.abs(run.velocity[run.times > 0.71, 0]).max() < 1e-6


@pytest.mark.slow
def test_slopes_by_rates_and_friction_are_those_of_differences():
    def system_at(x):
        return cart(2.0, CoordinateDamper(body="cart", forward=x, backward=1.0, friction=3.0 + x, slow=0.3))

    objective = Maximum(quantity=PointAcceleration(body="cart"))
    run = run_of(system_at(4.0), t_end=0.5, steps=100)
    slope = parameter_slopes(run, objective, {"rate": (4.0, system_at)})
    e = 1e-5
    above, below = (objective.value(run_of(system_at(4.0 + s), t_end=0.5, steps=100)) for s in (e, -e))
    assert slope["rate"] == pytest.approx((above - below) / (2.0 * e), rel=1e-7)


def test_refusals():
    with pytest.raises(InvalidSystem, match=r"damper of 'cart' needs slow > 0, got slow=0.0"):
        CoordinateDamper(body="cart", slow=0.0)
    with pytest.raises(InvalidSystem, match=r"dampers\[0\] needs a coordinate of the joint of 'cart'"):
        cart(1.0, CoordinateDamper(body="cart", coordinate=1))
