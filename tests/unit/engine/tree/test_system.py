"""What a tree refuses, in words."""

import numpy as np
import pytest

from tests.sample_trees import tree_run
from workbench.engine.elements.laws import UserLaw
from workbench.engine.elements.spring import Spring
from workbench.engine.errors import InvalidSystem, NotConverged, NotSupported
from workbench.engine.integration.schemes import BDF2
from workbench.engine.tree.compiled import tree_compiled
from workbench.engine.tree.elements import (
    CoordinateSpring,
    Coupling,
    SpatialBushing,
    SpatialLoad,
    SpatialMember,
    SphericalSpring,
)
from workbench.engine.tree.joints import (
    Planar,
    Prescribed,
    Prismatic,
    Revolute,
    SpatialMotion,
    Spherical,
    Welded,
)
from workbench.engine.tree.system import SpatialBody, TreeSystem

ARM = SpatialBody(name="arm", joint=Revolute(), mass=1.0, inertia=(0.1, 0.1, 0.1))
TIP = SpatialBody(name="tip", parent="arm", joint=Welded(), mass=1.0)
BALL = SpatialBody(name="ball", parent="arm", joint=Spherical(), mass=1.0, inertia=(0.1, 0.1, 0.1))
LAW = Spring(k=1.0)


def body(**change):
    return SpatialBody(**{"name": "x", "joint": Revolute(), "mass": 1.0, **change})


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: TreeSystem(bodies=(ARM, ARM)), "two bodies are called 'arm'"),
        (lambda: TreeSystem(bodies=(body(name="ground"),)), "'ground' is the world"),
        (
            lambda: TreeSystem(bodies=(body(parent="y"),)),
            "body 'x' refers to body 'y'; bodies are x and ground",
        ),
        (
            lambda: TreeSystem(bodies=(body(parent="y"), body(name="y", parent="x"))),
            "body 'x' hangs on itself",
        ),
        (lambda: TreeSystem(bodies=(body(mass=-1.0),)), "needs mass >= 0 kg, got mass=-1.0"),
        *(
            (
                lambda wrong=wrong: TreeSystem(bodies=(ARM, body(inertia=wrong), TIP)),
                "body 'x' needs a symmetric inertia without negative principal values",
            )
            for wrong in ((1.0, -1.0, 1.0), np.triu(np.ones((3, 3))), np.eye(2), (np.nan, 1.0, 1.0))
        ),
        *(
            (
                lambda wrong=wrong: TreeSystem(bodies=(ARM, body(axes=wrong), TIP)),
                "body 'x' needs right-handed unit axes",
            )
            for wrong in (-np.eye(3), 2.0 * np.eye(3), np.eye(2), np.diag([1.0, 1.0, np.nan]))
        ),
        (lambda: TreeSystem(bodies=(body(joint=Revolute(axis=(0, 0, 0))),)), "joint of 'x' needs an axis"),
        (
            lambda: TreeSystem(bodies=(body(joint=Planar(axes=((1, 0, 0), (1, 1, 0)))),)),
            "needs perpendicular axes",
        ),
        (
            lambda: tree_compiled(TreeSystem(bodies=(body(joint=Spherical(orientation=(0, 0, 0, 0))),))),
            "needs an orientation",
        ),
        (
            lambda: TreeSystem(bodies=(ARM,), members=(SpatialMember(a="arm", b="leg", law=LAW),)),
            r"members\[0\] refers to body 'leg'",
        ),
        (
            lambda: TreeSystem(bodies=(ARM,), members=(SpatialMember(a="arm", b="arm", law=LAW),)),
            "joins body 'arm' to itself",
        ),
        (
            lambda: tree_compiled(
                TreeSystem(bodies=(ARM, TIP), members=(SpatialMember(a="arm", b="tip", law=LAW),))
            ),
            r"members\[0\] lies within one rigid part",
        ),
        (
            lambda: TreeSystem(bodies=(ARM,), bushings=(SpatialBushing(a="arm", b="arm", k=1.0),)),
            r"bushings\[0\] joins body 'arm' to itself",
        ),
        (
            lambda: tree_compiled(
                TreeSystem(
                    bodies=(
                        ARM,
                        SpatialBody(name="t", parent="arm", joint=Welded(), axes=np.diag([1.0, -1, -1])),
                        BALL,
                    ),
                    bushings=(SpatialBushing(a="ball", b="t", k=1.0),),
                )
            ),
            "axes of the welded body 't'",
        ),
        (
            lambda: TreeSystem(bodies=(ARM,), springs=(CoordinateSpring(body="arm", coordinate=1),)),
            r"springs\[0\] needs a coordinate of the joint of 'arm' \(Revolute: 1 of them\)",
        ),
        (
            lambda: TreeSystem(bodies=(ARM,), spherical_springs=(SphericalSpring(body="arm"),)),
            "needs a spherical or floating joint on 'arm'",
        ),
        (
            lambda: TreeSystem(bodies=(ARM, BALL), couplings=(Coupling(a="arm", b="ball"),)),
            r"couplings\[0\] needs a coordinate of the joint of 'ball'",
        ),
        (lambda: CoordinateSpring(body="arm", width=0.0), "spring of 'arm' needs width > 0"),
        (lambda: SpatialLoad(body="arm"), "load on 'arm' needs either force or torque"),
        (lambda: SpatialBushing(a="arm", k=1.0, slip=0.1), "both slip and release"),
        (lambda: SpatialBushing(a="arm", k=1.0, slip=0.2, release=0.1), "0 <= slip < release"),
        (lambda: SpatialBushing(a="arm", k=1.0, cap=-1.0), "cap > 0 N"),
        (lambda: SpatialBushing(a="arm", k=1.0, push_cap=1.0), "opens, push_cap and cap together"),
        (lambda: SpatialBushing(a="arm", k=1.0, eps=0.0), "tau, width and eps > 0"),
        (lambda: tree_compiled(TreeSystem(bodies=(body(joint=Welded()),))), "at least one joint that moves"),
    ],
)
def test_a_wrong_system_is_refused_in_words(made, message):
    with pytest.raises(InvalidSystem, match=message):
        made()


