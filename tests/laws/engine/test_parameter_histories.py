"""Slopes of histories by parameters equal differences of runs, in every kind of system."""

import numpy as np
import pytest

from workbench.engine import (
    AtTime,
    Body,
    Coordinate,
    Floating,
    Member,
    NaturalPoint,
    NaturalSystem,
    PointCoordinate,
    PointMember,
    SpatialBody,
    SpatialMember,
    Spring,
    System,
    TreeSystem,
    parameter_histories,
    simulate,
)

ANCHOR = (0.9, 0.2, 0.1)


def planar(k):
    mass = Body(name="m", mass=2.0, inertia=0.1, velocity=(0.5, 0.4, 1.0))
    member = Member(a="m", b="ground", point_a=(0.1, 0.0), point_b=ANCHOR[:2], law=Spring(k=k, c=2.0))
    return System(bodies=(mass,), members=(member,))


def tree(k):
    mass = SpatialBody(
        name="m", joint=Floating(velocity=(0.5, 0.4, 0.1)), mass=2.0, inertia=(0.1, 0.1, 0.1)
    )  # fmt: skip
    member = SpatialMember(a="m", point_a=(0.1, 0.0, 0.0), point_b=ANCHOR, law=Spring(k=k, c=2.0))
    return TreeSystem(bodies=(mass,), members=(member,))


def natural(k):
    points = (
        NaturalPoint(name="m", position=(0.0, 0.0, 0.0), mass=2.0, velocity=(0.5, 0.4, 0.1)),
        NaturalPoint(name="p", position=ANCHOR, fixed=True),
    )
    return NaturalSystem(points=points, members=(PointMember(a="m", b="p", law=Spring(k=k, c=2.0)),))


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_slopes_over_time_are_those_of_runs(system):
    size = 2 if system is planar else 3
    quantity = (
        PointCoordinate(point="m", direction=(1.0, 0.3, 0.2))
        if system is natural
        else Coordinate(bodies=("m",), direction=(1.0, 0.3, 0.2)[:size])
    )
    run = simulate(system(300.0), [0.8], 0.5, 200)
    times, slopes = parameter_histories(run, quantity, {"k": (300.0, system)})
    up, down = (simulate(system(300.0 + h), [0.8], 0.5, 200) for h in (0.01, -0.01))
    exact = [
        (AtTime(quantity=quantity, time=t).value(up) - AtTime(quantity=quantity, time=t).value(down)) / 0.02
        for t in times
    ]
    assert len(times) == 51
    np.testing.assert_allclose(slopes["k"], exact, rtol=0, atol=1e-7 * np.abs(exact).max())


def test_times_of_ones_own_lie_in_the_run():
    run, quantity = simulate(planar(300.0), [0.8], 0.1, 20), Coordinate(bodies=("m",), direction=(1.0, 0.0))
    times, slopes = parameter_histories(run, quantity, {"k": (300.0, planar)}, times=[0.0, 0.0512])
    assert times.tolist() == [0.0, 0.0512]
    assert slopes["k"][0] == 0.0
    with pytest.raises(ValueError, match=r"time needs to lie in the run, 0 to 0.1 s, got 0\.2"):
        parameter_histories(run, quantity, {"k": (300.0, planar)}, times=[0.2])
