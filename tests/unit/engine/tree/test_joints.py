"""Motions over time that joints follow."""

import numpy as np

from workbench.engine.tree.joints import SpatialMotion, sampled


def test_a_motion_that_joints_share_is_asked_once_a_time():
    asked = []

    def place(t):
        asked.append(t)
        return (t, 2.0 * t, 0.0)

    still = (0.0, 0.0, 0.0)
    shared = SpatialMotion(position=place, velocity=lambda t: still, acceleration=lambda t: still)
    other = SpatialMotion(position=lambda t: (0.0, 0.0, 5.0), velocity=lambda t: still)
    found = sampled((shared, other, shared), np.array([0.0, 1.0, 3.0]))
    assert found.shape == (3, 3, 24)
    assert asked == [0.0, 1.0, 3.0]
    np.testing.assert_array_equal(found[2, :, 9:12], [[3.0, 6.0, 0.0], [0.0, 0.0, 5.0], [3.0, 6.0, 0.0]])
    assert sampled((), np.array([0.0, 1.0])).shape == (2, 0, 24)
