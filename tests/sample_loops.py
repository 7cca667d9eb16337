"""Spatial trees with loops: parallelogram, four-bar, Bricard's mechanism, double wishbone."""

import numpy as np

from workbench.engine.elements.spring import Spring
from workbench.engine.tree.elements import SpatialMember
from workbench.engine.tree.joints import Revolute, Spherical
from workbench.engine.tree.loops.cuts import CutJoint
from workbench.engine.tree.restart import close_loops
from workbench.engine.tree.system import SpatialBody, TreeSystem

X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
DOWN = (0.0, 0.0, -1.0)
CRANK = 1.2  # kg


def parallelogram(angle, *, right=None, bar=2.0, speeds=(1.0, 0.0, 0.0), closed=True):
    """Two rods of 1 m, 1 m apart, and a bar between their tips; the bar's joint to the right one is cut."""

    def crank(name, x, turn, speed):
        return SpatialBody(
            name=name, at=(x, 0.0, 0.0), joint=Revolute(axis=Y, angle=turn, speed=speed), mass=CRANK,
            centre=(0.0, 0.0, -0.5), inertia=(CRANK / 12, CRANK / 12, 0.0),
        )  # fmt: skip

    far = angle if right is None else right
    given = far if closed or right is not None else angle - 0.3 * bool(angle)
    bodies = (
        crank("left", 0.0, angle, speeds[0]),
        SpatialBody(
            name="bar", parent="left", at=DOWN, joint=Revolute(axis=Y, angle=-angle, speed=speeds[1]),
            mass=bar, centre=(0.5, 0.0, 0.0), inertia=(0.0, bar / 12, bar / 12),
        ),
        crank("right", 1.0, given, speeds[2]),
    )  # fmt: skip
    cut = CutJoint(a="bar", b="right", point_a=X, point_b=DOWN, kind="revolute", axis_a=Y, axis_b=Y)
    system = TreeSystem(bodies=bodies, cuts=(cut,))
    return close_loops(system, held=(("left", 0),)) if closed else system


def four_bar(*, kind="revolute", speed=2.0, tip=1.0, springs=True):
    """Links of 0.4, 1, 0.8 and 1 m in the plane x, z; the joint of coupler and rocker is cut."""

    def link(name, length, mass, spin, **place):
        around = mass * length**2 / 10
        return SpatialBody(
            name=name, mass=mass, centre=(0.5 * length, 0.0, 0.0), inertia=(0.01, around, around),
            joint=Revolute(axis=Y, angle=spin, speed=speed if name == "crank" else 0.0), **place,
        )  # fmt: skip

    bodies = (
        link("crank", 0.4, 1.0, -1.0),
        link("coupler", 1.0, 2.0, 0.5, parent="crank", at=(0.4, 0.0, 0.0)),
        link("rocker", 0.8, 1.5, -1.4, at=X),
    )
    cut = CutJoint(
        a="coupler",
        b="rocker",
        point_a=(tip, 0.0, 0.0),
        point_b=(0.8, 0.0, 0.0),
        kind=kind,
        axis_a=Y,
        axis_b=Y,
    )
    members = (
        SpatialMember(
            a="coupler", point_a=(0.5, 0.1, 0.2), point_b=(0.3, 0.2, 1.5), law=Spring(k=30.0, c=1.0),
            natural_length=0.5,
        ),
        SpatialMember(
            a="rocker", b="crank", point_a=(0.5, 0.1, 0.2), point_b=(0.3, 0.2, -0.1),
            law=Spring(k=20.0, c=1.0), natural_length=0.5,
        ),
    )  # fmt: skip
    system = TreeSystem(bodies=bodies, cuts=(cut,), members=members if springs else ())
    return close_loops(system, held=(("crank", 0),))


def bricard_tree():
    """Five 1 m rods of 1 kg and 0.1 m x 0.1 m, revolute joints with axes y, z, x, y, z; the sixth, x, is
    cut."""
    places = np.array([(0, 0, 0), (1, 0, 0), (1, -1, 0), (1, -1, 1), (0, -1, 1), (0, 0, 1)], float)
    axes = ((0, 1, 0), (0, 0, 1), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 0))
    bodies = []
    for i in range(5):
        d = places[i + 1] - places[i]
        along = np.outer(d, d)
        bodies.append(
            SpatialBody(
                name=f"rod{i}", parent=f"rod{i - 1}" if i else "ground",
                at=tuple(places[i] - places[i - 1]) if i else (0.0, 0.0, 0.0), joint=Revolute(axis=axes[i]),
                mass=1.0, centre=tuple(0.5 * d), inertia=(1.01 * (np.eye(3) - along) + 0.02 * along) / 12,
            )
        )  # fmt: skip
    cut = CutJoint(
        a="rod4",
        point_a=tuple(places[5] - places[4]),
        point_b=tuple(places[5]),
        kind="revolute",
        axis_a=axes[5],
    )
    return TreeSystem(bodies=tuple(bodies), cuts=(cut,), gravity=(0.0, -9.81, 0.0))


def wishbone(*, rod=(0.1, 0.35, 0.02), stiffness=2e4):
    """A wheel carrier on two wishbones and a tie rod; the upper ball and the rod are cut.

    The carrier hangs by a ball on the lower arm; a strut of the lower arm carries it.
    """
    axis = (1.0, 0.05, 0.02)
    lower = SpatialBody(
        name="lower", at=(0.0, 0.3, 0.0), joint=Revolute(axis=axis), mass=6.0, centre=(0.0, 0.2, 0.0),
        inertia=(0.1, 0.05, 0.12),
    )  # fmt: skip
    upper = SpatialBody(
        name="upper", at=(-0.02, 0.4, 0.3), joint=Revolute(axis=(1.0, -0.08, -0.03), speed=0.0), mass=4.0,
        centre=(0.0, 0.15, 0.0), inertia=(0.05, 0.03, 0.06),
    )  # fmt: skip
    carrier = SpatialBody(
        name="carrier", parent="lower", at=(0.0, 0.42, 0.0), joint=Spherical(), mass=40.0,
        centre=(0.0, 0.08, 0.15), inertia=(1.0, 1.8, 1.0),
    )  # fmt: skip
    cuts = (
        CutJoint(
            a="carrier", b="upper", point_a=(-0.03, -0.02, 0.31), point_b=(-0.01, 0.30, 0.01),
            kind="spherical", name="upper ball",
        ),
        CutJoint(a="carrier", point_a=(0.12, -0.02, 0.05), point_b=rod, kind="distance", name="tie rod"),
    )  # fmt: skip
    strut = SpatialMember(
        a="lower", point_a=(0.0, 0.3, 0.02), point_b=(0.0, 0.45, 0.55), law=Spring(k=stiffness, c=300.0),
        natural_length=0.58,
    )  # fmt: skip
    return TreeSystem(bodies=(upper, carrier, lower), cuts=cuts, members=(strut,))
