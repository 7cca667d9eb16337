"""Slopes of members' and points' quantities are those of the computed values, in the plane and in space."""

import numpy as np
import pytest

from tests.sample_trees import one_set_of_kernels, random_tree, tree_run
from workbench.engine import Belt, Body, Maximum, Member, Minimum, Motion, Spring, System, gradients, simulate
from workbench.engine.integration.schemes import GeneralisedAlpha
from workbench.engine.objectives.injury import PointAcceleration
from workbench.engine.objectives.member_quantities import MemberElongation, MemberForce
from workbench.engine.objectives.point_quantities import PlaneClearance, PointDistance, PointSpeed

__all__ = ["one_set_of_kernels"]

DIFFERENCES = 1e-6  # central differences of fourth order, relative to the largest slope
ROUNDING = 1e-11  # of a value, divided by the step of the differences
STEP = 1e-4


def planar():
    wall = Body(name="wall", motion=Motion(position=lambda t: (0.1 * np.sin(5 * t), 0, 0.2 * np.sin(3 * t))))
    near = Body(name="near", mass=2.0, inertia=0.3, position=(0.5, 0.2, 0.1), velocity=(1.0, -0.5, 2.0))
    far = Body(name="far", mass=1.0, inertia=0.2, position=(-0.5, 0.4, 0.0), velocity=(0.0, 0.5, -1.0))
    belt = Belt(k1=200.0, k2=60.0, knee=0.1, width=0.05, c=2.0)
    members = (
        Member(a="near", b="wall", point_a=(0.1, 0.05), point_b=(-1.0, 0.0), law=Spring(k=100.0, c=2.0)),
        Member(a="near", b="far", point_a=(-0.1, 0.05), point_b=(0.1, 0.0), law=Spring(k=80.0), offset=0.1),
        Member(a="far", b="ground", point_a=(-0.1, 0.05), point_b=(-0.6, 1.0), law=belt, power=2.0),
    )
    return System(bodies=(near, far, wall), members=members)


def quantities(near, far, axes):
    point, normal = (0.1, -0.2, 0.05)[:axes], (0.3, 1.0, 0.5)[:axes]
    return (
        MemberElongation(member=0), MemberElongation(member=1, sense="shorter"), MemberForce(member=0),
        MemberForce(member=2), MemberForce(member=1, sense="compression"), PointSpeed(body=far, point=point),
        PointDistance(a=near, b=far, point_a=point, point_b=point),
        PlaneClearance(body=far, point=point, normal=normal, through=normal),
        PointAcceleration(body=far, point=point),
    )  # fmt: skip


def check(run, density, wanted):
    """Gradients of the highest and the lowest value of each quantity along a run, against differences."""
    objectives = [kind(quantity=quantity) for quantity in wanted for kind in (Maximum, Minimum)]

    def values(alpha):
        return np.array([objective.value(run(alpha)) for objective in objectives])

    trajectory = run(density)
    found = gradients(trajectory.system, density, trajectory, objectives)
    differences = []
    for e in STEP * np.eye(len(density))[:3]:
        near, far = (values(density + k * e) - values(density - k * e) for k in (1, 2))
        differences.append((8 * near - far) / (12 * STEP))
    for objective, slopes, expected in zip(objectives, found, np.transpose(differences), strict=True):
        room = ROUNDING / STEP * abs(objective.value(trajectory))
        np.testing.assert_allclose(
            slopes[:3], expected, rtol=0, atol=DIFFERENCES * np.abs(expected).max() + room,
            err_msg=str(objective),
        )  # fmt: skip


def test_in_the_plane():
    system, scheme = planar(), GeneralisedAlpha(tolerance=1e-14)
    check(
        lambda alpha: simulate(system, alpha, 0.5, 100, scheme=scheme), np.array([0.7, 0.8, 0.6]),
        quantities("near", "far", 2),
    )  # fmt: skip


@pytest.mark.slow
def test_in_space():
    rng = np.random.default_rng(7)
    tree = random_tree(rng)
    density = rng.uniform(0.4, 0.8, len(tree.members))
    times, scheme = np.linspace(0.0, 0.1, 21), GeneralisedAlpha(tolerance=1e-14)
    check(
        lambda alpha: tree_run(tree, alpha, times, scheme), density,
        quantities(tree.bodies[0].name, tree.bodies[-1].name, 3),
    )  # fmt: skip


def test_strangers_are_refused():
    system = planar()
    run = simulate(system, [0.5, 0.5, 0.5], 0.1, 20)
    with pytest.raises(ValueError, match="no free body 'nobody'"):
        PointSpeed(body="nobody").values(run)
    with pytest.raises(ValueError, match="member needs to be one of 0 to 2, got 9"):
        MemberForce(member=9).values(run)
