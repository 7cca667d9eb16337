"""Slopes by any parameter: closed forms, and what is refused."""

from dataclasses import replace

import numpy as np
import pytest

from workbench.engine import (
    Body,
    Coordinate,
    Member,
    Prismatic,
    Revolute,
    SpatialBody,
    Spring,
    System,
    Terminal,
    TreeSystem,
    Tyre,
    parameter_slopes,
    simulate,
)

UP = Terminal(quantity=Coordinate(bodies=("ball",), direction=(0.0, 0.0, 1.0)))
ROUNDING = 1e-11


def falling(height=2.0, speed=0.0, g=9.81, at=0.0):
    joint = Prismatic(axis=(0.0, 0.0, 1.0), position=height, speed=speed)
    ball = SpatialBody(name="ball", joint=joint, mass=1.0, at=(0.0, 0.0, at))
    return TreeSystem(bodies=(ball,), gravity=(0.0, 0.0, -g))


def test_a_falling_ball_has_the_slopes_of_its_closed_form():
    """z = z0 + at + v0 t - g t^2/2: the scheme is exact for it."""
    run = simulate(falling(), [], t_end=0.1, steps=10)
    found = parameter_slopes(
        run,
        UP,
        {
            "height": (2.0, falling),
            "speed": (0.0, lambda x: falling(speed=x)),
            "g": (9.81, lambda x: falling(g=x)),
            "at": (0.0, lambda x: falling(at=x)),
        },
    )
    expected = {"height": 1.0, "speed": 0.1, "g": -0.005, "at": 1.0}
    assert found == pytest.approx(expected, abs=ROUNDING)


def test_systems_of_another_structure_or_kind_are_refused():
    run = simulate(falling(), [], t_end=0.1, steps=10)

    def other(x):
        return replace(falling(), bodies=(SpatialBody(name="ball", joint=Revolute(angle=x), mass=1.0),))

    with pytest.raises(ValueError, match="parameter_slopes needs systems of the same bodies, joints"):
        parameter_slopes(run, UP, {"angle": (0.3, other)})
    plane = System(
        bodies=(Body(name="ball", mass=1.0, inertia=1.0),),
        members=(Member(a="ball", b="ground", point_b=(-1.0, 0.0), law=Spring(k=10.0)),),
    )
    with pytest.raises(ValueError, match="parameter 'plane' needs a function that gives a TreeSystem"):
        parameter_slopes(run, UP, {"plane": (0.0, lambda x: plane)})


def test_the_slip_of_a_tyres_largest_force_follows_its_coefficients_smoothly():
    lateral = (1.5, -4.8, 810.0, 2600.0, 49.0, 0.0, -0.009, 0.38)
    along = (1.5, -16.0, 1020.0, -2.5, 209.0, 0.007, -0.004, 0.16, -1.15)

    def peak(a3):
        return Tyre(
            body="wheel", radius=0.3, stiffness=2e5, damping=10.0, nominal_load=7000.0, longitudinal=along,
            lateral=(*lateral[:3], a3, *lateral[4:]),
        ).peak(lateral=True)  # fmt: skip

    slips = np.array([peak(2600.0 * (1.0 + e)) for e in 1e-6 * np.arange(-3, 4)])
    assert np.abs(np.diff(slips, 3)).max() < 1e-13 * slips[0]
    assert slips[0] > slips[-1]
