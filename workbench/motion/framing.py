"""What a picture of a motion has to show, and the camera that shows it.

Where there is an occupant, a picture holds all of him and the place in the vehicle where he began, in any
frame: however far a vehicle drives and wherever he flies. The viewer of the report frames its views by the
same rule (`workbench/report/page/viewer/camera.js`).
"""

import numpy as np
from numpy.typing import NDArray

from workbench.motion.frames import Body, Motion, MotionRun, rotate
from workbench.motion.stills import CAMERAS, Camera, camera_of

__all__ = ["camera_on_occupant", "subject"]

Array = NDArray[np.float64]

LEAST = 0.9  # m, the smallest radius of what is framed
MARGIN = 1.04
HALF_ANGLE = 0.25  # rad, of the vertical field of view
APART = 1.6  # times its own radius: who is thrown out makes the pictures of the others no smaller than that


def subject(run: MotionRun, frame: int) -> tuple[Array, float] | None:
    """Middle (3,) and radius of a ball about the occupant and the place where he began; None without one."""
    now = _occupant(run, frame)
    if not len(now):
        return None
    home = _occupant(run, 0)
    vehicle = next((k for k, body in enumerate(run.bodies) if body.role == "vehicle"), None)
    if vehicle is not None:  # he began there in the vehicle, which has moved on
        before, after = run.poses[0, vehicle], run.poses[frame, vehicle]
        back = before[3:] * (1.0, -1.0, -1.0, -1.0)
        home = after[:3] + rotate(after[3:], rotate(back, home - before[:3]))
    points = np.vstack([now, home])
    low, high = points.min(axis=0), points.max(axis=0)
    return (low + high) / 2, max(LEAST, float(np.linalg.norm(high - low)) / 2)


def camera_on_occupant(motion: Motion, frame: int, *, run: int = 0, preset: str = "corner") -> Camera:
    """The camera of a frame, at one scale for all runs of a case while they stay near each other; that of
    the whole motion without occupants.

    preset: a key of `CAMERAS`.
    """
    shown = motion.runs[run]
    mine = subject(shown, frame)
    if mine is None:
        return camera_of(motion, preset)
    beside = [subject(other, frame) for other in motion.runs if other.case == shown.case]
    radius = min(max(ball[1] for ball in beside if ball is not None), APART * mine[1])
    direction = np.array(CAMERAS[preset])
    target = mine[0]
    eye = target + direction / np.linalg.norm(direction) * MARGIN * radius / np.sin(HALF_ANGLE)
    eye[2] = max(eye[2], 0.05)
    return Camera(eye=eye, target=target, half_angle=HALF_ANGLE)


def _occupant(run: MotionRun, frame: int) -> Array:
    """Points (n, 3) whose hull holds the occupant in a frame."""
    found = [
        run.poses[frame, k, :3] + rotate(run.poses[frame, k, 3:], _outline(body))
        for k, body in enumerate(run.bodies)
        if body.role in ("occupant", "head")
    ]
    return np.vstack(found) if found else np.empty((0, 3))


def _outline(body: Body) -> Array:
    """Points whose hull holds a shape, in its own axes."""
    if body.shape == "mesh":
        return np.array(body.vertices)
    signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
    if body.shape == "box":
        return np.asarray(signs * np.array(body.size) / 2)
    radius, length = body.size
    sides = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)], dtype=float)
    caps = []
    for end in (-1.0, 1.0):
        cap = np.vstack([radius * sides, [(0.0, 0.0, end * radius)]])
        caps.append(cap + np.array([0.0, 0.0, end * length / 2]))
    return np.vstack(caps)
