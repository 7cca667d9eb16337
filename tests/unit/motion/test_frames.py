"""Motions and their stills: contract, geometry, hidden surfaces, bytes."""

import base64
import io
import json
import zlib
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import image as matplotlib_image

from tests.sample_motion import sample_motion
from workbench.errors import StudyError
from workbench.motion.frames import (
    Body,
    History,
    Member,
    Motion,
    MotionRun,
    planar_poses,
    rotate,
)
from workbench.motion.meshes import cylinder, prism, ring, volume
from workbench.motion.packing import (
    STEPS,
    in_six,
    packed,
    packed_in_steps,
    unpacked_from_steps,
    with_quaternions,
)
from workbench.motion.stills import (
    Camera,
    camera_of,
    member_shapes,
    png,
    project,
    still,
)


def test_a_motion_comes_back_from_its_document():
    motion = sample_motion()
    back = Motion.from_dict(json.loads(json.dumps(motion.to_dict(), allow_nan=False)))
    assert [run.label for run in back.runs] == ["before", "after"]
    assert back.runs[1].bodies == motion.runs[1].bodies
    assert back.runs[1].members == motion.runs[1].members
    for run, other in zip(motion.runs, back.runs, strict=True):
        half_a_step = np.ptp(run.poses[..., :3], axis=0) / STEPS / 2
        written = np.spacing(
            np.abs(run.poses[..., :3]).max(axis=0).astype(np.float32)
        )  # as the page has them
        off = np.abs(other.poses[..., :3] - run.poses[..., :3])
        assert (off <= (1 + 1e-5) * half_a_step + written).all()
        alike = np.abs((other.poses[..., 3:] * run.poses[..., 3:]).sum(axis=-1))
        assert (2 * np.arccos(np.minimum(alike, 1.0))).max() < 1e-4  # rad between them
    np.testing.assert_allclose(
        back.histories[0].series["after"], motion.histories[0].series["after"], rtol=1e-5
    )


def test_forces_meshes_and_cases_come_back():
    motion = sample_motion()
    before, after = motion.runs
    points, triangles = cylinder(0.4, 0.2)
    wheel = Body(name="wheel", shape="mesh", role="wheel", vertices=points, triangles=triangles)
    bodies = (*after.bodies[:-1], wheel)
    forces = 900.0 * np.sin(4.0 * motion.times[:, None] * np.arange(1, 6))
    runs = (
        replace(before, case="nominal"), replace(after, case="nominal", bodies=bodies, forces=forces),
        replace(after, case="worst", bodies=bodies),
    )  # fmt: skip
    history = replace(motion.histories[0], case="nominal")
    document = replace(motion, runs=runs, histories=(history,)).to_dict()
    assert len(document["meshes"]) == 1
    back = Motion.from_dict(json.loads(json.dumps(document)))
    assert back.cases == ("nominal", "worst")
    assert back.runs[2].bodies == bodies
    assert np.abs(back.runs[1].forces - forces).max() <= 1800.0 / STEPS
    assert back.runs[0].forces is None
    assert back.histories[0].case == "nominal"


def test_turns_come_back_equally_exact_wherever_they_are():
    """Half turns too, where w is nothing; what is left is half a step of numbers between -1 and 1."""
    turns = np.random.default_rng(5).normal(size=(4000, 4))
    turns[:2000, 0] *= 1e-3
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    six = in_six(np.concatenate([np.zeros((4000, 3)), turns], axis=1))
    back = with_quaternions(unpacked_from_steps(packed_in_steps(six)))[:, 3:]
    back /= np.linalg.norm(back, axis=1, keepdims=True)
    apart = np.linalg.norm(back - np.sign((back * turns).sum(axis=1, keepdims=True)) * turns, axis=1)
    assert 2 * apart.max() < 2e-4  # rad


