"""Robot files: what is read, in which unit, what is left out, and what each error says."""

import numpy as np
import pytest

from tests.sample_robots import HUMANOID, URDF_ARM
from tests.sample_trees import random_bodies
from workbench.engine import (
    CoordinateSpring,
    CutJoint,
    Floating,
    InvalidSystem,
    NotSupported,
    Prescribed,
    Prismatic,
    Revolute,
    SpatialBody,
    SpatialLoad,
    SpatialMotion,
    Spherical,
    SphericalSpring,
    TreeSystem,
    Universal,
    read_mjcf,
    read_urdf,
    write_mjcf,
    write_urdf,
)
from workbench.engine.tree.start import start_frames
from workbench.engine.tree.system import full_inertia


def read(reader, text, tmp_path, **options):
    path = tmp_path / "robot.xml"
    path.write_text(text)
    return reader(path, **options)


def whole(system):
    """Mass, centre and inertia about the origin of all bodies at the start."""
    frames, mass, moment, inertia = start_frames(system.bodies), 0.0, np.zeros(3), np.zeros((3, 3))
    for body in system.bodies:
        axes, origin = frames[body.name]
        c = origin + axes @ np.asarray(body.centre)
        mass, moment = mass + body.mass, moment + body.mass * c
        inertia += axes @ full_inertia(body.inertia) @ axes.T
        inertia += body.mass * (c @ c * np.eye(3) - np.outer(c, c))
    return mass, moment, inertia


def test_degrees_become_radians_and_both_are_shown(tmp_path):
    figure = read(read_mjcf, HUMANOID, tmp_path)
    assert figure.ranges["arm"] == pytest.approx(np.radians([-60.0, 80.0]))
    assert figure.ranges["arm 1"] == pytest.approx(np.radians([-90.0, 30.0]))  # by its class
    # a slide in metres, from the pose of the file, which is at 0.01
    assert figure.ranges["hand"] == pytest.approx([-0.03, 0.04])
    assert "arm: -1.047 to 1.396 rad (-60 to 80 deg)" in str(figure)
    assert "hand: -0.03 to 0.04 m" in str(figure)
    assert figure.system.gravity == (0.0, 0.5, -9.7)
    radian = HUMANOID.replace('eulerseq="xyz"', 'angle="radian"').replace("-60 80", "-1 1.4")
    assert read(read_mjcf, radian, tmp_path).ranges["arm"] == (-1.0, 1.4)


def test_classes_give_springs_and_geoms_give_masses(tmp_path):
    system = read(read_mjcf, HUMANOID, tmp_path).system
    assert [(s.body, s.k, s.c) for s in system.springs] == [
        ("arm 1", 20.0, 2.0), ("arm", 20.0, 2.0), ("hand", 20.0, 2.0),
    ]  # fmt: skip
    assert [(s.body, s.k, s.c) for s in system.spherical_springs] == [("leg", 0.0, 0.4)]
    mass = {body.name: body.mass for body in system.bodies}
    tube = np.pi * 0.07**2 * np.hypot(0.22, 0.02) + 4 / 3 * np.pi * 0.07**3
    assert mass["torso"] == pytest.approx(900 * tube + 4.0)
    assert (mass["arm 1"], mass["leg"]) == (0.0, 5.0)
    assert mass["foot"] == pytest.approx(900 * np.pi * 0.03**2 * 0.2)


def test_ranges_become_soft_stops(tmp_path):
    arm = read(read_urdf, URDF_ARM, tmp_path, stop_stiffness=500.0)
    stops = {s.body: s for s in arm.system.springs if s.k_stop}
    assert (stops["upper"].lower, stops["upper"].upper, stops["upper"].k_stop) == (1.5, 0.75, 500.0)
    assert arm.left_out == ("1 x dry friction of a joint", "1 x transmission")
    shown = read(read_urdf, URDF_ARM, tmp_path)
    assert "left out: 2 x range without stops (see stop_stiffness)" in str(shown)
    assert [s.c for s in shown.system.springs] == [0.3]
    figure = read(
        read_mjcf, HUMANOID.replace('range="-60 80"', 'range="20 80"'), tmp_path, stop_stiffness=9.0
    )
    (stop,) = [s for s in figure.system.springs if s.k_stop and s.body == "arm"]
    assert (stop.rest, stop.lower) == (pytest.approx(np.radians(20.0)), 0.0)


