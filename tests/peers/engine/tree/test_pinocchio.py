"""Forces, mass matrix and slopes of random trees in Pinocchio, which numbers bodies depth first by itself."""

import numpy as np
import pytest

from tests.sample_trees import random_tree
from workbench.engine.tree._kernels.forces import look_linearised
from workbench.engine.tree._kernels.tables import tree_work
from workbench.engine.tree.compiled import tree_compiled, tree_on_grid
from workbench.engine.tree.joints import (
    Cylindrical,
    Floating,
    Planar,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
    Welded,
)
from workbench.engine.tree.system import full_inertia

pytestmark = pytest.mark.peer

AGREE = 1e-12  # relative to the largest entry


def peer_model(pin, system):
    """Pinocchio's model of the bodies, and its joints per body."""

    def unit(axis):
        return np.asarray(axis, float) / np.linalg.norm(axis)

    def pieces(joint):
        match joint:
            case Floating():
                return (pin.JointModelTranslation(), pin.JointModelSpherical())
            case Spherical():
                return (pin.JointModelSpherical(),)
            case Revolute():
                return (pin.JointModelRevoluteUnaligned(unit(joint.axis)),)
            case Prismatic():
                return (pin.JointModelPrismaticUnaligned(unit(joint.axis)),)
            case Universal():
                return tuple(pin.JointModelRevoluteUnaligned(unit(axis)) for axis in joint.axes)
            case Cylindrical():
                axis = unit(joint.axis)
                return (pin.JointModelPrismaticUnaligned(axis), pin.JointModelRevoluteUnaligned(axis))
            case Planar():
                x, y = (unit(axis) for axis in joint.axes)
                return (
                    pin.JointModelPrismaticUnaligned(x), pin.JointModelPrismaticUnaligned(y),
                    pin.JointModelRevoluteUnaligned(np.cross(x, y)),
                )  # fmt: skip
        return ()

    model, joints = pin.Model(), {}
    at = {"ground": (0, pin.SE3.Identity())}
    children = {}
    for body in system.bodies:
        children.setdefault(body.parent, []).append(body)
    waiting = list(children.get("ground", []))
    while waiting:
        body = waiting.pop()
        parent, frame = at[body.parent]
        frame = frame * pin.SE3(np.asarray(body.axes), np.asarray(body.at))
        joints[body.name] = []
        for i, piece in enumerate(pieces(body.joint)):
            parent = model.addJoint(parent, piece, frame, f"{body.name} {i}")
            frame = pin.SE3.Identity()
            joints[body.name].append(parent)
        at[body.name] = (parent, frame)
        inertia = pin.Inertia(body.mass, np.asarray(body.centre), full_inertia(body.inertia))
        model.appendBodyToJoint(parent, inertia, frame)
        waiting += children.get(body.name, [])
    return model, joints


@pytest.mark.parametrize("seed", range(50))
def test_mass_stiffness_and_damping_of_random_trees(seed):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(1000 + seed)
    system = random_tree(rng, count=5 + seed % 12, first=seed % 7, elements=False)
    parts = tree_compiled(system)
    tables = tree_on_grid(parts, np.zeros(0), np.zeros(1))
    n, q = parts.size, parts.start[0]
    v, w = rng.normal(size=n), rng.normal(size=n)
    work = tree_work(tables, 0)
    look_linearised(tables, work, 0, q, v, w)

    model, joints = peer_model(pin, system)
    columns, q_peer = np.zeros(n, int), np.zeros(model.nq)  # our column -> theirs
    for body in system.bodies:
        if isinstance(body.joint, Welded):
            continue
        column, at = parts.columns[body.name].start, parts.coordinates[body.name].start
        for joint in joints[body.name]:
            theirs = model.joints[joint]
            columns[column : column + theirs.nv] = np.arange(theirs.idx_v, theirs.idx_v + theirs.nv)
            given = q[at : at + theirs.nq]
            # their quaternions stand (x, y, z, w)
            q_peer[theirs.idx_q : theirs.idx_q + theirs.nq] = given if theirs.nq < 4 else np.roll(given, -1)
            column, at = column + theirs.nv, at + theirs.nq
    order = np.argsort(columns)
    data = model.createData()
    pin.computeRNEADerivatives(model, data, q_peer, v[order], w[order])
    mass = np.triu(data.M) + np.triu(data.M, 1).T
    for ours, theirs in (
        (work.force, data.tau[columns]),
        (work.m, mass[np.ix_(columns, columns)]),
        (work.k, data.dtau_dq[np.ix_(columns, columns)]),
        (work.c, data.dtau_dv[np.ix_(columns, columns)]),
    ):
        assert np.abs(ours - theirs).max() < AGREE * np.abs(theirs).max()
