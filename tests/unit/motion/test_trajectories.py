"""Runs of the engine as datasets and frames."""

import numpy as np
import pytest

from workbench.engine import (
    Airbag,
    Body,
    Member,
    Motion,
    RevoluteJoint,
    Spring,
    System,
    member_histories,
    simulate,
)
from workbench.errors import StudyError
from workbench.motion.frames import Body as SceneBody
from workbench.motion.frames import Motion as Scene
from workbench.motion.trajectories import Drawn, dataset, frames


@pytest.fixture(scope="module")
def run():
    bar = Body(name="bar", mass=1.0, inertia=0.1, position=(0.5, 0.0, 0.0))
    cart = Body(name="cart", motion=Motion(position=lambda t: (0.0, 0.2 * t**2, 0.0)))
    system = System(
        bodies=(bar, cart),
        joints=(RevoluteJoint(a="bar", b="cart", point_a=(-0.5, 0.0)),),
        members=(
            Member(a="bar", b="cart", point_a=(0.5, 0.0), point_b=(0.5, -1.0), law=Spring(k=20.0)),
            Member(a="bar", b="ground", point_a=(0.5, 0.1), point_b=(1.0, 0.5), law=Airbag()),
        ),
    )
    return simulate(system, [1.0, 1e-4], 0.5, 200)


def test_the_dataset_names_what_the_arrays_hold(run):
    ds = dataset(run)
    assert ds.sizes == {"time": 201, "body": 1, "axis": 3, "row": 2}
    np.testing.assert_array_equal(ds.velocity.sel(body="bar", axis="angle"), run.velocity[:, 2])
    assert ds.time.attrs["units"] == "s"
    assert ds.mechanical_energy.attrs["units"] == "J"
    assert float(np.abs(ds.joint_residual).max()) < 1e-10


def test_frames_keep_what_the_members_pull(run):
    _, scene = frames(run, count=11, thinnest=1e-3)
    assert [member.name for member in scene.members] == ["M0"]
    assert scene.forces == pytest.approx(member_histories(run, [0]).force[::20])
    shape = Drawn(shape=SceneBody(name="rod", shape="capsule", size=(0.1, 0.5)), on="bar")
    with pytest.raises(StudyError, match="takes drawn for spatial trees alone; give a planar run its boxes"):
        frames(run, drawn=[shape])


def test_frames_put_the_members_where_the_engine_has_them(run):
    times, scene = frames(run, label="swing", count=11, roles={"cart": "vehicle"})
    assert times == pytest.approx(np.linspace(0, 0.5, 11))
    assert [m.name for m in scene.members] == ["M0"]  # the other is thinner than is drawn
    motion = Scene(title="swing", times=times, runs=(scene,))
    assert Scene.from_dict(motion.to_dict()).runs[0].bodies == scene.bodies
    x, y, angle = run.of("bar")[-1]
    end = (x + 0.5 * np.cos(angle), y + 0.5 * np.sin(angle))
    a, b = scene.segments(10)[0]
    assert (a[0], a[2]) == pytest.approx(end)
    assert (b[0], b[2]) == pytest.approx((0.5, 0.05 - 1.0))
    assert scene.bodies[1].role == "vehicle"


def test_frames_refuse_what_they_cannot_draw(run):
    with pytest.raises(StudyError, match="frames needs count >= 2, got 1"):
        frames(run, count=1)
    with pytest.raises(StudyError, match="roles name 'sledge'; bodies of the run are bar, cart"):
        frames(run, roles={"sledge": "seat"})