def test_a_document_with_whole_quaternions_is_still_read():
    motion = sample_motion()
    document = motion.to_dict()
    for kept, run in zip(document["runs"], motion.runs, strict=True):
        kept["poses"] = packed_in_steps(run.poses.reshape(len(run.poses), -1))
    back = Motion.from_dict(document)
    np.testing.assert_allclose(back.runs[1].poses, motion.runs[1].poses, atol=1e-4)


def test_bodies_and_members_are_written_once_for_all_cases_of_a_layout():
    motion = sample_motion()
    runs = tuple(replace(run, case=case) for case in ("nominal", "worst") for run in motion.runs)
    document = replace(motion, runs=runs).to_dict()
    layouts = len({run.members for run in motion.runs})
    assert (len(document["members"]), len(document["bodies"])) == (
        layouts, len({run.bodies for run in motion.runs}),
    )  # fmt: skip
    assert [run.members for run in Motion.from_dict(document).runs] == [run.members for run in runs]


@pytest.mark.parametrize("rows", [1, 2, 300])
def test_steps_come_back_whatever_a_column_does(rows):
    """Constant, smooth, noisy, far from zero, with both ends from one row to the next."""
    t, rng = np.linspace(0.0, 1.0, rows), np.random.default_rng(3)
    table = np.stack(
        [
            0.0 * t + 7.0,
            np.sin(9 * t),
            rng.normal(size=rows),
            5e4 + t,
            1e3 * (np.arange(rows) % 2),
            -3e-9 * t,
        ],
        axis=1,
    )
    document = json.loads(json.dumps(packed_in_steps(table)))
    off = np.abs(unpacked_from_steps(document) - table)
    assert (off <= (0.5 + 1e-5) * np.ptp(table, axis=0) / STEPS + 1.2e-7 * np.abs(table).max(axis=0)).all()


def test_plain_steps_of_before_are_still_read():
    steps = base64.b64encode(np.array([[0, 0], [65535, 0]], dtype="<u2").tobytes()).decode()
    document = {"low": [1.0, 5.0], "step": [2.0 / 65535, 0.0], "steps": steps}
    np.testing.assert_allclose(unpacked_from_steps(document), [[1.0, 5.0], [3.0, 5.0]])


def test_a_document_with_plain_poses_is_still_read():
    motion = sample_motion()
    document = motion.to_dict()
    for kept, run in zip(document["runs"], motion.runs, strict=True):
        kept["poses"] = packed(run.poses)
        kept |= {key: document[key][kept[key]] for key in ("bodies", "members")}
        del kept["forces"], kept["case"]
        for body in kept["bodies"]:
            body.pop("mesh", None)
    del document["meshes"], document["bodies"], document["members"]
    back = Motion.from_dict(document)
    np.testing.assert_allclose(back.runs[1].poses, motion.runs[1].poses, atol=1e-6)


def test_planar_turns_look_as_they_are_given():
    pose = planar_poses([[0.0]], [[0.0]], [[np.pi / 2]])[0, 0]
    # a quarter turn counter-clockwise in the plane takes x to y, which is the scene's z
    np.testing.assert_allclose(rotate(pose[3:], [1.0, 0, 0]), [0, 0, 1], atol=1e-12)


def test_members_follow_their_bodies():
    run = sample_motion().runs[1]
    start, later = run.segments(0), run.segments(60)
    moved = later - start
    assert np.abs(moved[2, 0]).max() > 0.05  # the end on the torso
    np.testing.assert_array_equal(later[2, 1], [1.2, 0.0, 1.2])  # the end on the ground


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda m: replace(m, times=m.times[::-1]), "times of a motion need to increase"),
        (lambda m: replace(m, runs=()), "needs at least one run and one time"),
        (lambda m: _poses(m, m.runs[0].poses[:5]), "need shape .76, 10, 7."),
        (lambda m: _poses(m, m.runs[0].poses * np.nan), "hold NaN or infinity"),
        (lambda m: _poses(m, m.runs[0].poses * 2), "need unit length"),
        (lambda m: _fewer_bodies(m), "names a body that run 'after'"),
        (lambda m: _forces(m, np.zeros((76, 2))), "forces of run 'after' need shape .76, 5."),
        (lambda m: _forces(m, np.full((76, 5), np.nan)), "and finite values"),
        (lambda m: replace(m, histories=(replace(m.histories[0], series={"before": m.times[:3]}),)),
         "'before' needs 76 values, got 3"),
    ],
)  # fmt: skip
def test_a_motion_that_cannot_be_shown_is_refused(change, message):
    with pytest.raises(StudyError, match=message):
        change(sample_motion())


