"""Runs of trees as datasets and as frames of the viewer."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_trees import one_set_of_kernels, random_tree
from workbench.engine import (
    Floating,
    Revolute,
    SpatialBody,
    SpatialMember,
    Spring,
    TreeSystem,
    member_histories,
    simulate,
)
from workbench.errors import StudyError
from workbench.motion.frames import Body, Motion, rotate
from workbench.motion.stills import camera_of, still
from workbench.motion.trajectories import Drawn, dataset, frames

__all__ = ["one_set_of_kernels"]

ROUNDING = 1e-12


@pytest.fixture
def run():
    system = random_tree(np.random.default_rng(3), count=5)
    return simulate(system, np.full(12, 0.5), t_end=0.2, steps=20)


def test_a_dataset_holds_the_motion_by_names(run):
    ds = dataset(run)
    for body in ("b1", "b4"):
        f = run.frames(body)
        own = ds.sel(body=body)
        np.testing.assert_array_equal(own.position, f.origin)
        np.testing.assert_array_equal(own.acceleration, f.acceleration)
        assert own.velocity.attrs["units"] == "m/s"
        for node in (0, 13):
            x = np.array([0.3, -0.2, 0.7])
            turned = rotate(own.orientation.values[node], x)
            assert turned == pytest.approx(f.axes[node] @ x, abs=ROUNDING)
    name = next(body.name for body in run.system.bodies if isinstance(body.joint, Revolute | Floating))
    first = run.coordinate(name).start
    np.testing.assert_array_equal(ds.joint_position.sel(coordinate=f"{name} 0"), run.position[:, first])
    assert ds.joint_velocity.shape == (21, run.size)
    assert list(ds.state.coords["state"].values) == list(run.state_names)
    assert ds.kinetic_energy.values == pytest.approx(run.kinetic_energy())


def test_frames_hold_bodies_and_members_where_they_are(run):
    times, motion = frames(run, count=6, roles={"b1": "occupant"}, label="hands on")
    assert times.tolist() == run.times[::4].tolist()
    assert [body.role for body in motion.bodies] == ["other", "occupant", "other", "other", "other"]
    for k, node in enumerate(range(0, 21, 4)):
        ends = motion.segments(k)
        for i, member in enumerate(run.system.members):
            assert ends[i, 0] == pytest.approx(run.of(member.a, member.point_a)[node], abs=1e-9)
            assert ends[i, 1] == pytest.approx(run.of(member.b, member.point_b)[node], abs=1e-9)
    turned = (motion.poses[1:, :, 3:] * motion.poses[:-1, :, 3:]).sum(axis=2)
    assert turned.min() > 0.0


def test_a_tree_is_drawn(run):
    times, motion = frames(run, count=5)
    whole = Motion(title="tree", times=times, runs=(motion,))
    assert Motion.from_dict(whole.to_dict()).runs[0].poses.shape == (5, 5, 7)
    picture = still(whole, run=0, time=float(times[2]), camera=camera_of(whole, "corner"))
    assert len(np.unique(picture.reshape(-1, picture.shape[-1]), axis=0)) > 10


def test_thin_members_and_strangers_are_left_out():
    body = SpatialBody(name="arm", joint=Revolute(axis=(0, 1, 0)), mass=1.0, centre=(0.4, 0.0, 0.0))
    member = SpatialMember(a="arm", point_a=(0.5, 0.0, 0.0), point_b=(0.5, 0.0, 1.0), law=Spring(k=10.0))
    system = TreeSystem(bodies=(body,), members=(member, replace(member, name="second")))
    run = simulate(system, [0.0, 1.0], t_end=0.1, steps=5)
    _, motion = frames(run, count=2)
    assert [m.name for m in motion.members] == ["second"]
    assert motion.bodies[0].size == (0.5, 0.04, 0.04)
    assert motion.poses[0, 0, :3] == pytest.approx((0.25, 0.0, 0.0))
    with pytest.raises(StudyError, match="roles name 'leg'; bodies of the run are arm"):
        frames(run, roles={"leg": "occupant"})


def test_shapes_are_drawn_where_they_are_tied(run):
    shaped = Body(name="shin", shape="capsule", size=(0.05, 0.3), role="occupant")
    turn = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
    everywhere = [Drawn(shape=replace(shaped, name=body.name), on=body.name) for body in run.system.bodies]
    second = Drawn(shape=shaped, on="b2", at=(0.1, -0.2, 0.3), turn=turn)
    _, motion = frames(run, count=6, drawn=[second, *everywhere])
    assert motion.poses.shape == (6, 6, 7)
    assert motion.poses[:, 0, :3] == pytest.approx(run.of("b2", np.array(second.at))[::4], abs=1e-9)
    axes = run.frames("b2").axes[::4]
    for k in range(6):
        along = rotate(motion.poses[k, 0, 3:], [0.0, 0.0, 1.0])
        assert along == pytest.approx(axes[k] @ rotate(np.array(turn), [0.0, 0.0, 1.0]), abs=1e-9)
        for i, member in enumerate(run.system.members):  # of the first shape on a body
            assert motion.segments(k)[i, 0] == pytest.approx(
                run.of(member.a, member.point_a)[4 * k], abs=1e-9
            )
    assert motion.forces == pytest.approx(member_histories(run).force[::4])


def test_shapes_that_fit_no_body_are_refused(run):
    shape = Body(name="shin", shape="capsule", size=(0.05, 0.3))
    with pytest.raises(StudyError, match="the shape 'shin' is drawn on 'leg'; bodies of the run are b0"):
        frames(run, drawn=[Drawn(shape=shape, on="leg")])
    lone = run.system.members[0].b if run.system.members[0].a == "ground" else run.system.members[0].a
    others = [body.name for body in run.system.bodies if body.name != lone]
    with pytest.raises(StudyError, match=f"members are tied to '{lone}', on which no shape is drawn"):
        frames(run, drawn=[Drawn(shape=shape, on=name) for name in others])
