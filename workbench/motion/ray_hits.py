"""Where rays meet shapes: distance to the first hit, inf without one, and the outward normal there.

Rays are `origin + t ray` with unit `ray`; both have shape (..., 3), distances (...), normals (..., 3).
"""

import numpy as np
from numpy.typing import NDArray

from workbench.motion.frames import rotate

__all__ = ["EPSILON", "hit_box", "hit_capsule", "hit_triangle"]

Array = NDArray[np.float64]

EPSILON = 1e-9  # m


def hit_capsule(a: Array, b: Array, radius: float, origin: Array, ray: Array) -> tuple[Array, Array]:
    """Nearest of the cylinder's side and the two end spheres."""
    axis = b - a
    length2 = float(axis @ axis)
    distance = np.full(ray.shape[:-1], np.inf)
    if length2 > EPSILON:
        # |o + t r - a| without its part along the axis equals the radius
        o = origin - a
        ra, oa = ray @ axis, o @ axis
        p = 1.0 - ra * ra / length2
        q = (o * ray).sum(-1) - oa * ra / length2
        c = (o * o).sum(-1) - oa * oa / length2 - radius**2
        root = q * q - p * c
        with np.errstate(invalid="ignore", divide="ignore"):
            t = np.where((root >= 0) & (p > EPSILON), (-q - np.sqrt(root)) / p, np.inf)
            along = (oa + t * ra) / length2
            on = (t > EPSILON) & (along >= 0) & (along <= 1)
        distance = np.where(on, t, np.inf)
    for centre in (a, b) if length2 > EPSILON else (a,):
        o = origin - centre
        q = (o * ray).sum(-1)
        root = q * q - (o * o).sum(-1) + radius**2
        with np.errstate(invalid="ignore"):
            t = np.where(root >= 0, -q - np.sqrt(root), np.inf)
        distance = np.minimum(distance, np.where(t > EPSILON, t, np.inf))
    known = np.isfinite(distance)
    point = origin + np.where(known, distance, 0.0)[..., None] * ray
    share = np.clip(((point - a) @ axis) / length2, 0, 1)[..., None] if length2 > EPSILON else 0.0
    return distance, (point - (a + share * axis)) / radius


def hit_triangle(corners: Array, origin: Array, ray: Array) -> tuple[Array, Array]:
    """Moeller and Trumbore 1997; surfaces are closed, so a triangle is met from outside alone."""
    a = corners[0]
    first, second = corners[1] - a, corners[2] - a
    normal = np.cross(first, second)
    size = float(np.linalg.norm(normal))
    across = np.cross(ray, second)
    facing = across @ first  # -ray . normal
    with np.errstate(divide="ignore", invalid="ignore"):
        away = origin - a
        u = (away * across).sum(-1) / facing
        turned = np.cross(away, first)
        v = (ray * turned).sum(-1) / facing
        t = turned @ second / facing
        on = (facing > EPSILON * size) & (u >= 0) & (v >= 0) & (u + v <= 1) & (t > EPSILON)
    outward = normal / max(size, EPSILON)
    return np.where(on, t, np.inf), np.broadcast_to(outward, ray.shape)


def hit_box(centre: Array, quaternion: Array, half: Array, origin: Array, ray: Array) -> tuple[Array, Array]:
    """The slab test in the box's own axes."""
    back = quaternion * np.array([1.0, -1.0, -1.0, -1.0])
    o, r = rotate(back, origin - centre), rotate(back, ray)
    r = np.where(np.abs(r) < EPSILON, EPSILON, r)
    first, second = (-half - o) / r, (half - o) / r
    near, far = np.minimum(first, second), np.maximum(first, second)
    enter, leave = near.max(axis=-1), far.min(axis=-1)
    on = (enter <= leave) & (enter > EPSILON)
    side = near.argmax(axis=-1)[..., None] == np.arange(3)
    normal = rotate(quaternion, np.where(side, -np.sign(r), 0.0))
    return np.where(on, enter, np.inf), normal
