# mypy: ignore-errors
"""Constraint rows in pair coordinates: value, slopes and curvature of each kind, compiled."""

from numba import njit
from numpy import cos, sin

from ...compiler.options import INNER
from .row_kinds import ANGLE, LINE


@njit(**INNER)
def pair_row(kind, p, r, big, g, h):
    """Value, slope g (3,) and curvature h (3, 3) of a constraint row in pair coordinates.

    Row r of p: s1x, s1y, s2x, s2y, nx, ny, target.
    """
    for a in range(3):
        g[a] = 0.0
        for b in range(3):
            h[a, b] = 0.0
    if kind == ANGLE:
        g[2] = 1.0
        return big[2] - p[r, 6]
    c, s = cos(big[2]), sin(big[2])
    ax = c * p[r, 0] - s * p[r, 1]
    ay = s * p[r, 0] + c * p[r, 1]
    dx = ax + big[0] - p[r, 2]
    dy = ay + big[1] - p[r, 3]
    if kind == LINE:
        g[0] = p[r, 4]
        g[1] = p[r, 5]
        g[2] = p[r, 5] * ax - p[r, 4] * ay
        h[2, 2] = -(p[r, 4] * ax + p[r, 5] * ay)
        return p[r, 4] * dx + p[r, 5] * dy - p[r, 6]
    # DISTANCE: (d.d/L - L)/2, smooth at any position and of the scale of a length
    length = p[r, 6]
    g[0] = dx / length
    g[1] = dy / length
    g[2] = (ax * dy - ay * dx) / length
    h[0, 0] = 1.0 / length
    h[1, 1] = 1.0 / length
    h[0, 2] = -ay / length
    h[2, 0] = -ay / length
    h[1, 2] = ax / length
    h[2, 1] = ax / length
    h[2, 2] = (ax * ax + ay * ay - dx * ax - dy * ay) / length
    return 0.5 * ((dx * dx + dy * dy) / length - length)
