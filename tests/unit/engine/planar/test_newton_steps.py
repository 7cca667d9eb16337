"""How a step of the compiled loop begins, and how few Newton steps and factors it needs."""

import numpy as np
import pytest

from studies.occupant_braking import NOMINAL, T_END, restraint
from workbench.engine import Body, RevoluteJoint, System, acting_members, simulate
from workbench.engine.planar._kernels.alpha import EXTRAPOLATIONS, LOOKS

NODES = np.arange(-1, -1 - LOOKS, -1.0)  # the latest first; 0 is the step to come
CORNER = {**NOMINAL, "hands": "none", "mass": 95.0, "deceleration": 9.0, "seat_cap": 300.0}


@pytest.mark.parametrize(
    ("which", "degree", "follows"), [(0, 1, True), (1, 2, False), (2, 4, True), (3, 5, False)]
)
def test_extrapolations_are_exact_for_polynomials_and_the_alternation(which, degree, follows):
    weights = EXTRAPOLATIONS[which]
    for power in range(degree + 1):
        assert weights @ NODES**power == pytest.approx(0.0**power, abs=1e-11)
    assert weights @ NODES ** (degree + 1) != pytest.approx(0.0, abs=0.5)
    assert (weights @ (-1.0) ** NODES == pytest.approx(1.0)) == follows


@pytest.fixture(scope="module")
def restrained():
    model = restraint()
    density = np.zeros(model.members)
    density[:: model.members // 24] = 0.5
    return acting_members(model.system(CORNER), density)


def test_few_newton_steps_and_hardly_any_factors(restrained):
    run = simulate(*restrained, t_end=T_END, steps=1000)
    # 3759 and 529 where straight lines begin every step and rounding is taken for slow progress
    assert run.diagnosis.newton_iterations < 3600
    assert run.diagnosis.factorisations < 200


def test_what_they_leave_of_the_joints_is_rounding(restrained):
    run = simulate(*restrained, t_end=T_END, steps=1000)
    assert np.abs(run.joint_residuals()).max() < 1e-14 * np.abs(run.position).max()


def pendulum(pins):
    """A rod that falls from the horizontal, held by one pin or by several in the same place."""
    rod = Body(name="rod", mass=2.0, inertia=0.3, position=(0.5, 0.0, 0.0))
    joints = [
        RevoluteJoint(a="rod", b="ground", point_a=(-0.5, 0.0), point_b=(0.0, 0.0), name=f"pin {number}")
        for number in range(pins)
    ]
    return System(bodies=(rod,), joints=tuple(joints))


def test_pins_in_one_place_share_their_force_however_long_the_run():
    """Extrapolated shares would part by 580 N of 44 in 8000 steps: no equation holds them together."""
    run = simulate(pendulum(2), [], t_end=20.0, steps=8000)
    one = simulate(pendulum(1), [], t_end=20.0, steps=8000)
    first, second = run.multiplier[:, :2], run.multiplier[:, 2:]
    assert np.abs(first - second).max() < 1e-4
    assert np.abs(first + second - one.multiplier).max() < 1e-8 * np.abs(one.multiplier).max()
