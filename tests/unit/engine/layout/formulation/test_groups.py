"""Groups: twins, mirror images, unions, and problems with one variable for each group."""

from dataclasses import replace

import numpy as np
import pytest

from studies.whole_members import random_problem
from workbench.engine.layout.formulation.groups import mirrored, tied, twins, united
from workbench.engine.layout.formulation.problem import InvalidLayout, MemberGeometry, static_problem
from workbench.engine.layout.optimise import optimise_layout

GROUPS = [[0, 3], [1, 5, 2]]


def test_tied_members_have_one_density_and_the_gradient_of_their_sum():
    problem, _ = random_problem(4, most=3000)
    both = tied(problem, GROUPS)
    x = np.random.default_rng(0).uniform(0.2, 0.8, both.problem.members)
    whole = both.design(x)
    assert whole[0] == whole[3]
    assert whole[1] == whole[2] == whole[5]
    one, other = both.problem.evaluate(x), problem.evaluate(whole)
    assert np.array_equal(one.values, other.values)
    row = np.array([int(one.values.argmax())])
    slope = one.gradients(row)[0]
    step = 1e-5
    for k in range(both.problem.members):
        e = step * np.eye(both.problem.members)[k]
        up, down = (both.problem.evaluate(x + s * e).values.ravel()[row[0]] for s in (1, -1))
        assert (up - down) / (2 * step) == pytest.approx(slope[k], rel=2e-5, abs=1e-6 * np.abs(slope).max())
    moved = 1e-3 * np.random.default_rng(1).normal(size=len(x))
    assert np.array_equal(one.model(moved), other.model(both.design(moved)))


def test_a_tied_layout_is_the_best_of_those_whose_members_agree():
    w = np.array([1.0, 4.0, 9.0, 2.0])
    problem = static_problem(
        lambda a: (float((w / a).sum()), -w / a**2), start=np.full(4, 0.2), lower=0.01,
        budgets=[(np.array([1.0, 2.0, 1.0, 1.0]), 1.0)],
    )  # fmt: skip
    both = tied(problem, [[0, 1]])
    found = optimise_layout(both.problem, tolerance=1e-9)
    # minimise sum W/x under sum c x <= 1: x proportional to sqrt(W/c)
    W, c = np.array([5.0, 9.0, 2.0]), np.array([3.0, 1.0, 1.0])
    assert found.value == pytest.approx(float(np.sqrt(W * c).sum() ** 2), rel=1e-6)
    free = optimise_layout(problem, tolerance=1e-9)
    assert free.value < found.value
    assert problem.costs @ both.design(found.density) == pytest.approx(1.0)


def test_bounds_of_a_group_are_the_tightest():
    problem = static_problem(
        lambda a: (float(a @ a), 2 * a), start=np.full(3, 0.5), lower=[0.1, 0.3, 0.0], upper=[0.9, 0.7, 0.2]
    )
    both = tied(replace(problem, start=np.array([0.9, 0.7, 0.2])), [[0, 1]])
    assert both.problem.lower.tolist() == [0.3, 0.0]
    assert both.problem.upper.tolist() == [0.7, 0.2]
    with pytest.raises(InvalidLayout, match="their bounds do not meet"):
        tied(problem, [[1, 2]])
    with pytest.raises(InvalidLayout, match="each in one group; got 1"):
        tied(problem, [[0, 1], [1, 2]])
    with pytest.raises(InvalidLayout, match="from 0 to 2"):
        tied(problem, [[0, 3]])


def test_mirror_images_are_found_through_left_and_right_bodies():
    # body 0 in the plane, 1 and 2 left and right arms; a member in the plane is its own image
    a = np.array([[0.0, 0.2], [0.0, -0.2], [0.1, 0.0], [0.5, 0.3], [0.5, -0.3], [0.5, -0.3]])
    b = np.array([[1.0, 0.5], [1.0, -0.5], [1.0, 0.0], [2.0, 0.4], [2.0, -0.4], [2.0, -0.4]])
    one = MemberGeometry(
        body_a=np.array([0, 0, 0, 1, 2, 2]), point_a=a, body_b=np.full(6, 9), point_b=b,
        kind=("belt",) * 5 + ("airbag",),
    )  # fmt: skip
    assert mirrored(one, axis=1) == [[0, 1]]
    assert mirrored(one, axis=1, bodies=[(1, 2)]) == [[0, 1], [3, 4]]
    up = np.array([0.0, 3.0])
    shifted = replace(one, point_a=a + up, point_b=b + up)
    assert mirrored(shifted, axis=1, at=3.0, bodies=[(1, 2)]) == [[0, 1], [3, 4]]
    assert mirrored(shifted, axis=1, bodies=[(1, 2)]) == []
    with pytest.raises(InvalidLayout, match="axis from 0 to 1"):
        mirrored(one, axis=2)
    assert united(mirrored(one, axis=1), twins(one), [[2, 0]]) == [[0, 1, 2]]
