"""What runs of trees refuse, in words, beyond their systems."""

import numpy as np
import pytest

from tests.sample_trees import tree_run
from workbench.engine.errors import NotConverged, NotSupported
from workbench.engine.integration.schemes import RungeKutta8
from workbench.engine.tree.compiled import tree_compiled
from workbench.engine.tree.elements import CoordinateSpring
from workbench.engine.tree.joints import Revolute, Welded
from workbench.engine.tree.surfaces import Box, SpatialContact
from workbench.engine.tree.system import SpatialBody, TreeSystem

ARM = SpatialBody(name="arm", joint=Revolute(), mass=1.0, inertia=(0.1, 0.1, 0.1))
NONE = np.zeros(0)


def test_order_8_says_why_it_stopped():
    stiff = TreeSystem(bodies=(ARM,), springs=(CoordinateSpring(body="arm", k=1e9, torque=1.0),))
    with pytest.raises(NotConverged, match="the state left all bounds: the steps are too long"):
        tree_run(stiff, NONE, np.linspace(0.0, 10.0, 101), RungeKutta8())
    empty = SpatialBody(name="empty", parent="arm", joint=Revolute())
    with pytest.raises(NotConverged, match="a joint moves nothing that has mass"):
        tree_run(TreeSystem(bodies=(ARM, empty)), NONE, np.linspace(0.0, 1.0, 11), RungeKutta8())


def test_forward_methods_are_left_to_planar_systems():
    run = tree_run(TreeSystem(bodies=(ARM,)), NONE, np.linspace(0.0, 0.1, 3))
    with pytest.raises(NotSupported, match="direct is written for planar systems"):
        run.linearised(method="direct")
    with pytest.raises(NotSupported, match="forward sensitivities are written for planar systems"):
        run.state_sensitivities(with_rates=True)
    assert not run.goes_forward


def test_a_box_on_a_turned_welded_body_is_refused():
    turned = SpatialBody(name="turned", parent="arm", joint=Welded(), axes=np.diag([1.0, -1.0, -1.0]))
    shape = Box(half=(1, 1, 1), rounding=0.1)
    other = SpatialBody(name="other", joint=Revolute(), mass=1.0, inertia=(0.1, 0.1, 0.1))
    contact = SpatialContact(a="other", b="turned", shape=shape, k=1.0)
    with pytest.raises(ValueError, match="a box cannot lie on a body that is welded on at an angle"):
        tree_compiled(TreeSystem(bodies=(ARM, turned, other), contacts=(contact,)))
