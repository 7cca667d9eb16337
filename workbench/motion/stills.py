"""Stills of a motion without OpenGL: every pixel's ray against every shape, nearest hit wins.

    still(motion, run=0, time=0.4)            an image (height, width, 3) of uint8
    png(image)                                its PNG bytes, the same every time

Rays come from a pinhole camera; capsules, boxes and triangles of meshes are hit in closed form, so outlines
are exact and hidden surfaces right. Each shape is looked at only inside the rectangle it covers on screen.
Shadows fall on the ground z = 0 along the light. Kinds of members differ in form as well as colour, so that
a grey print tells them apart: a belt is a plain line, an airbag a row of beads, a retractor dashes; thickness
is density.
"""

import struct
import zlib
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workbench.motion.frames import (
    Body,
    Motion,
    MotionRun,
    frame_at,
    rotate,
)
from workbench.motion.ray_hits import EPSILON, hit_box, hit_capsule, hit_triangle

__all__ = ["CAMERAS", "Camera", "camera_of", "member_shapes", "png", "project", "still"]

Array = NDArray[np.float64]

COLOURS = {
    "vehicle": (0.62, 0.66, 0.70), "occupant": (0.86, 0.72, 0.55), "head": (0.86, 0.72, 0.55),
    "seat": (0.45, 0.50, 0.55), "wheel": (0.25, 0.27, 0.30), "other": (0.70, 0.70, 0.66),
    "belt": (0.835, 0.369, 0.0), "airbag": (0.0, 0.447, 0.698), "retractor": (0.45, 0.34, 0.02),
}  # fmt: skip
LIGHT = np.array([-0.35, -0.45, 0.82]) / np.linalg.norm([-0.35, -0.45, 0.82])
SKY, GROUND, GRID_LINE = (
    np.array([0.955, 0.965, 0.975]),
    np.array([0.90, 0.91, 0.92]),
    np.array([0.80, 0.82, 0.84]),
)
AMBIENT, SHADOW = 0.45, 0.72
THINNEST, THICKEST = 0.004, 0.016  # m, radius of a member at density 0 and 1
SEE_THROUGH = 0.3
SHOWN = 0.01  # members of less density are too thin to see
SAMPLES = 2  # a side of the block of rays per pixel

# direction from the target to the eye
CAMERAS = {
    "side": (0.0, -1.0, 0.12), "front": (1.0, 0.0, 0.15), "rear": (-1.0, 0.0, 0.15), "top": (0.0, -0.02, 1.0),
    "corner": (0.6, -1.0, 0.45),
}  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Camera:
    """A pinhole at `eye` looking at `target`; `half_angle` (rad) is half the vertical field of view."""

    eye: Array
    target: Array
    half_angle: float = 0.25

    def axes(self) -> tuple[Array, Array, Array]:
        """Right, up and forward, orthonormal."""
        forward = (self.target - self.eye) / np.linalg.norm(self.target - self.eye)
        right = np.cross(forward, [0.0, 0.0, 1.0])
        right /= np.linalg.norm(right)
        return right, np.cross(right, forward), forward


@dataclass(frozen=True, slots=True, kw_only=True)
class Placed:
    """A shape in the scene: a capsule between `a` and `b`, a box with centre `a`, or a triangle.

    A triangle is seen from the side from which its corners (3, 3) run anticlockwise.
    """

    colour: tuple[float, float, float]
    a: Array
    b: Array
    radius: float
    quaternion: Array | None = None
    half: Array | None = None
    opacity: float = 1.0
    corners_of_triangle: Array | None = None

    def corners(self) -> Array:
        """Points whose hull holds the shape, (k, 3)."""
        if self.corners_of_triangle is not None:
            return self.corners_of_triangle
        if self.half is not None and self.quaternion is not None:
            signs = np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
            return self.a + rotate(self.quaternion, signs * self.half)
        cube = self.radius * np.array(np.meshgrid(*[[-1.0, 1.0]] * 3)).reshape(3, -1).T
        return np.vstack([self.a + cube, self.b + cube])


def camera_of(motion: Motion, preset: str = "side", *, follow: int | None = None, frame: int = 0) -> Camera:
    """A camera that sees the whole motion of all runs, or follows one body.

    preset: a key of `CAMERAS`.   follow: position of a body in the first run that stays in the middle.
    """
    points = np.concatenate([run.poses[:, :, :3].reshape(-1, 3) for run in motion.runs])
    if follow is not None:
        place = motion.runs[0].poses[frame, follow, :3]
        points = points[np.linalg.norm(points - place, axis=1) < 2.5]
    low, high = points.min(axis=0), points.max(axis=0)
    target = (low + high) / 2 if follow is None else motion.runs[0].poses[frame, follow, :3].copy()
    size = max(0.6, float(np.linalg.norm(high - low)) / 2 + 0.4)
    half_angle = 0.25
    direction = np.array(CAMERAS[preset])
    eye = target + direction / np.linalg.norm(direction) * size / np.tan(half_angle)
    eye[2] = max(eye[2], 0.2)
    return Camera(eye=eye, target=target, half_angle=half_angle)