def _poses(motion, poses):
    return replace(motion, runs=(replace(motion.runs[0], poses=poses),))


def _forces(motion, forces):
    return replace(motion, runs=(replace(motion.runs[1], forces=forces),))


def _fewer_bodies(motion):
    run = motion.runs[1]
    return replace(motion, runs=(replace(run, bodies=run.bodies[:2], poses=run.poses[:, :2]),))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Body(name="b", shape="ball", size=(1.0,)), "body 'b' needs shape 'capsule'"),
        (lambda: Body(name="b", shape="mesh"), "a mesh, and nothing else, has triangles over its vertices"),
        (lambda: Body(name="b", shape="mesh", vertices=((0, 0, 0),), triangles=((0, 1, 2),)), "1 vertices"),
        (lambda: Body(name="b", shape="box", size=(1.0, 1.0)), "or 'box' with three edges"),
        (lambda: Body(name="b", shape="capsule", size=(1.0, 1.0), role="hat"), "role is one of vehicle"),
        (lambda: _member(kind="rope"), "kind is one of belt, airbag, retractor, got 'rope'"),
        (lambda: _member(density=1.2), r"density lies in \[0, 1\], got 1.2"),
    ],
)
def test_wrong_bodies_and_members_are_named(make, message):
    with pytest.raises(StudyError, match=message):
        make()


def _member(**change):
    given = {"name": "m", "kind": "belt", "density": 0.5, "body_a": 0, "body_b": -1} | change
    return Member(point_a=(0, 0, 0), point_b=(0, 0, 1), **given)


# ---- stills -----------------------------------------------------------------------------------------------

EYE = Camera(eye=np.array([0.0, -10.0, 1.0]), target=np.array([0.0, 0.0, 1.0]), half_angle=0.2)


def scene(*bodies):
    """Bodies at rest at (y, height) places, seen along y."""
    poses = np.zeros((1, len(bodies), 7))
    poses[..., 3] = 1.0
    for k, (_, place) in enumerate(bodies):
        poses[0, k, :3] = place
    run = MotionRun(label="run", bodies=tuple(b for b, _ in bodies), poses=poses)
    return Motion(title="scene", times=np.array([0.0]), runs=(run,))


def test_projection_at_three_points():
    # half height is 10 tan(0.2) at the target's distance
    h = 10 * np.tan(0.2)
    at = project(EYE, np.array([[0, 0, 1.0], [h, 0, 1.0], [0, 10, 1 + 2 * h]]), width=640, height=400)
    np.testing.assert_allclose(at, [[320, 200], [520, 200], [320, 0]], atol=1e-9)


def test_a_sphere_covers_what_geometry_says():
    ball = Body(name="ball", shape="capsule", size=(0.5, 0.0), role="head")
    motion = scene((ball, (0.0, 0.0, 1.0)))
    empty = scene((replace(ball, size=(1e-4, 0.0)), (0.0, 0.0, 1.0)))
    with_ball = still(motion, camera=EYE, width=320, height=200, samples=1).astype(int)
    without = still(empty, camera=EYE, width=320, height=200, samples=1).astype(int)
    # the upper half alone, where no shadow falls; the cone that touches the sphere has sin = 0.5/10
    seen = (np.abs(with_ball - without)[:100].max(axis=2) > 10).sum()
    radius = np.tan(np.arcsin(0.05)) / np.tan(0.2) * 100
    assert seen == pytest.approx(np.pi * radius**2 / 2, rel=0.03)


