"""The flat arrays of a tree at one time grid, and the work space that its kernels write.

Links stand depth first, so that a link's subtree is a run of links and a column's ancestors are runs of
columns. Index L, behind the last link, is the ground. Spatial vectors are (rotation; translation) and
(moment; force) in global axes about `origin`, a point that travels with the first free body: moments about
a far origin would set a floor of rounding.
"""

from typing import Any, NamedTuple

import numpy as np

from ...compiler.held import ABSENT, listed
from ...compiler.records import passed_as_record
from ...elements.table import LAWS, code_of

__all__ = [
    "DRIVEN", "REVOLUTE", "SPHERICAL", "TRANSLATION", "TreeRun", "TreeTables", "TreeWork", "laws_listed",
    "tree_run", "tree_work",
]  # fmt: skip

Array = np.ndarray[Any, Any]

DRIVEN, REVOLUTE, TRANSLATION, SPHERICAL = 0, 1, 2, 3  # kinds of links


@passed_as_record
class TreeTables(NamedTuple):
    """L links, n velocities of joints, x first-order states, P pairs of links, N members."""

    link: Array  # (L, 6) kind, parent (L: ground), first column, columns, first of q, driven row
    place: Array  # (L, 12) joint frame in the parent's: position, rotation by rows
    axes: Array  # (L, 9) axes of its columns in the joint frame
    inertia: Array  # (L, 10) m, m c, then xx, yy, zz, xy, xz, yz about the link's origin
    centre_link: Array  # (1,) link whose place is the origin of spatial vectors, -1: the global origin
    gravity: Array  # (3,)
    column: Array  # (n, 2) link, place in the link
    pair: Array  # (P, 4) link a, link b, first and last of its path
    path: Array  # (columns of all paths, 2) column, sign: +1 moves a alone, -1 moves b alone
    segment: Array  # (S, 4) pair, law code, first, last member
    other_law: Array  # lists laws other than springs by its type
    geometry: Array  # (7, N) point on a, point on b, natural length
    law: Array  # (PARAMETERS, N)
    scale: Array  # (N,) alpha^power
    spring_column: Array  # (T, 2) column, place in q
    spring: Array  # (8, T) k, c, rest, k_stop, upper, lower, width, constant torque
    ball_column: Array  # (B, 2) first column, place in q of a ball spring
    ball: Array  # (B, 2) k, c
    ball_rest: Array  # (B, 4) quaternion at rest
    damper_column: Array  # (D,) column
    damper: Array  # (D, 3) half the sum and the difference of the rates, slow
    coupling_column: Array  # (C, 4) columns and places in q of two coupled coordinates
    coupling: Array  # (C, 3) k, c, difference at rest
    bushing_pair: Array  # (U, 3) pair, its damage among the states or -1, 0
    bushing: Array  # (26, U)
    surface: Array  # (K, 4) pair, first state or -1, kind (of shape, tyre, strut), states
    contact: Array  # which of them are contacts
    tyre: Array  # which are tyres
    strut: Array  # which are struts
    surface_law: Array  # (K, 31)
    surface_shape: Array  # (K, 11 or more) shape on b, or road
    cut: Array  # (m, 2) pair, kind of condition
    cut_place: Array  # (m, 10) point or direction on a; point on b; direction on b; length
    closing: Array  # (samples,) what the rows of conditions stand for, see `cuts`
    load: Array  # (F, 3) pair with the ground, follower, kind (0 force, 1 torque)
    load_point: Array  # (F, 3)
    times: Array  # (samples,)
    load_sample: Array  # (samples, F, 3)
    friction_sample: Array  # (samples, D) friction of the dampers
    drive: Array  # (driven links,) which links are driven
    motion: Array  # (samples, driven links, 24) rotation, place, spin, velocity, their rates


@passed_as_record
class TreeWork(NamedTuple):
    """What one evaluation of a tree writes; reused from step to step."""

    origin: Array  # (3,)
    turn: Array  # (L + 1, 9) rotation by rows
    place: Array  # (L + 1, 3) less the origin
    s: Array  # (n, 6) columns of the joints
    twist: Array  # (L + 1, 6)
    push: Array  # (L + 1, 6) spatial acceleration, gravity as that of the ground
    wrench: Array  # (L, 6) of a link, then of its subtree
    body: Array  # (L, 10) inertia about the origin, then of the subtree
    gyro: Array  # (L, 12) velocity part, then of the subtree
    psi1: Array  # (n, 6) parent's twist x column
    psi2: Array  # (n, 6)
    sdot: Array  # (n, 6)
    row: Array  # (n, 9) column through the subtree's inertia and velocity part
    m: Array  # (n + x, n + x)
    k: Array  # (n + x, n + x) d force/dq
    c: Array  # (n + x, n + x) d force/dv
    force: Array  # (n + x,)
    delta: Array  # (N,)
    rate: Array
    f: Array
    fd: Array
    fv: Array
    line: Array  # (N, 9) points on a and b less the origin, direction
    pair_force: Array  # (P, 6)
    pair_k: Array  # (P, 36) change of the force by the place of a, twists held
    pair_c: Array  # (P, 36) by the twist
    some: Array  # (4, 64) scratch
    small: Array  # (6, 3, 3) scratch
    path: Array  # (6, 6, longest path) scratch of `pull_back`
    surface: Array  # (7, 6, 9) scratch
    complex: Array  # (2, 6, 9) scratch of complex steps
    cut: Array  # (11, 3) scratch


