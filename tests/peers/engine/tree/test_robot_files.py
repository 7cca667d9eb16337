"""Trees written as URDF and MJCF move alike in Pinocchio and MuJoCo; their files are read alike."""

from dataclasses import replace

import numpy as np
import pytest

from tests.sample_robots import HUMANOID, URDF_ARM
from tests.sample_trees import random_bodies
from workbench.engine import (
    Floating,
    Planar,
    Revolute,
    Spherical,
    TreeSystem,
    read_mjcf,
    read_urdf,
    write_mjcf,
    write_urdf,
)
from workbench.engine.tree._kernels.forces import look_linearised
from workbench.engine.tree._kernels.tables import tree_work
from workbench.engine.tree.compiled import tree_compiled, tree_on_grid

pytestmark = pytest.mark.peer

AGREE = 1e-9  # relative to the largest entry; the files hold all digits


def ours(system, q, v):
    """Mass matrix (n, n) and force (n,) of a tree that moves with v and is not accelerated."""
    parts = tree_compiled(system)
    tables = tree_on_grid(parts, np.zeros(0), np.zeros(1))
    work = tree_work(tables, 0)
    look_linearised(tables, work, 0, parts.start[0] if q is None else q, v, np.zeros(parts.size))
    return parts, work.m.copy(), work.force.copy()


def floating_on_ground(bodies):
    """Free bodies elsewhere become balls."""
    return tuple(
        replace(b, joint=Spherical()) if isinstance(b.joint, Floating) and b.parent != "ground" else b
        for b in bodies
    )


def mujoco_data(mujoco, path):
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    return model, data


def full_mass(mujoco, model, data):
    mass = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, mass)
    return mass


@pytest.mark.parametrize("seed", range(6))
def test_a_tree_in_mujoco(seed, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    rng = np.random.default_rng(seed)
    bodies = floating_on_ground(random_bodies(6 + seed, rng, first=seed % 7))
    system = TreeSystem(bodies=bodies, gravity=(0.3, -0.2, -9.0))
    assert write_mjcf(system, tmp_path / "tree.xml") == ()
    model, data = mujoco_data(mujoco, tmp_path / "tree.xml")
    mujoco.mj_resetDataKeyframe(model, data, 0)
    mujoco.mj_forward(model, data)
    parts, mass, force = ours(system, None, tree_compiled(system).start[1])
    columns = np.concatenate(
        [
            np.arange(start, start + parts.columns[name].stop - parts.columns[name].start)
            for name, start in _starts(mujoco, model, parts)
        ]
    ).astype(int)
    place = np.concatenate([np.arange(c.start, c.stop) for c in parts.columns.values()]).astype(int)
    turn = to_global(bodies[0], parts.size)
    theirs = turn.T @ full_mass(mujoco, model, data)[np.ix_(columns, columns)] @ turn
    assert np.abs(mass[np.ix_(place, place)] - theirs).max() < AGREE * np.abs(theirs).max()
    bias = turn.T @ data.qfrc_bias[columns]
    assert np.abs(force[place] - bias).max() < AGREE * np.abs(bias).max()


def to_global(root, size):
    """(n, n) from our velocities to theirs: those of a free body are along global axes."""
    turn = np.eye(size)
    if isinstance(root.joint, Floating):
        turn[:3, :3] = root.axes
    return turn


def _starts(mujoco, model, parts):
    for name, columns in parts.columns.items():
        if columns.stop > columns.start:
            body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
            yield name, model.body_dofadr[body]


@pytest.mark.parametrize("seed", range(6))
def test_a_tree_in_pinocchio(seed, tmp_path):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(100 + seed)
    bodies = tuple(
        replace(b, joint={Spherical: Revolute(), Floating: Planar()}.get(type(b.joint), b.joint))
        for b in random_bodies(6 + seed, rng)
    )
    bodies = tuple(replace(b, joint=_at_zero(b.joint)) for b in bodies)
    system = TreeSystem(bodies=bodies)
    assert write_urdf(system, tmp_path / "tree.urdf") == ()
    model = pin.buildModelFromUrdf(str(tmp_path / "tree.urdf"))
    data, v = model.createData(), rng.normal(size=model.nv)
    parts = tree_compiled(system)
    order = np.concatenate(
        [
            [
                model.joints[model.getJointId(f"{name} joint")].idx_v - c.stop + c.start + 1 + i
                for i in range(c.stop - c.start)
            ]
            for name, c in parts.columns.items()
        ]
    ).astype(int)
    place = np.concatenate([np.arange(c.start, c.stop) for c in parts.columns.values()]).astype(int)
    speeds = np.zeros(model.nv)
    speeds[place] = v[order]
    _, mass, force = ours(system, None, speeds)
    bias = pin.rnea(model, data, pin.neutral(model), v, np.zeros(model.nv))[order]
    theirs = pin.crba(model, data, pin.neutral(model))
    theirs = (np.triu(theirs) + np.triu(theirs, 1).T)[np.ix_(order, order)]
    assert np.abs(mass[np.ix_(place, place)] - theirs).max() < AGREE * np.abs(theirs).max()
    assert np.abs(force[place] - bias).max() < AGREE * np.abs(bias).max()


def _at_zero(joint):
    axes = {key: getattr(joint, key) for key in ("axis", "axes") if hasattr(joint, key)}
    return type(joint)(**axes)


def test_a_figure_with_classes_geoms_and_degrees(tmp_path):
    mujoco = pytest.importorskip("mujoco")
    path = tmp_path / "figure.xml"
    path.write_text(HUMANOID)
    read = read_mjcf(path)
    model, data = mujoco_data(mujoco, path)
    mujoco.mj_forward(model, data)
    _, mass, force = ours(read.system, None, np.zeros(model.nv))
    turn = to_global(read.system.bodies[0], model.nv)
    theirs = turn.T @ full_mass(mujoco, model, data) @ turn
    assert np.abs(mass - theirs).max() < AGREE * np.abs(theirs).max()
    # the springs of the joints act at the pose of the file, too
    bias = turn.T @ (data.qfrc_bias - data.qfrc_passive)
    assert np.abs(force - bias).max() < AGREE * np.abs(bias).max()
    for name, (low, high) in read.ranges.items():
        joint = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, f"{name} joint")
        if joint >= 0:
            np.testing.assert_allclose(
                model.jnt_range[joint] - model.qpos0[model.jnt_qposadr[joint]], (low, high)
            )


def test_an_arm_of_urdf(tmp_path):
    pin = pytest.importorskip("pinocchio")
    path = tmp_path / "arm.urdf"
    path.write_text(URDF_ARM)
    read = read_urdf(path)
    model = pin.buildModelFromUrdf(str(path))
    data = model.createData()
    v = np.array([0.3, -0.7])
    _, mass, force = ours(replace(read.system, springs=()), None, v)
    theirs = pin.crba(model, data, pin.neutral(model))
    np.testing.assert_allclose(np.triu(mass), np.triu(theirs), rtol=AGREE)
    np.testing.assert_allclose(force, pin.rnea(model, data, pin.neutral(model), v, np.zeros(2)), rtol=AGREE)
    assert [read.ranges["upper"], read.ranges["slider"]] == [
        (model.lowerPositionLimit[0], model.upperPositionLimit[0]),
        (model.lowerPositionLimit[1], model.upperPositionLimit[1]),
    ]
