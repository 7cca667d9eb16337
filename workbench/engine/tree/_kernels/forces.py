# mypy: ignore-errors
"""The equations of motion of a tree at one state, compiled: residual, slopes, mass.

    r = M(q) w + h(q, v, x, t) for the joints,   x' - f(q, v, x, t) for first-order states

v and w hold the states and their rates behind the joints' velocities and accelerations; the last entries of w
are the multipliers of cut joints, see `cuts`.
"""

from typing import Any

from numba import njit

from ...compiler.options import ENTRY, INNER
from .elements import coordinate_forces, pair_forces, pair_slopes
from .motion import columns, joint_forces, link_wrenches, moved, places, twists
from .tangents import motion_tangents, pull_back


@njit(**INNER)
def evaluate(T, W, step, q, v, w, tangent):
    """W.force = r, and if tangent W.m, W.k, W.c: its slopes by w, by the coordinates' small motions, by v."""
    n, full = T.column.shape[0], v.shape[0]
    conditions = full - T.cut.shape[0]
    never = step < 0  # a value: what takes a literal False would be compiled for it once more
    places(T, W, step, q)
    columns(T, W)
    twists(T, W, step, v, w)
    link_wrenches(T, W)
    joint_forces(T, W)
    if tangent:
        for i in range(full):
            for j in range(full):
                W.k[i, j] = 0.0
                W.c[i, j] = 0.0
        for i in range(n, full):
            for j in range(full):
                W.m[i, j] = 0.0
            W.m[i, i] = 1.0 if i < conditions else 0.0
        motion_tangents(T, W)
    pair_forces(T, W, step, v[n:], w, never)
    if tangent:
        pair_slopes(T, W, step, v[n:], w, tangent)
        pull_back(T, W)
    coordinate_forces(T, W, step, q, v, tangent)
    for i in range(n, conditions):
        W.force[i] += w[i]


@njit(**ENTRY)
def look(T, W, step, q, v, w, tangent):
    """`evaluate` for Python."""
    evaluate(T, W, step, q, v, w, tangent)


def look_residual(T: Any, W: Any, step: int, q: Any, v: Any, w: Any) -> None:
    """The residual alone: W.force."""
    look(T, W, step, q, v, w, False)


def look_linearised(T: Any, W: Any, step: int, q: Any, v: Any, w: Any) -> None:
    """Residual and slopes: W.force, W.m, W.k, W.c."""
    look(T, W, step, q, v, w, True)


@njit(**ENTRY)
def look_moved(T, q, move, out):
    """`moved` for Python."""
    moved(T, q, move, out)
