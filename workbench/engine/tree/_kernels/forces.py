# mypy: ignore-errors
"""The equations of motion of a tree at one state, compiled: residual, slopes, mass.

    r = M(q) w + h(q, v, x, t) for the joints,   x' - f(q, v, x, t) for first-order states

v and w hold the states and their rates behind the joints' velocities and accelerations.
"""

from numba import njit

from ...compiler.options import ENTRY, INNER
from .elements import coordinate_forces, pair_forces, pair_slopes, pull_back
from .members import measure_members
from .motion import columns, joint_forces, link_wrenches, moved, places, twists
from .tangents import motion_tangents


@njit(**INNER)
def residual(T, W, step, q, v, w):
    """W.force = r."""
    n = T.column.shape[0]
    places(T, W, step, q)
    columns(T, W)
    twists(T, W, step, v, w)
    link_wrenches(T, W)
    joint_forces(T, W)
    pair_forces(T, W, step, v[n:])
    coordinate_forces(T, W, q, v, False)
    for i in range(n, v.shape[0]):
        W.force[i] += w[i]


@njit(**INNER)
def linearised(T, W, step, q, v, w):
    """W.force = r, and W.m, W.k, W.c: its slopes by w, by the coordinates' small motions and by v."""
    n, full = T.column.shape[0], v.shape[0]
    places(T, W, step, q)
    columns(T, W)
    twists(T, W, step, v, w)
    for i in range(n, full):
        for j in range(full):
            W.m[i, j] = 0.0
            W.k[i, j] = 0.0
            W.c[i, j] = 0.0
            W.c[j, i] = 0.0
        W.m[i, i] = 1.0
    clear_blocks(T, W)
    link_wrenches(T, W)
    joint_forces(T, W)
    motion_tangents(T, W)
    pair_forces(T, W, step, v[n:])
    pair_slopes(T, W, step, v[n:])
    pull_back(T, W)
    coordinate_forces(T, W, q, v, True)
    for i in range(n, full):
        W.force[i] += w[i]


@njit(**INNER)
def clear_blocks(T, W):
    """Zero the entries that elements write between branches; those along branches are set, not added."""
    for pair in range(T.pair.shape[0]):
        for i in range(T.pair[pair, 2], T.pair[pair, 3]):
            for j in range(T.pair[pair, 2], T.pair[pair, 3]):
                a, b = T.path[i, 0], T.path[j, 0]
                W.k[a, b] = 0.0
                W.c[a, b] = 0.0
    for t in range(T.coupling_column.shape[0]):
        a, b = T.coupling_column[t, 0], T.coupling_column[t, 1]
        W.k[a, b] = 0.0
        W.k[b, a] = 0.0
        W.c[a, b] = 0.0
        W.c[b, a] = 0.0


@njit(**ENTRY)
def measure_lengths(T, W, q, v):
    """W.delta = lengths less the tables' natural lengths, at the first sample."""
    places(T, W, 0, q)
    columns(T, W)
    twists(T, W, 0, v, v)
    measure_members(T, W, 0)


@njit(**ENTRY)
def look_residual(T, W, step, q, v, w):
    """`residual` for Python."""
    residual(T, W, step, q, v, w)


@njit(**ENTRY)
def look_linearised(T, W, step, q, v, w):
    """`linearised` for Python."""
    linearised(T, W, step, q, v, w)


@njit(**ENTRY)
def look_moved(T, q, move, out):
    """`moved` for Python."""
    moved(T, q, move, out)
