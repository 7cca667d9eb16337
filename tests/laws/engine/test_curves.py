"""A law given by points, in every kind of system: straight it is a spring, bent its gradients hold."""

import numpy as np
import pytest

from tests.sample_masses import check_gradients_by_densities, farthest, natural, planar, run_of, tree
from workbench.engine import Curve, Spring, parameter_gradient

SPRING = Spring(k=300.0, c=2.0)
STRAIGHT = Curve(points=((-0.3, -90.0), (0.2, 60.0)), c=2.0)
BENT = Curve(points=((-0.2, -80.0), (-0.05, -10.0), (0.0, 0.0), (0.1, 5.0), (0.2, 60.0)), c=2.0, width=0.03)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_a_straight_curve_is_a_spring(system):
    one, two = run_of(system, STRAIGHT), run_of(system, SPRING)
    np.testing.assert_allclose(one.position, two.position, rtol=0, atol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree, natural])
def test_gradients_hold_across_its_kinks(system):
    check_gradients_by_densities(system, BENT)


@pytest.mark.slow
@pytest.mark.parametrize("system", [planar, tree])
def test_slopes_by_its_scale_hold(system):
    objective, step = farthest(system), 1e-5
    by_scale = parameter_gradient(run_of(system, BENT), objective).law[0]  # `scale`: the whole curve
    larger, smaller = (
        objective.value(
            run_of(system, Curve(points=BENT.points, c=BENT.c, width=BENT.width, scale=1.0 + sign * step))
        )
        for sign in (1, -1)
    )
    assert by_scale.sum() == pytest.approx((larger - smaller) / (2 * step), rel=1e-6, abs=1e-8)
