"""Closed surfaces of triangles for shapes that are neither capsule nor box: wheels, rings, hulls.

Each function gives the points (V, 3) of a surface, m, and the triangles over them, anticlockwise as seen from
outside, as tuples that a `Body` takes.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["Mesh", "cylinder", "prism", "ring", "volume"]

Triple = tuple[float, float, float]
Triangle = tuple[int, int, int]
Mesh = tuple[tuple[Triple, ...], tuple[Triangle, ...]]


def cylinder(radius: float, width: float, *, sides: int = 16) -> Mesh:
    """A disc that turns about y, such as a wheel; its middle is the origin.

    >>> points, triangles = cylinder(0.4, 0.2, sides=12)
    >>> len(points), len(triangles)
    (24, 44)
    """
    turn = 2.0 * np.pi * np.arange(sides) / sides
    outline = np.column_stack([radius * np.cos(turn), radius * np.sin(turn)])
    return prism(outline, width)


def prism(outline: ArrayLike, width: float) -> Mesh:
    """An outline (n, 2) in x and z drawn out across y.

    It is convex, and anticlockwise where x points right and z up.
    Raises ValueError for fewer than three points or an outline that is not convex.

    >>> len(prism([(0, 0), (1, 0), (1, 1), (0, 1)], 2.0)[1])
    12
    """
    flat = np.asarray(outline, dtype=float)
    count = len(flat)
    if flat.shape != (count, 2) or count < 3:
        raise ValueError(f"outline needs at least three points (x, z), got shape {flat.shape}")
    edges = np.roll(flat, -1, axis=0) - flat
    after = np.roll(edges, -1, axis=0)
    if (edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0] < -1e-12).any():
        raise ValueError("outline needs to be convex and anticlockwise")
    # seen from -y, x points right and z up
    near = [(float(x), -width / 2.0, float(z)) for x, z in flat]
    far = [(float(x), width / 2.0, float(z)) for x, z in flat]
    triangles: list[Triangle] = []
    for k in range(1, count - 1):
        triangles += [(0, k, k + 1), (count, count + k + 1, count + k)]
    for k in range(count):
        n = (k + 1) % count
        triangles += [(k, count + k, count + n), (k, count + n, n)]
    return tuple(near + far), tuple(triangles)


def ring(radius: float, thickness: float, *, sides: int = 20, around: int = 6) -> Mesh:
    """A ring in the plane z = 0 about the origin; `thickness` is that of its round section.

    >>> points, triangles = ring(0.4, 0.05, sides=8, around=4)
    >>> len(points), len(triangles)
    (32, 64)
    """
    u = 2.0 * np.pi * np.arange(sides) / sides
    v = 2.0 * np.pi * np.arange(around) / around
    reach = radius + 0.5 * thickness * np.cos(v)
    points = [
        (float(r * np.cos(a)), float(r * np.sin(a)), float(0.5 * thickness * np.sin(b)))
        for a in u
        for r, b in zip(reach, v, strict=True)
    ]

    def at(i: int, j: int) -> int:
        return (i % sides) * around + j % around

    triangles: list[Triangle] = []
    for i in range(sides):
        for j in range(around):
            a, b, c, d = at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)
            triangles += [(a, b, c), (a, c, d)]
    return tuple(points), tuple(triangles)


def volume(vertices: Sequence[Triple], triangles: Sequence[Triangle]) -> float:
    """Enclosed by a closed surface, m^3; negative where the triangles are seen from inside."""
    p = np.asarray(vertices, dtype=float)[np.asarray(triangles)]
    return float(np.einsum("ti,ti->t", p[:, 0], np.cross(p[:, 1], p[:, 2])).sum() / 6.0)
