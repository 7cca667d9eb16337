"""A made-up motion: an occupant of six segments on a seat in a braking cab, held by members or not."""

from dataclasses import replace

import numpy as np

from workbench.motion.frames import (
    Body,
    History,
    Member,
    Motion,
    MotionRun,
    planar_poses,
    rotate,
    side_by_side,
)
from workbench.motion.meshes import cylinder

TIMES = np.linspace(0.0, 1.5, 76)
SEGMENTS = [  # name, offset from the hip, angle from upright, (radius, length), role
    ("pelvis", (0.0, 0.0), 0.1, (0.11, 0.12), "occupant"),
    ("torso", (0.03, 0.32), 0.08, (0.13, 0.30), "occupant"),
    ("head", (0.08, 0.66), 0.0, (0.10, 0.06), "head"),
    ("thigh", (0.22, 0.02), 1.45, (0.075, 0.34), "occupant"),
    ("shank", (0.44, -0.20), 0.1, (0.055, 0.34), "occupant"),
    ("arm", (0.26, 0.38), 1.1, (0.045, 0.42), "occupant"),
]
FIXED = [
    ("floor", (0.4, -0.52), (1.9, 1.1, 0.06), "vehicle", False),
    ("back", (-0.35, 0.15), (0.10, 0.5, 0.8), "seat", False),
    ("seat", (0.0, -0.22), (0.55, 0.5, 0.12), "seat", False),
    ("cab", (0.4, 0.2), (2.0, 1.15, 1.5), "vehicle", True),
]


def sample_motion() -> Motion:
    runs = (_run("before", slide=0.55, members=()), _run("after", slide=0.12, members=_members()))
    series = {run.label: np.linalg.norm(run.poses[:, 1, :3] - run.poses[0, 1, :3], axis=1) for run in runs}
    speed = {label: np.gradient(values, TIMES) for label, values in series.items()}
    return Motion(
        title="braking, made up",
        times=TIMES,
        runs=runs,
        histories=(
            History(name="deviation of the torso", unit="m", series=series, limit=0.3),
            History(name="speed of the torso", unit="m/s", series=speed),
        ),
        storyboard=(0.0, 0.5, 0.9, 1.4),
    )


def sample_film() -> Motion:
    """The same cab driven forth and rolled, on wheels, in two cases and with the forces of the members."""
    shown = sample_motion()
    drive = np.stack([9.0 * TIMES - 2.0 * TIMES**2, 0.0 * TIMES, 0.3 * TIMES**2], axis=1)
    roll = np.pi / 3 * (TIMES / TIMES[-1]) ** 2
    turn = np.stack([np.cos(roll / 2), np.sin(roll / 2), 0.0 * roll, 0.0 * roll], axis=1)
    points, triangles = cylinder(0.3, 0.2)
    wheel = Body(name="wheel", shape="mesh", role="wheel", vertices=points, triangles=triangles)

    def driven(run: MotionRun, thrown: float) -> MotionRun:
        away = np.zeros((len(TIMES), len(run.bodies), 3))
        away[:, : len(SEGMENTS), 0] = thrown * TIMES[:, None] ** 2  # the occupant alone
        place = drive[:, None] + rotate(turn[:, None], run.poses[..., :3] + away)
        hub = drive + rotate(turn, [0.4, -0.6, 0.3])
        poses = np.concatenate([place, _product(turn[:, None], run.poses[..., 3:])], axis=2)
        poses = np.concatenate([poses, np.concatenate([hub, turn], axis=1)[:, None]], axis=1)
        pull = 900.0 * np.clip(TIMES - 0.3, 0.0, None)[:, None] * np.arange(1, len(run.members) + 1)
        return replace(run, poses=poses, bodies=(*run.bodies, wheel), forces=pull if run.members else None)

    return side_by_side(
        {
            name: replace(shown, runs=tuple(driven(run, thrown) for run in shown.runs))
            for name, thrown in (("the worst case", 6.0), ("the nominal case", 0.0))
        }
    )


def _product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Of quaternions (..., 4)."""
    w, u = a[..., :1], a[..., 1:]
    s, v = b[..., :1], b[..., 1:]
    u, v = np.broadcast_arrays(u, v)
    real = w * s - (u * v).sum(axis=-1, keepdims=True)
    return np.concatenate([real, w * v + s * u + np.cross(u, v)], axis=-1)


def _run(label: str, *, slide: float, members: tuple[Member, ...]) -> MotionRun:
    s = np.clip(TIMES - 0.3, 0, None)
    forward = slide * (1 - np.cos(np.clip(s * 2.6, 0, np.pi))) / 2 * 1.6
    lean = -forward * 0.9
    x, y, angle, bodies = [], [], [], []
    for name, (dx, dy), tilt, size, role in SEGMENTS:
        x.append(0.1 + forward + dx * np.cos(lean) - dy * np.sin(lean))
        y.append(0.75 + dx * np.sin(lean) + dy * np.cos(lean))
        angle.append(lean - tilt)
        bodies.append(Body(name=name, shape="capsule", size=size, role=role))
    for name, (dx, dy), size, role, glass in FIXED:
        x.append(np.full(len(TIMES), dx))
        y.append(np.full(len(TIMES), 0.75 + dy))
        angle.append(np.zeros(len(TIMES)))
        bodies.append(Body(name=name, shape="box", size=size, role=role, see_through=glass))
    poses = planar_poses(np.stack(x, 1), np.stack(y, 1), np.stack(angle, 1))
    return MotionRun(label=label, bodies=tuple(bodies), poses=poses, members=members)


def _members() -> tuple[Member, ...]:
    torso, back, floor = 1, 7, 6
    return (
        Member(name="B1", kind="belt", density=1.0, body_a=torso, point_a=(0.1, 0.1, 0.1), body_b=back,
               point_b=(0.0, 0.2, 0.35)),
        Member(name="B2", kind="belt", density=0.4, body_a=torso, point_a=(0.1, -0.1, -0.1), body_b=back,
               point_b=(0.0, -0.2, -0.2)),
        Member(name="A1", kind="airbag", density=0.8, body_a=torso, point_a=(0.13, 0, 0.05), body_b=-1,
               point_b=(1.2, 0.0, 1.2)),
        Member(name="R1", kind="retractor", density=0.7, body_a=torso, point_a=(0, -0.13, -0.1), body_b=floor,
               point_b=(-0.6, -0.5, 0.0)),
        Member(name="B3", kind="belt", density=0.01, body_a=0, point_a=(0, 0, 0), body_b=floor,
               point_b=(0, 0, 0)),
    )  # fmt: skip