@pytest.mark.parametrize("mesh", [cylinder(0.4, 0.2, sides=64), ring(0.4, 0.1, sides=64, around=32)])
def test_surfaces_are_closed_and_seen_from_outside(mesh):
    points, triangles = mesh
    edges = {(t[i], t[(i + 1) % 3]) for t in triangles for i in range(3)}
    assert len(edges) == 3 * len(triangles)
    assert {(b, a) for a, b in edges} == edges  # every edge is met once from either side
    exact = np.pi * 0.4**2 * 0.2 if len(points) == 128 else 2.0 * np.pi**2 * 0.4 * 0.05**2
    assert volume(points, triangles) == pytest.approx(exact, rel=0.01)  # positive: seen from outside


@pytest.mark.parametrize(
    ("outline", "message"),
    [([(0, 0), (1, 0)], "at least three points"), ([(0, 0), (0, 1), (1, 0)], "convex and anticlockwise")],
)
def test_an_outline_of_no_use_is_refused(outline, message):
    with pytest.raises(ValueError, match=message):
        prism(outline, 1.0)


@pytest.mark.parametrize("glass", [False, True])
def test_a_mesh_looks_as_the_box_that_it_is(glass):
    half = 0.5
    points, triangles = prism([(-half, -half), (half, -half), (half, half), (-half, half)], 2 * half)
    own = {"role": "seat", "see_through": glass}
    box = Body(name="box", shape="box", size=(1.0, 1.0, 1.0), **own)
    mesh = Body(name="box", shape="mesh", vertices=points, triangles=triangles, **own)
    seen = Camera(eye=np.array([4.0, -9.0, 4.0]), target=np.array([0.0, 0.0, 1.0]), half_angle=0.2)
    pictures = [still(scene((b, (0.0, 0.0, 1.0))), camera=seen, width=96, height=60) for b in (box, mesh)]
    apart = np.abs(pictures[0].astype(int) - pictures[1]).max(axis=2)
    assert (apart > 2).mean() < 0.005  # edges alone


def test_what_is_behind_is_hidden_in_either_order():
    near = (Body(name="near", shape="box", size=(1.0, 0.2, 1.0), role="wheel"), (0.0, -1.0, 1.0))
    far = (Body(name="far", shape="capsule", size=(0.3, 0.2), role="head"), (0.0, 1.0, 1.0))
    pictures = [
        still(scene(*order), camera=EYE, width=160, height=100) for order in ((near, far), (far, near))
    ]
    np.testing.assert_array_equal(*pictures)
    np.testing.assert_array_equal(
        pictures[0][40:60, 70:90], still(scene(near), camera=EYE, width=160, height=100)[40:60, 70:90]
    )


def test_a_see_through_body_lets_the_one_behind_show():
    cab = Body(name="cab", shape="box", size=(1.0, 0.2, 1.0), role="vehicle", see_through=True)
    head = (Body(name="head", shape="capsule", size=(0.2, 0.0), role="head"), (0.0, 1.0, 1.0))
    with_head = still(scene((cab, (0.0, -1.0, 1.0)), head), camera=EYE, width=160, height=100)
    alone = still(scene((cab, (0.0, -1.0, 1.0))), camera=EYE, width=160, height=100)
    assert (with_head[50, 80].astype(int) != alone[50, 80]).any()


def test_the_same_still_has_the_same_bytes():
    motion = sample_motion()
    first, second = (png(still(motion, run=1, time=0.9, width=96, height=60)) for _ in range(2))
    assert first == second
    assert first != png(still(motion, run=1, time=0.0, width=96, height=60))