def test_the_root_of_a_urdf_stands_or_floats(tmp_path):
    free = URDF_ARM.replace(
        '<link name="world"/>',
        '<link name="base"><inertial><mass value="3"/>'
        '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial></link>',
    )
    free = free.replace('parent link="world"', 'parent link="base"')  # fmt: skip
    assert read(read_urdf, free, tmp_path).system.size == 2
    assert read(read_urdf, free, tmp_path, floating=True).system.size == 8


@pytest.mark.parametrize(("writer", "reader"), [(write_mjcf, read_mjcf), (write_urdf, read_urdf)])
def test_what_is_written_is_read_alike(writer, reader, tmp_path):
    straight = {
        Spherical: Universal(), Floating: Prismatic(axis=(1.0, 2.0, 0.5)),
    }  # fmt: skip
    for seed in range(4):
        bodies = [
            SpatialBody(
                name=b.name, parent=b.parent, at=b.at, axes=b.axes, mass=b.mass, centre=b.centre,
                inertia=b.inertia, joint=straight.get(type(b.joint)) or _at_zero(b.joint),
            )
            for b in random_bodies(9, np.random.default_rng(seed))
        ]  # fmt: skip
        system = TreeSystem(bodies=bodies)
        assert writer(system, tmp_path / "tree.xml") == ()
        again = reader(tmp_path / "tree.xml").system
        assert again.size == system.size
        for one, other in zip(whole(again), whole(system), strict=True):
            np.testing.assert_allclose(one, other, rtol=1e-10, atol=1e-10)


def _at_zero(joint):
    return type(joint)(**{key: getattr(joint, key) for key in ("axis", "axes") if hasattr(joint, key)})


def test_writing_says_what_a_format_cannot_hold(tmp_path):
    arm = SpatialBody(name="arm", joint=Revolute(angle=0.3), mass=1.0, inertia=(1.0, 1.0, 1.0))
    ball = SpatialBody(name="ball", parent="arm", joint=Spherical(), mass=1.0, inertia=(1.0, 1.0, 1.0))
    system = TreeSystem(
        bodies=(arm, ball),
        springs=(CoordinateSpring(body="arm", k=1.0, torque=2.0), CoordinateSpring(body="arm", k=2.0)),
        spherical_springs=(SphericalSpring(body="ball", k=1.0, rest=(0.8, 0.6, 0.0, 0.0)),),
        loads=(SpatialLoad(body="arm", force=(1.0, 0.0, 0.0)),),
        cuts=(CutJoint(a="ball", point_a=(0.0, 0.0, 1.0), kind="distance", length=1.0),),
    )
    assert write_mjcf(system, tmp_path / "a.xml") == (
        "1 x stop or torque of a joint",
        "1 x second spring of a coordinate, or spring of a floating body",
        "1 x second spring of a ball, one turned at rest, or one of a floating body",
        "1 x cut joint",
        "1 x load",
    )
    with pytest.raises(NotSupported, match="URDF has no spherical joint, as body 'ball' has; write_mjcf has"):
        write_urdf(system, tmp_path / "a.urdf")
    assert write_urdf(TreeSystem(bodies=(arm,), springs=system.springs[:1]), tmp_path / "a.urdf") == (
        "1 x spring, stop or torque of a joint", "1 x start other than zero coordinates",
    )  # fmt: skip
    driven = SpatialBody(name="cab", joint=Prescribed(motion=SpatialMotion(position=lambda t: (t, 0, 0))))
    with pytest.raises(NotSupported, match="MJCF has no prescribed joint, as body 'cab' has"):
        write_mjcf(TreeSystem(bodies=(driven,)), tmp_path / "a.xml")
    free = SpatialBody(name="free", parent="arm", joint=Floating(), mass=1.0, inertia=(1.0, 1.0, 1.0))
    with pytest.raises(NotSupported, match="'free' hangs on 'arm'"):
        write_mjcf(TreeSystem(bodies=(arm, free)), tmp_path / "a.xml")