def project(camera: Camera, points: Array, *, width: int, height: int) -> Array:
    """Pixel coordinates (n, 2) of points (n, 3), x to the right and y down; behind the eye is NaN.

    >>> camera = Camera(eye=np.array([0.0, -4.0, 1.0]), target=np.array([0.0, 0.0, 1.0]))
    >>> project(camera, np.array([[0.0, 0.0, 1.0]]), width=640, height=400).tolist()
    [[320.0, 200.0]]
    """
    right, up, forward = camera.axes()
    away = np.asarray(points, dtype=float) - camera.eye
    depth = away @ forward
    scale = height / 2 / np.tan(camera.half_angle) / np.where(depth > EPSILON, depth, np.nan)
    return np.column_stack([width / 2 + scale * (away @ right), height / 2 - scale * (away @ up)])


def still(
    motion: Motion,
    *,
    run: int = 0,
    time: float = 0.0,
    camera: Camera | None = None,
    width: int = 480,
    height: int = 300,
    samples: int = SAMPLES,
) -> NDArray[np.uint8]:
    """The scene of one run at one time, (height, width, 3) of uint8; `samples`^2 rays per pixel."""
    frame = frame_at(motion.times, time)
    camera = camera_of(motion) if camera is None else camera
    shapes = _body_shapes(motion.runs[run], frame) + _all_member_shapes(motion.runs[run], frame)
    w, h = width * samples, height * samples
    right, up, forward = camera.axes()
    tangent = np.tan(camera.half_angle)
    px = (np.arange(w) + 0.5 - w / 2) / (h / 2) * tangent
    py = -(np.arange(h) + 0.5 - h / 2) / (h / 2) * tangent
    rays = forward + px[None, :, None] * right + py[:, None, None] * up
    rays /= np.linalg.norm(rays, axis=2, keepdims=True)
    colour, depth = _background(camera, rays)
    _shadows(camera, shapes, rays, colour, depth)
    solid = [s for s in shapes if s.opacity == 1.0]
    glass = [s for s in shapes if s.opacity < 1.0]
    for shape in [*solid, *glass]:
        _draw(camera, shape, rays, colour, depth)
    block = colour.reshape(height, samples, width, samples, 3).mean(axis=(1, 3))
    return np.asarray((np.clip(block, 0, 1) * 255 + 0.5).astype(np.uint8))


def _body_shapes(run: MotionRun, frame: int) -> list[Placed]:
    return [shape for k, body in enumerate(run.bodies) for shape in _placed(body, run.poses[frame, k])]


def _placed(body: Body, pose: Array) -> list[Placed]:
    colour = COLOURS[body.role]
    opacity = SEE_THROUGH if body.see_through else 1.0
    if body.shape == "box":
        half = np.array(body.size) / 2
        box = Placed(
            colour=colour, a=pose[:3], b=pose[:3], radius=float(np.linalg.norm(half)), quaternion=pose[3:],
            half=half, opacity=opacity,
        )  # fmt: skip
        return [box]
    if body.shape == "mesh":
        points = pose[:3] + rotate(pose[3:], np.array(body.vertices))
        return [
            Placed(
                colour=colour, a=corners[0], b=corners[0], radius=0.0, opacity=opacity,
                corners_of_triangle=corners,
            )
            for corners in points[np.array(body.triangles)]
        ]  # fmt: skip
    radius, length = body.size
    axis = rotate(pose[3:], [0.0, 0.0, length / 2])
    return [Placed(colour=colour, a=pose[:3] - axis, b=pose[:3] + axis, radius=radius, opacity=opacity)]


def _all_member_shapes(run: MotionRun, frame: int) -> list[Placed]:
    out: list[Placed] = []
    for member, (a, b) in zip(run.members, run.segments(frame), strict=True):
        if member.density >= SHOWN:
            out += member_shapes(member.kind, member.density, a, b)
    return out


def member_shapes(kind: str, density: float, a: Array, b: Array) -> list[Placed]:
    """What a member looks like between its ends: a line, beads or dashes."""
    radius = THINNEST + density * (THICKEST - THINNEST)
    colour = COLOURS[kind]
    if kind == "belt":
        return [Placed(colour=colour, a=a, b=b, radius=radius)]
    pieces = 7
    if kind == "airbag":
        middles = [a + (b - a) * (k + 0.5) / pieces for k in range(pieces)]
        thread = Placed(colour=colour, a=a, b=b, radius=radius / 3)
        return [thread, *(Placed(colour=colour, a=m, b=m, radius=2 * radius) for m in middles)]
    dashes = [(a + (b - a) * k / pieces, a + (b - a) * (k + 0.55) / pieces) for k in range(pieces)]
    return [Placed(colour=colour, a=start, b=end, radius=radius) for start, end in dashes]