def laws_listed(codes: Array, *, every: bool) -> Array:
    """The table whose type lists the laws of the members other than springs: those of the codes, or every
    law."""
    held = [name for name in LAWS if name != "Spring" and (every or code_of(name) in codes)]
    return np.asarray(listed(held)) if held else np.zeros(0, ABSENT)


def tree_work(tables: TreeTables, states: int, dtype: Any = np.float64) -> TreeWork:
    """Arrays for the evaluations of one tree with `states` first-order states, and its conditions."""
    links, n, members, pairs = (
        len(tables.link),
        len(tables.column),
        tables.geometry.shape[1],
        len(tables.pair),
    )
    full = n + states + len(tables.cut)
    longest = int((tables.pair[:, 3] - tables.pair[:, 2]).max(initial=1))

    def zeros(*shape: int) -> Array:
        return np.zeros(shape, dtype)

    work = TreeWork(
        origin=zeros(3), turn=zeros(links + 1, 9), place=zeros(links + 1, 3), s=zeros(n, 6),
        twist=zeros(links + 1, 6), push=zeros(links + 1, 6), wrench=zeros(links, 6), body=zeros(links, 10),
        gyro=zeros(links, 12), psi1=zeros(n, 6), psi2=zeros(n, 6), sdot=zeros(n, 6), row=zeros(n, 9),
        m=zeros(full, full), k=zeros(full, full), c=zeros(full, full), force=zeros(full),
        delta=zeros(members), rate=zeros(members), f=zeros(members), fd=zeros(members), fv=zeros(members),
        line=zeros(members, 9), pair_force=zeros(pairs, 6), pair_k=zeros(pairs, 36), pair_c=zeros(pairs, 36),
        some=zeros(4, 64), small=zeros(6, 3, 3), path=zeros(6, 6, longest),
        surface=zeros(7, 6, 9), complex=np.zeros((2, 6, 9), complex), cut=zeros(11, 3),
    )  # fmt: skip
    work.turn[links, 0] = work.turn[links, 4] = work.turn[links, 8] = 1.0
    work.push[links, 3:] = -tables.gravity
    return work


@passed_as_record
class TreeRun(NamedTuple):
    """The nodes of a run, and what a step needs; n velocities of joints, states and conditions together."""

    position: Array  # (nodes, nq)
    velocity: Array  # (nodes, n) states behind the velocities, then integrals of the multipliers, unused
    rate: Array  # (nodes, n) accelerations, rates of states, multipliers
    move: Array  # (nodes, n) increments d of every step
    stiffness: Array  # (nodes or 1, n, n) kept tangents
    damping: Array
    factors: Array  # of the Newton matrices
    lu: Array  # (n, n)
    right: Array  # (n,)
    diagonal: Array  # (n,)
    a: Array  # (n,)
    before: Array  # (n,) a before the step that is made
    correction: Array  # (n,) of damped Newton steps
    level: Array  # (3,) largest accelerations and rates of states so far; 1 where factors are to be renewed
    counts: Array  # (2,) Newton steps, factorisations


def tree_run(start: tuple[Array, Array], nodes: int, *, keep: bool) -> TreeRun:
    """Arrays for a run of `nodes` nodes from q, v; with room for the tangents where `keep`."""
    q, v = start
    n, kept = len(v), nodes if keep else 1

    def zeros(*shape: int) -> Array:
        return np.zeros(shape)

    run = TreeRun(
        position=zeros(nodes, len(q)), velocity=zeros(nodes, n), rate=zeros(nodes, n), move=zeros(nodes, n),
        stiffness=np.empty((kept, n, n)), damping=np.empty((kept, n, n)), factors=np.empty((kept, n, n)),
        lu=zeros(n, n), right=zeros(n), diagonal=zeros(n), a=zeros(n), before=zeros(n), correction=zeros(n),
        level=zeros(3), counts=np.zeros(2, np.int64),
    )  # fmt: skip
    run.position[0], run.velocity[0] = q, v
    return run
