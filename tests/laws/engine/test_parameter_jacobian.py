"""Slopes of several objectives at once are those of each alone, in every kind of system."""

from dataclasses import replace

import numpy as np
import pytest

from tests.laws.engine.test_natural_slopes import brick_on_a_rod
from tests.laws.engine.test_parameter_slopes import sprung_bodies
from workbench.engine import (
    AtTime,
    Coordinate,
    Deviation,
    Maximum,
    PointCoordinate,
    Prismatic,
    SpatialBody,
    SpatialMember,
    Spring,
    Terminal,
    TreeSystem,
    parameter_jacobian,
    parameter_slopes,
    simulate,
)
from workbench.engine.tree import gradients

SAME = 1e-12  # one backward sweep for all, or one for each: the same sums


def hung(stiff=60.0, height=1.0, mass=2.0):
    """A ball on a spring, carrying a second one: a tree that swings about its start."""
    up = (0.0, 0.0, 1.0)
    balls = (
        SpatialBody(name="ball", joint=Prismatic(axis=up, position=height), mass=mass),
        SpatialBody(name="rider", parent="ball", joint=Prismatic(axis=up, position=0.3, speed=0.4), mass=0.7),
    )
    springs = (
        SpatialMember(a="ball", b="ground", law=Spring(k=stiff, c=0.4), natural_length=0.8),
        SpatialMember(a="rider", b="ball", law=Spring(k=35.0, c=0.2), natural_length=0.25),
    )
    return TreeSystem(bodies=balls, members=springs, gravity=(0.0, 0.0, -9.81))


def the_tree():
    run = simulate(hung(), np.ones(2), t_end=0.6, steps=60)
    ball = Coordinate(bodies=("ball",), direction=(0.0, 0.0, 1.0))
    rider = Coordinate(bodies=("rider",), direction=(0.0, 0.0, 1.0))
    started = Maximum(quantity=Deviation(bodies=("rider",), reference="ball", weights=(1.0, 1.0, 1.0)))
    at = AtTime(quantity=ball, time=0.2)
    return run, (at, Terminal(quantity=ball), Maximum(quantity=rider), started), {
        "stiff": (60.0, lambda x: hung(stiff=x)), "height": (1.0, lambda x: hung(height=x)),
        "mass": (2.0, lambda x: hung(mass=x)),
    }  # fmt: skip


def the_plane():
    made = sprung_bodies(3, joints=True)
    first = Coordinate(bodies=("0",), direction=(1.0, 0.3))
    last = Coordinate(bodies=("2",), direction=(0.2, 1.0))
    run = simulate(made, np.ones(8), t_end=0.2, steps=40)

    def pushed(x):
        return replace(made, loads=(replace(made.loads[0], force=(x, 2.0)),))

    return (
        run, (Maximum(quantity=first), Terminal(quantity=last), AtTime(quantity=first, time=0.1)),
        {"push": (1.0, pushed)},
    )  # fmt: skip


def the_brick():
    run = simulate(brick_on_a_rod(np.random.default_rng(1)), np.array([0.8, 0.6]), t_end=0.1, steps=20)
    first, last = (PointCoordinate(point=name, direction=(1.0, 0.4, -0.7)) for name in "BC")
    return run, (AtTime(quantity=first, time=0.05), Terminal(quantity=last)), {
        "rod": (1.0, lambda x: brick_on_a_rod(np.random.default_rng(1), rod=x)),
        "stiff": (80.0, lambda x: brick_on_a_rod(np.random.default_rng(1), stiff=x)),
    }  # fmt: skip


@pytest.mark.parametrize("case", [the_tree, the_plane, the_brick])
def test_several_objectives_have_the_slopes_of_each(case):
    run, objectives, parameters = case()
    found = parameter_jacobian(run, objectives, parameters)
    assert set(found) == set(parameters)
    for i, objective in enumerate(objectives):
        alone = parameter_slopes(run, objective, parameters)
        assert {name: slopes[i] for name, slopes in found.items()} == pytest.approx(alone, rel=SAME, abs=SAME)
    assert all(len(set(slopes)) == len(objectives) for slopes in found.values())  # no row is another's


def test_sweeps_of_few_rows_are_those_of_all(monkeypatch):
    run, objectives, parameters = the_tree()
    whole = parameter_jacobian(run, objectives, parameters)
    monkeypatch.setattr(gradients, "ROWS", 1.0)  # one row at a time
    for name, slopes in parameter_jacobian(run, objectives, parameters).items():
        np.testing.assert_allclose(slopes, whole[name], rtol=SAME, atol=SAME)


def test_no_objectives_have_no_slopes():
    run, _, parameters = the_tree()
    assert {name: list(x) for name, x in parameter_jacobian(run, (), parameters).items()} == {
        "stiff": [], "height": [], "mass": [],
    }  # fmt: skip


def test_a_deviation_in_space_needs_three_weights():
    flat = Maximum(quantity=Deviation(bodies=("rider",), reference="ball"))
    run, _, parameters = the_tree()
    with pytest.raises(ValueError, match=r"a weight for each of 3 axes, got weights=\(1\.0, 1\.0\)"):
        parameter_slopes(run, flat, parameters)
