"""Motions over time that joints follow."""

import numpy as np

from workbench.engine import TreeSystem
from workbench.engine.elements.samples_kept import GRIDS
from workbench.engine.tree.compiled import tree_compiled, tree_on_grid
from workbench.engine.tree.joints import Prescribed, Revolute, SpatialMotion, sampled
from workbench.engine.tree.system import SpatialBody


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
    again = sampled((other, shared), np.array([0.0, 1.0, 3.0]))  # in another system
    assert asked == [0.0, 1.0, 3.0]
    np.testing.assert_array_equal(again[:, 1], found[:, 0])
    assert sampled((), np.array([0.0, 1.0])).shape == (2, 0, 24)


def test_a_system_is_asked_once_for_a_grid_whatever_its_densities():
    """Steps that are halved alternate with those asked for; the grids of a few runs are kept, not all."""
    asked = []

    def place(t):
        asked.append(t)
        return (np.sin(t), 0.0, 0.0)

    still = (0.0, 0.0, 0.0)
    motion = SpatialMotion(position=place, velocity=lambda t: still, acceleration=lambda t: still)
    table = SpatialBody(name="table", joint=Prescribed(motion=motion))
    rider = SpatialBody(name="rider", parent="table", joint=Revolute(), mass=1.0, inertia=(1, 1, 1))
    system = TreeSystem(bodies=(table, rider))
    parts = tree_compiled(system)
    asked.clear()
    grids = [np.linspace(0.0, 1.0, count) for count in range(3, 3 + GRIDS)]
    first = [tree_on_grid(parts, np.zeros(0), times).motion for times in grids]
    assert len(asked) == sum(len(times) for times in grids)
    again = [tree_on_grid(parts, np.zeros(0), times.copy()).motion for times in grids]
    assert len(asked) == sum(len(times) for times in grids)
    for times, one, two in zip(grids, first, again, strict=True):
        np.testing.assert_array_equal(one, two)
        np.testing.assert_array_equal(one, sampled([motion], times))
    tree_on_grid(parts, np.zeros(0), np.linspace(0.0, 2.0, 9))
    assert len(parts.samples) == GRIDS
    asked.clear()
    tree_on_grid(parts, np.zeros(0), grids[0])  # the oldest went
    assert len(asked) == len(grids[0])