def test_what_trees_do_not_do_yet():
    law = UserLaw(force=lambda delta, rate, t: delta)
    with pytest.raises(NotSupported, match="UserLaw, which trees do not take"):
        TreeSystem(bodies=(ARM,), members=(SpatialMember(a="arm", law=law),))
    with pytest.raises(NotSupported, match="not BDF2"):
        tree_run(TreeSystem(bodies=(ARM,)), np.zeros(0), np.linspace(0, 1, 3), BDF2())


def test_runs_say_what_they_lack():
    times = np.linspace(0.0, 0.1, 11)
    system = TreeSystem(bodies=(ARM,))
    with pytest.raises(ValueError, match="0 members but density has 2"):
        tree_run(system, np.ones(2), times)
    run = tree_run(system, np.zeros(0), times, keep=False)
    with pytest.raises(ValueError, match="no body 'leg'; it has arm"):
        run.columns("leg")
    with pytest.raises(ValueError, match="no body 'leg'; it has ground, arm"):
        run.frames("leg")
    empty = SpatialBody(name="empty", parent="arm", joint=Revolute())
    with pytest.raises(NotConverged, match="moves nothing that has mass"):
        tree_run(TreeSystem(bodies=(ARM, empty)), np.zeros(0), times)


def test_a_driven_body_carries_its_load():
    """A mass on a spring below a plate that shakes: position against the closed form of the forced
    oscillator."""
    amplitude, rate, k, m = 0.05, 5.0, 400.0, 2.0
    shake = SpatialMotion(position=lambda t: (0.0, 0.0, amplitude * np.sin(rate * t)))
    plate = SpatialBody(name="plate", joint=Prescribed(motion=shake))
    load = SpatialBody(name="load", parent="plate", joint=Prismatic(axis=(0.0, 0.0, 1.0)), mass=m)
    system = TreeSystem(
        bodies=(load, plate), springs=(CoordinateSpring(body="load", k=k),), gravity=(0.0, 0.0, 0.0)
    )
    run = tree_run(system, np.zeros(0), np.linspace(0.0, 1.0, 8001), keep=False)
    w = np.sqrt(k / m)
    # m (z + a sin rt)'' = -k z with z(0) = z'(0) = 0
    share = amplitude * rate**2 / (w**2 - rate**2)
    expected = share * (np.sin(rate * run.times) - rate / w * np.sin(w * run.times))
    assert run.position[:, 0] == pytest.approx(expected, abs=1e-7)
    frames = run.frames("load")
    assert frames.origin[:, 2] == pytest.approx(expected + amplitude * np.sin(rate * run.times), abs=1e-7)
    numeric = np.gradient(frames.origin[:, 2], run.times, edge_order=2)
    assert frames.velocity[5:-5, 2] == pytest.approx(numeric[5:-5], abs=1e-5)
    numeric = np.gradient(frames.velocity[:, 2], run.times, edge_order=2)
    assert frames.acceleration[5:-5, 2] == pytest.approx(numeric[5:-5], abs=1e-3)


def test_a_turning_platform_drives_as_its_matrix_says():
    """Rotation of a driven body given by its matrix alone: spin and spin rate follow by differences."""

    def turn(t):
        c, s = np.cos(3.0 * t**2), np.sin(3.0 * t**2)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])

    motion = SpatialMotion(position=lambda t: (1.0, 0.0, 0.0), rotation=turn)
    table = SpatialBody(name="table", joint=Prescribed(motion=motion))
    rider = SpatialBody(
        name="rider", parent="table", joint=Revolute(), at=(0.5, 0.0, 0.0), mass=1.0, inertia=(1, 1, 1)
    )
    run = tree_run(TreeSystem(bodies=(table, rider)), np.zeros(0), np.linspace(0.0, 0.5, 501))
    frames = run.frames("table")
    assert frames.spin[:, 2] == pytest.approx(6.0 * run.times, abs=1e-8)
    assert frames.spin_rate[:, 2] == pytest.approx(6.0, abs=1e-4)
    # nothing turns the rider about its own axis: its absolute angle stays
    assert run.position[:, 0] == pytest.approx(-3.0 * run.times**2, abs=1e-5)
