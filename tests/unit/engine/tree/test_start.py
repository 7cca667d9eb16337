"""Where bodies stand at the start, in numpy, is where the kernels put them."""

import numpy as np
import pytest

from tests.sample_trees import random_bodies, tree_run
from workbench.engine.elements.spring import Spring
from workbench.engine.tree.elements import SpatialMember
from workbench.engine.tree.joints import Floating
from workbench.engine.tree.start import start_frames
from workbench.engine.tree.system import SpatialBody, TreeSystem


@pytest.mark.parametrize("seed", range(7))
def test_start_frames_of_any_joint(seed):
    bodies = random_bodies(12, np.random.default_rng(seed), first=seed)
    run = tree_run(TreeSystem(bodies=bodies), np.zeros(0), [0.0, 1e-6])
    for name, (axes, origin) in start_frames(bodies).items():
        if name != "ground":
            np.testing.assert_allclose(run.frames(name).axes[0], axes, atol=1e-12)
            np.testing.assert_allclose(run.frames(name).origin[0], origin, atol=1e-11)


def test_a_member_of_a_turned_body_begins_without_force():
    quarter = (np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5))  # about z
    body = SpatialBody(
        name="bar", joint=Floating(orientation=quarter), mass=1.0, inertia=(0.1, 0.1, 0.1)
    )  # fmt: skip
    spring = SpatialMember(a="bar", point_a=(1.0, 0.0, 0.0), point_b=(0.0, 3.0, 0.0), law=Spring(k=100.0))
    system = TreeSystem(bodies=(body,), members=(spring,), gravity=(0.0, 0.0, 0.0))
    # the point stands at (0, 1, 0)
    assert system.member_ends().point_a[0] == pytest.approx([0.0, 1.0, 0.0])
    run = tree_run(system, np.ones(1), np.linspace(0.0, 0.1, 11))
    assert np.abs(run.velocity).max() < 1e-9