def _background(camera: Camera, rays: Array) -> tuple[Array, Array]:
    """Sky and ground with a grid of 0.5 m; colour (h, w, 3) and distance along the ray (h, w)."""
    down = rays[..., 2]
    hit = down < -1e-6
    distance = np.where(hit, -camera.eye[2] / np.where(hit, down, -1.0), np.inf)
    colour = np.broadcast_to(SKY, rays.shape).copy()
    reach = distance[hit]
    x = camera.eye[0] + reach * rays[hit, 0]
    y = camera.eye[1] + reach * rays[hit, 1]
    width = 0.006 + 0.0012 * reach
    line = np.minimum(np.abs((x + 0.25) % 0.5 - 0.25), np.abs((y + 0.25) % 0.5 - 0.25)) < width
    ground = np.where(line[:, None], GRID_LINE, GROUND)
    fade = np.exp(-np.maximum(reach - 8.0, 0.0) / 8.0)[:, None]
    colour[hit] = fade * ground + (1 - fade) * SKY
    return colour, distance


def _window(camera: Camera, points: Array, shape: tuple[int, int]) -> tuple[slice, slice] | None:
    """Rows and columns of the screen that may show the hull of points."""
    h, w = shape
    at = project(camera, points, width=w, height=h)
    if np.isnan(at).any():
        return slice(0, h), slice(0, w)
    (left, top), (right, bottom) = np.floor(at.min(axis=0)) - 1, np.ceil(at.max(axis=0)) + 2
    rows = slice(int(np.clip(top, 0, h)), int(np.clip(bottom, 0, h)))
    columns = slice(int(np.clip(left, 0, w)), int(np.clip(right, 0, w)))
    return None if rows.start >= rows.stop or columns.start >= columns.stop else (rows, columns)


def _draw(camera: Camera, shape: Placed, rays: Array, colour: Array, depth: Array) -> None:
    window = _window(camera, shape.corners(), (rays.shape[0], rays.shape[1]))
    if window is None:
        return
    ray = rays[window]
    distance, normal = _hit(shape, np.broadcast_to(camera.eye, ray.shape), ray)
    nearer = distance < depth[window]
    if not nearer.any():
        return
    facing = np.abs(normal[nearer] @ LIGHT) * 0.35 + np.maximum(normal[nearer] @ LIGHT, 0) * 0.65
    shade = (AMBIENT + (1 - AMBIENT) * facing)[:, None] * np.array(shape.colour)
    part = colour[window]
    part[nearer] = shape.opacity * shade + (1 - shape.opacity) * part[nearer]
    colour[window] = part
    if shape.opacity == 1.0:
        behind = depth[window]
        behind[nearer] = distance[nearer]
        depth[window] = behind


def _shadows(camera: Camera, shapes: list[Placed], rays: Array, colour: Array, depth: Array) -> None:
    """Darken the ground, once, where any shape stands between it and the light."""
    dark = np.zeros(depth.shape, dtype=bool)
    for shape in shapes:
        if shape.opacity < 1.0:
            continue
        corners = shape.corners()
        fallen = corners - LIGHT * (corners[:, 2:] / LIGHT[2])
        window = _window(camera, fallen, (rays.shape[0], rays.shape[1]))
        if window is None:
            continue
        open_ground = np.isfinite(depth[window]) & ~dark[window]
        if not open_ground.any():
            continue
        at = camera.eye + depth[window][open_ground][:, None] * rays[window][open_ground]
        at[:, 2] = 0.0
        blocked = np.isfinite(_hit(shape, at, np.broadcast_to(LIGHT, at.shape))[0])
        part = dark[window]
        part[open_ground] = blocked
        dark[window] = part
    colour[dark] *= SHADOW


def _hit(shape: Placed, origin: Array, ray: Array) -> tuple[Array, Array]:
    """Distance along unit rays to the first hit (inf without one), and the normal there."""
    if shape.corners_of_triangle is not None:
        return hit_triangle(shape.corners_of_triangle, origin, ray)
    if shape.half is not None and shape.quaternion is not None:
        return hit_box(shape.a, shape.quaternion, shape.half, origin, ray)
    return hit_capsule(shape.a, shape.b, shape.radius, origin, ray)


def png(image: NDArray[np.uint8]) -> bytes:
    """PNG bytes of an image (height, width, 3).

    >>> png(np.zeros((2, 3, 3), dtype=np.uint8))[:8]
    b'\\x89PNG\\r\\n\\x1a\\n'
    """
    height, width, _ = image.shape
    # filters 0 and 1 of PNG: the bytes as they are, and each minus the one a pixel to the left
    left = np.concatenate([np.zeros((height, 1, 3), dtype=np.uint8), image[:, :-1]], axis=1)

    def packed(number: int, lines: NDArray[np.uint8]) -> bytes:
        first = np.full((height, 1), number, dtype=np.uint8)
        return zlib.compress(np.concatenate([first, lines.reshape(height, -1)], axis=1).tobytes(), 9)

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    body = min(packed(0, image), packed(1, image - left), key=len)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", body) + chunk(b"IEND", b"")
