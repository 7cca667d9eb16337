"""The gunner to look at: segments meet at his joints, wheels turn, and members keep their ends."""

import numpy as np
import pytest

from studies.gunner.restraints.model import restraint
from workbench.motion.frames import Motion, rotate
from workbench.motion.framing import subject

ROUNDING = 1e-9


@pytest.fixture(scope="module")
def made():
    model = restraint(t_end=0.1)
    density = np.zeros(model.members)
    density[[3, 40, 200]] = 1.0, 0.5, 0.8
    return model, density, model.motion({"without": np.zeros(model.members), "held": density}, {})


def body(motion, name):
    return next(k for k, shape in enumerate(motion.runs[1].bodies) if shape.name == name)


def test_all_of_him_and_the_vehicle_are_drawn(made):
    _, _, motion = made
    shapes = motion.runs[0].bodies
    assert sum(shape.role in ("occupant", "head") for shape in shapes) == 17
    assert sum(shape.role == "wheel" for shape in shapes) == 4
    assert {"hull", "cab", "hatch ring", "seat", "left bar", "right bar"} <= {shape.name for shape in shapes}
    document = motion.to_dict()
    again = Motion.from_dict(document)
    assert [m.name for m in again.runs[1].members] == [m.name for m in motion.runs[1].members]
    assert again.to_dict()["runs"][1]["members"] == document["runs"][1]["members"]


def test_segments_meet_at_the_joints(made):
    _, _, motion = made
    run = motion.runs[1]
    for frame in (0, len(motion.times) - 1):

        def end(name, side, frame=frame):
            k = body(motion, name)
            radius, length = run.bodies[k].size
            reach = [0.0, 0.0, side * (0.5 * length + 0.5 * radius)]  # the axis from joint to joint
            return run.poses[frame, k, :3] + rotate(run.poses[frame, k, 3:], reach)

        for upper, lower in (("left thigh", "left shank"), ("right upper arm", "right forearm")):
            assert end(upper, 1.0) == pytest.approx(end(lower, -1.0), abs=ROUNDING)


def test_wheels_turn_and_roll_on(made):
    _, _, motion = made
    run, k = motion.runs[0], body(motion, "front left wheel")
    driven = run.poses[-1, k, 0] - run.poses[0, k, 0]
    spoke = [rotate(run.poses[frame, k, 3:], [1.0, 0.0, 0.0]) for frame in range(len(motion.times))]
    turned = np.unwrap([np.arctan2(-s[2], s[0]) for s in spoke])
    assert driven > 1.0
    assert turned[-1] - turned[0] == pytest.approx(driven / 0.46, rel=0.05)  # no slip to speak of


def test_members_keep_their_ends_and_forces(made):
    model, density, motion = made
    run = motion.runs[1]
    system = model.system({})
    assert [member.kind for member in run.members] == ["belt", "belt", "airbag"]
    assert [member.density for member in run.members] == [1.0, 0.5, 0.8]
    ends = system.member_ends()
    for i, k in enumerate(np.flatnonzero(density)):
        assert run.segments(0)[i, 0] == pytest.approx(ends.point_a[k], abs=1e-6)
        assert run.segments(0)[i, 1] == pytest.approx(ends.point_b[k], abs=1e-6)
    assert run.forces.shape == (len(motion.times), 3)
    assert motion.runs[0].forces is None


def test_he_is_framed(made):
    _, _, motion = made
    middle, radius = subject(motion.runs[1], len(motion.times) - 1)
    assert 0.9 <= radius < 1.3
    assert middle[2] == pytest.approx(1.7, abs=0.3)
