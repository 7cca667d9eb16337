"""A plane motion in both engines: absolute coordinates with joints, and joint coordinates."""

import numpy as np
import pytest

from workbench.engine import (
    Body,
    Coordinate,
    CoordinateSpring,
    JointSpring,
    Member,
    Planar,
    Revolute,
    RevoluteJoint,
    RungeKutta8,
    SpatialBody,
    SpatialMember,
    Spring,
    System,
    Terminal,
    TreeSystem,
    gradient,
    simulate,
)

SAME = 1e-10
DENSITY = (0.5, 0.8, 1.0)
POINTS = (((0.1, 0.05), (0.6, 0.4)), ((-0.2, 0.1), (-0.5, 0.7)), ((0.0, -0.1), (0.3, -0.6)))


def planar():
    """A free body with a hinged arm (hinge at 0.3 on the body, 0.2 from the arm's centre) and three
    springs."""
    body = Body(name="body", mass=3.0, inertia=0.2, position=(0.1, 0.2, 0.0), velocity=(0.5, 0, 1.0))
    arm = Body(name="arm", mass=1.0, inertia=0.03, position=(0.6, 0.2, 0.0), velocity=(0.5, 0.7, 2.0))
    return System(
        bodies=(body, arm),
        joints=(RevoluteJoint(a="body", b="arm", point_a=(0.3, 0.0), point_b=(-0.2, 0.0)),),
        springs=(JointSpring(a="arm", b="body", k=4.0, c=0.1),),
        members=tuple(
            Member(a=name, b="ground", point_a=a, point_b=b, law=Spring(k=50.0, c=1.0), natural_length=0.4)
            for name, (a, b) in zip(("body", "arm", "arm"), POINTS, strict=True)
        ),
    )  # fmt: skip


def tree():
    """The same in the plane y, z of a spatial tree: x -> y, y -> z, turns about x."""
    axes = ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    body = SpatialBody(
        name="body", joint=Planar(axes=axes, position=(0.1, 0.2), velocity=(0.5, 0.0), angular_speed=1.0),
        mass=3.0, inertia=(0.2, 0.1, 0.1),
    )  # fmt: skip
    arm = SpatialBody(
        name="arm", parent="body", joint=Revolute(axis=(1.0, 0.0, 0.0), speed=1.0), at=(0.0, 0.3, 0.0),
        mass=1.0, centre=(0.0, 0.2, 0.0), inertia=(0.03, 0.1, 0.1),
    )  # fmt: skip
    shift = {"body": 0.0, "arm": 0.2}
    return TreeSystem(
        bodies=(arm, body), springs=(CoordinateSpring(body="arm", k=4.0, c=0.1),),
        gravity=(0.0, 0.0, -9.8),
        members=tuple(
            SpatialMember(
                a=name, point_a=(0.0, a[0] + shift[name], a[1]), point_b=(0.0, *b), law=Spring(k=50.0, c=1.0),
                natural_length=0.4,
            )
            for name, (a, b) in zip(("body", "arm", "arm"), POINTS, strict=True)
        ),
    )  # fmt: skip


@pytest.mark.slow
def test_both_engines_move_alike_and_have_the_same_gradient():
    run_p = simulate(planar(), DENSITY, t_end=0.5, steps=100, scheme=RungeKutta8())
    system = tree()
    run_t = simulate(system, DENSITY, t_end=0.5, steps=100, scheme=RungeKutta8())
    for name, centre in (("body", (0.0, 0.0, 0.0)), ("arm", (0.0, 0.2, 0.0))):
        assert run_t.of(name, centre)[:, 1:] == pytest.approx(run_p.of(name)[:, :2], abs=SAME)
    g_p = gradient(
        run_p.system, DENSITY, run_p, Terminal(quantity=Coordinate(bodies=("arm",), direction=(0.3, 0.8)))
    )
    g_t = gradient(
        system, DENSITY, run_t, Terminal(quantity=Coordinate(bodies=("arm",), direction=(0.0, 0.3, 0.8)))
    )
    assert g_t == pytest.approx(g_p, abs=SAME)
    assert np.abs(g_p).max() > 1e-3