def test_png_is_read_back_by_another_code():
    picture = still(sample_motion(), time=0.3, width=64, height=40)
    read = matplotlib_image.imread(io.BytesIO(png(picture)), format="png")
    np.testing.assert_array_equal((read[..., :3] * 255).round().astype(np.uint8), picture)


def test_a_still_takes_the_shorter_of_two_filters():
    rng = np.random.default_rng(5)
    slope = np.add.outer(np.arange(40), np.arange(64))[..., None] * np.array([1, 2, 3]) % 256
    few = rng.choice([20, 200], (40, 64, 3))
    sizes = []
    for picture in (slope.astype(np.uint8), few.astype(np.uint8)):
        text = png(picture)
        at = text.index(b"IDAT") + 4
        lines = zlib.decompress(text[at : at + int.from_bytes(text[at - 8 : at - 4], "big")])
        sizes.append(lines[0])
        read = matplotlib_image.imread(io.BytesIO(text), format="png")
        np.testing.assert_array_equal((read[..., :3] * 255).round().astype(np.uint8), picture)
    assert sizes == [1, 0]


def test_members_are_written_as_exactly_as_one_can_see():
    motion = sample_motion()
    (first, *rest), run = motion.runs[1].members, motion.runs[1]
    members = (replace(first, density=1 / 3, point_a=(np.pi, 0.1, -1e-7 / 3)), *rest)
    document = replace(motion, runs=(motion.runs[0], replace(run, members=members))).to_dict()
    written = document["members"][1][0]
    assert (written["density"], written["point_a"]) == (0.3333333, [3.141593, 0.1, -3.333333e-08])


def test_kinds_of_members_differ_in_form():
    a, b = np.zeros(3), np.array([0.0, 0.0, 1.0])
    forms = {kind: member_shapes(kind, 0.5, a, b) for kind in ("belt", "airbag", "retractor")}
    assert [len(shapes) for shapes in forms.values()] == [1, 8, 7]
    assert forms["airbag"][1].radius > 3 * forms["airbag"][0].radius  # beads on a thread
    covered = sum(np.linalg.norm(s.b - s.a) for s in forms["retractor"])
    assert covered == pytest.approx(0.55)  # dashes
    assert member_shapes("belt", 1.0, a, b)[0].radius > member_shapes("belt", 0.1, a, b)[0].radius


def test_cameras_see_the_whole_motion():
    motion = sample_motion()
    points = motion.runs[0].poses[:, :, :3].reshape(-1, 3)
    for preset in ("side", "front", "rear", "top", "corner"):
        at = project(camera_of(motion, preset), points, width=480, height=300)
        assert ((at > 0) & (at < [480, 300])).all()
    follow = camera_of(motion, "side", follow=1, frame=60)
    np.testing.assert_allclose(
        project(follow, motion.runs[0].poses[60, 1:2, :3], width=480, height=300), [[240, 150]], atol=1e-9
    )


@pytest.mark.parametrize(
    ("series", "limit", "height"),
    [
        ({"without": [0.0, 11.5], "nominal": [0.2, 0.1], "robust": [0.0, 0.13]}, None, 0.3),
        ({"without": [0.0, 11.5], "robust": [0.0, 0.13]}, 1.0, 1.0),
        ({"without": [0.0, 0.5], "robust": [0.0, 0.13]}, None, 0.5),
        ({"without": [0.0, 0.5], "robust": [0.0, 0.13]}, 0.8, 0.8),  # the limit is drawn, too
        ({"alone": [0.0, 11.5]}, None, 11.5),
        ({"still": [0.0, 0.0], "moves": [0.0, 2.0]}, None, 2.0),
    ],
)
def test_a_run_that_leaves_the_others_far_behind_is_cut_off(series, limit, height):
    values = {label: np.array(v) for label, v in series.items()}
    assert History(name="deviation", unit="m", series=values, limit=limit).drawn_to == pytest.approx(height)
