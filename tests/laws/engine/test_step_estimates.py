"""What step estimates claim: their error against the true one, on smooth, jointed and contact systems."""

import numpy as np
import pytest

from studies import three_body, two_body
from tests.papers.engine.test_mechanisms import four_bars, squeezer, swing
from tests.sample_spatial import bricard
from workbench.engine import (
    Body,
    Contact,
    Coordinate,
    Deviation,
    GeneralisedAlpha,
    IndependentAlpha,
    Integral,
    Member,
    PointCoordinate,
    RungeKutta8,
    System,
    Terminal,
    choose_steps,
    simulate,
)


def bouncing():
    """A mass falls on a contact of 2 mm rounding and springs back."""
    mass = Body(name="mass", mass=1.0, inertia=1.0, position=(0.0, 0.1, 0.0))
    floor = Member(
        a="mass", b="ground", point_b=(0.0, -1.0), natural_length=1.0,
        law=Contact(k=4000.0, c=5.0, side=-1, width=2e-3),
    )  # fmt: skip
    return System(bodies=(mass,), members=(floor,))


def end(body, direction=(1.0, 0.0)):
    """The end value of a coordinate."""
    return Terminal(quantity=Coordinate(bodies=(body,), direction=direction))


P3 = Terminal(quantity=PointCoordinate(point="P3"))
CASES = {
    "two bodies": (two_body.problem("C").system, 0.1, two_body.problem("C").objective, 0.2, None),
    "three bodies, joint": (
        three_body.problem().system, 0.1, three_body.problem().objective, 0.2, None,
    ),
    "sprung bar": (swing(), 1.0, end("bar", (0.0, 1.0)), 1.0, None),
    "four bars, undamped": (four_bars(2), 1.0, end("bar0"), 0.6, IndependentAlpha()),
    "squeezer": (squeezer(), 1.0, end("K3", (0.0, 1.0)), 0.02, GeneralisedAlpha(rho=0.9)),
    "bouncing on a contact": (bouncing(), 1.0, Integral(quantity=Deviation(bodies=("mass",))), 0.6, None),
    "bricard": (bricard(), 1.0, P3, 1.0, IndependentAlpha(rho=0.9)),
    "bricard, order 8": (bricard(), 1.0, P3, 2.0, RungeKutta8()),
}  # fmt: skip


DEAR = ("four bars, undamped", "bouncing on a contact")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in DEAR else name for name in CASES]
)
def test_estimated_errors_are_the_true_ones_within_a_factor(name):
    system, alpha, objective, t_end, scheme = CASES[name]
    density = np.full(len(system.members), alpha)
    tolerance = 1e-8 if isinstance(scheme, RungeKutta8) else 1e-4
    choice = choose_steps(
        system, density, objective, t_end=t_end, tolerance=tolerance, steps=10, scheme=scheme
    )
    assert choice.fine_enough
    assert f"{choice.steps} steps reach" in choice.reason
    factor = 4 if isinstance(scheme, RungeKutta8) else 16
    fine = simulate(system, density, t_end, factor * choice.steps, scheme=scheme)
    truth = objective.value(fine)
    true = abs(choice.value - truth) / abs(truth)
    print(f"{name}: {choice.steps} steps, estimated {choice.relative_error:.1e}, true {true:.1e}")
    assert true <= 2.0 * choice.relative_error + 1e-12
    assert true <= 1.5 * tolerance
    assert choice.relative_error <= 10.0 * true + 1e-10


def test_a_tolerance_out_of_reach_is_said():
    choice = choose_steps(swing(), [1.0], end("bar"), t_end=1.0, tolerance=1e-14, steps=10, most=80)
    assert not choice.fine_enough
    assert "80 steps do not reach a relative error of 1e-14" in choice.reason
    with pytest.raises(ValueError, match="choose_steps needs tolerance > 0, got tolerance=0"):
        choose_steps(swing(), [1.0], end("bar"), t_end=1.0, tolerance=0)
    with pytest.raises(ValueError, match="room for three runs, most >= 4 steps = 200, got most=100"):
        choose_steps(swing(), [1.0], end("bar"), t_end=1.0, steps=50, most=100)
