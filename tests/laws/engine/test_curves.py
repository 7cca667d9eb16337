"""A law given by points, in every kind of system: straight it is a spring, bent its gradients hold."""

import numpy as np
import pytest

from workbench.engine import (
    Body,
    Coordinate,
    Curve,
    Floating,
    Maximum,
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
    gradient,
    parameter_gradient,
    simulate,
)

SPRING = Spring(k=300.0, c=2.0)
STRAIGHT = Curve(points=((-0.3, -90.0), (0.2, 60.0)), c=2.0)
BENT = Curve(points=((-0.2, -80.0), (-0.05, -10.0), (0.0, 0.0), (0.1, 5.0), (0.2, 60.0)), c=2.0, width=0.03)
ANCHORS = ((0.9, 0.2, 0.1), (-0.7, 0.4, -0.2), (0.1, -0.8, 0.5))


def planar(law):
    mass = Body(name="m", mass=2.0, inertia=0.1, velocity=(1.5, 0.4, 0.0))
    members = tuple(Member(a="m", b="ground", point_b=at[:2], law=law) for at in ANCHORS)
    return System(bodies=(mass,), members=members)


def tree(law):
    mass = SpatialBody(
        name="m", joint=Floating(velocity=(1.5, 0.4, -0.3)), mass=2.0, inertia=(0.1, 0.1, 0.1)
    )  # fmt: skip
    members = tuple(SpatialMember(a="m", point_b=at, law=law) for at in ANCHORS)
    return TreeSystem(bodies=(mass,), members=members)


def natural(law):
    points = (
        NaturalPoint(name="m", position=(0.0, 0.0, 0.0), mass=2.0, velocity=(1.5, 0.4, -0.3)),
        *(NaturalPoint(name=f"p{k}", position=at, fixed=True) for k, at in enumerate(ANCHORS)),
    )
    members = tuple(PointMember(a="m", b=f"p{k}", law=law) for k in range(len(ANCHORS)))
    return NaturalSystem(points=points, members=members)


DENSITY = np.array([1.0, 0.6, 0.3])


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_a_straight_curve_is_a_spring(system):
    one, two = (simulate(system(law), DENSITY, 0.6, 300) for law in (STRAIGHT, SPRING))
    np.testing.assert_allclose(one.position, two.position, rtol=0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_gradients_hold_across_its_kinks(system):
    objective = (
        Maximum(quantity=PointCoordinate(point="m", direction=(1.0, 0.0, 0.0)))
        if system is natural
        else Maximum(
            quantity=Coordinate(bodies=("m",), direction=(1.0, 0.0, 0.0)[: 2 if system is planar else 3])
        )
    )
    made = system(BENT)

    def value(density):
        return objective.value(simulate(made, density, 0.6, 300))

    run = simulate(made, DENSITY, 0.6, 300)
    slopes = gradient(made, DENSITY, run, objective)
    step = 1e-5
    for k in range(3):
        away = step * np.eye(3)[k]
        difference = (value(DENSITY + away) - value(DENSITY - away)) / (2 * step)
        assert slopes[k] == pytest.approx(difference, rel=1e-6, abs=1e-8)
    if system is natural:
        return
    by_scale = parameter_gradient(run, objective).law[0]  # `scale`: the whole curve
    larger, smaller = (
        objective.value(simulate(system(Curve(
            points=BENT.points, c=BENT.c, width=BENT.width, scale=1.0 + sign * step
        )), DENSITY, 0.6, 300))
        for sign in (1, -1)
    )  # fmt: skip
    assert by_scale.sum() == pytest.approx((larger - smaller) / (2 * step), rel=1e-6, abs=1e-8)