URDF_FAULTS = [
    ("<robot", "<model", "is not XML"),
    ('<?xml version="1.0"?>', '<!DOCTYPE a [<!ENTITY b "c">]>', "declares a DOCTYPE or entities"),
    (
        '<child link="slider"/>',
        '<child link="slide"/>',
        "joint 'slide' refers to link 'slide'; links are slider",
    ),
    ('<child link="slider"/>', '<child link="upper"/>', "link 'upper' hangs on two joints"),
    ('<child link="slider"/>', "", "joint 'slide' needs <child>"),
    ('lower="-1.5" upper="0.75"', 'lower="1.5" upper="0.75"', "range 1.5 to 0.75: the ends are reversed"),
    ('<mass value="2"/>', "<mass/>", "link 'upper' needs value"),
    ('<mass value="2"/>', '<mass value="two"/>', 'needs numbers in value="two"'),
    ('<mass value="2"/>', '<mass value="nan"/>', 'needs 1 finite numbers in value="nan"'),
    ('ixx="0.03" ', "", "link 'upper' needs ixx"),
    ('type="prismatic"', 'type="screw"', "joint 'slide' has type 'screw'; types are revolute"),
    ('<link name="upper">', "<link>", "a link needs a name"),
    ('xyz="0 1 0"', 'xyz="0 1"', 'needs 3 finite numbers in xyz="0 1"'),
    (
        '<link name="world"/>',
        '<link name="world"/><link name="loose"/>',
        "one link that hangs on no joint, got",
    ),
]


@pytest.mark.parametrize(("old", "new", "message"), URDF_FAULTS)
def test_faults_of_a_urdf(old, new, message, tmp_path):
    assert old in URDF_ARM
    with pytest.raises(InvalidSystem, match=message):
        read(read_urdf, URDF_ARM.replace(old, new), tmp_path)


MJCF_FAULTS = [
    ("<mujoco", "<robot", "is not XML"),
    ("<worldbody>", '<worldbody><include file="x.xml"/>', "has <include>, which is not read"),
    ('eulerseq="xyz"', 'coordinate="global"', 'has coordinates "global"'),
    ('eulerseq="xyz"', 'angle="grad"', 'angle="grad"; degree or radian was expected'),
    ('eulerseq="xyz"', 'eulerseq="xYz"', 'eulerseq="xYz"; three of xyz'),
    (
        'euler="10 20 30"',
        'euler="10 20 30" quat="1 0 0 0"',
        "body 'torso' has quat and euler; one orientation",
    ),
    ('axisangle="1 0 1 25"', 'axisangle="0 0 0 25"', "body 'hand' needs a direction in axisangle"),
    ('xyaxes="1 0.1 0 0 1 0.2"', 'xyaxes="1 0 0 2 0 0"', "body 'leg' needs two directions in xyaxes"),
    (
        'type="box" size="0.03 0.04 0.05"',
        'type="mesh" mesh="m"',
        "geom '0' is a mesh: its mass needs the shape",
    ),
    ('type="box" size="0.03 0.04 0.05"', 'type="box" size="0.03"', "a box, needs 3 sizes > 0"),
    ('mass="4"', 'mass="-4"', "needs a mass >= 0, got -4 kg"),
    ('fromto="0 0 0 0.2 0 0"', 'fromto="0 0 0 0 0 0"', "needs two different ends in fromto"),
    ('type="ball"', 'type="screw"', "joint 'leg joint' has type 'screw'; types are free, ball, hinge, slide"),
    (
        'type="ball" stiffness="0"',
        'type="free"',
        "joint 'leg joint' is free, but its body hangs on body 'torso'",
    ),
    ('range="-60 80"', 'range="80 -60"', "has the range 80 -60: the ends are reversed"),
    ('mass="5" ', "", "body 'leg', inertial, needs mass"),
]


@pytest.mark.parametrize(("old", "new", "message"), MJCF_FAULTS)
def test_faults_of_an_mjcf(old, new, message, tmp_path):
    assert old in HUMANOID
    with pytest.raises((InvalidSystem, NotSupported), match=message):
        read(read_mjcf, HUMANOID.replace(old, new, 1), tmp_path)


def test_files_that_are_missing_or_of_another_kind(tmp_path):
    with pytest.raises(InvalidSystem, match=r"none\.urdf: no such file; a robot file in XML was expected"):
        read_urdf(tmp_path / "none.urdf")
    with pytest.raises(InvalidSystem, match="begins with <mujoco>; <robot> was expected"):
        read(read_urdf, HUMANOID, tmp_path)


def test_what_would_change_the_motion_is_named(tmp_path):
    more = HUMANOID.replace('damping="0.4"', 'damping="0.4" armature="0.1" frictionloss="1"')
    more = more.replace("</worldbody>", '</worldbody><tendon><fixed name="t"/></tendon><sensor/>')
    left_out = read(read_mjcf, more, tmp_path).left_out
    assert {
        "1 x tendon", "4 x armature of a joint (inertia of a rotor)", "4 x dry friction of a joint",
        "7 x contact of a geom", "3 x range without stops (see stop_stiffness)",
    } == set(left_out)  # fmt: skip
