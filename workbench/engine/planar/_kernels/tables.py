"""The flat arrays that the compiled kernels read and the work space they write.

`Tables` is one planar system at one time grid: nothing in it is a Python object. Bodies 0..free-1 move freely
(coordinates x, y, theta in a row), the others follow prescribed motions, the last one is the ground.
Loads, motions and drives are sampled at the grid before the run, so any Python function of time may be used.
"""

from typing import Any, NamedTuple

import numpy as np

from ...compiler.records import passed_as_record

__all__ = ["DamageSweep", "Listed", "SpringTables", "Tables", "Work", "listed", "work_space"]

Array = np.ndarray[Any, Any]


@passed_as_record
class Tables(NamedTuple):
    """One system at one time grid; N members, P pairs, S segments, E force elements with Z states, m rows."""

    mass: Array  # (3 free,) diagonal of the mass matrix
    gravity: Array  # (3 free,) generalised force
    pair: Array  # (P, 2) body 1, body 2
    segment: Array  # (S, 4) pair, law code, first, last member
    geometry: Array  # (6, N) s1x, s1y, s2x, s2y, offset^2, natural length
    law: Array  # (PARAMETERS, N) parameters of the laws
    scale: Array  # (N,) alpha^power
    element: Array  # (E, 3) pair, code, number of its state or -1
    element_data: Array  # (., E) parameters of the elements
    state_pair: Array  # (Z,) pair of the element of each state
    row: Array  # (m, 4) kind, pair, body 1, body 2
    row_data: Array  # (m, 7)
    load: Array  # (L, 4) body, follower, index of the sample row, 0
    load_point: Array  # (L, 2) body-frame point
    times: Array  # (samples,)
    load_sample: Array  # (samples, L, 3) fx, fy, torque
    motion: Array  # (samples, 2, 3 prescribed) q and v of the prescribed bodies
    drive: Array  # (samples, m)


SpringTables = NamedTuple("SpringTables", [(name, Array) for name in Tables._fields])  # type: ignore[misc]
passed_as_record(SpringTables)
SpringTables.__doc__ = """The same fields, for systems of undamped springs and revolute joints alone.

Its own type, so that the kernels compile for it without the code of all other elements: three times faster.
"""


@passed_as_record
class Work(NamedTuple):
    """What one evaluation writes; the arrays are reused from step to step."""

    q: Array  # (3 bodies,) full coordinates
    v: Array
    turn: Array  # (2, bodies) cosine and sine of the angles
    force: Array  # (n,) internal minus external forces plus Phi_q^T lambda
    k: Array  # (n, n)
    c: Array  # (n, n)
    phi: Array  # (m,)
    phi_q: Array  # (m, n)
    big: Array  # (P, 6) pair coordinates and rates
    fr: Array  # (P, 3)
    kr: Array  # (P, 3, 3)
    cr: Array  # (P, 3, 3)
    half: Array  # (3, 6)
    row_g: Array  # (3,)
    row_h: Array  # (3, 3)
    delta: Array  # (N,)
    rate: Array
    f: Array
    fd: Array
    fv: Array
    z: Array  # (Z,) states at the end of the step
    zdot: Array  # (Z,)
    slopes: Array  # (Z, 10) dg/dz (1), dF/dz, dg/dX and dz/dX (3 each)
    out: Array  # (2,)
    energy: Array  # (1,) stored in the undamped springs, where tangents were asked for


@passed_as_record
class Listed(NamedTuple):
    """Room for what is not zero of the factors of N unknowns, as from `lu_list`; none for those in a band."""

    value: Array  # (N N,)
    column: Array  # (N N,)
    start: Array  # (N + 1, 2)


def listed(unknowns: int) -> Listed:
    """The room for so many unknowns."""
    return Listed(
        value=np.zeros(unknowns**2), column=np.zeros(unknowns**2, np.int64),
        start=np.zeros((unknowns + 1, 2), np.int64),
    )  # fmt: skip


@passed_as_record
class DamageSweep(NamedTuple):
    """What the adjoint of states needs beside the tangents; systems without states have none."""

    state_pair: Array  # (Z,)
    pair: Array  # (P, 2) body 1, body 2
    motion: Array  # (samples, 2, 3 prescribed)
    q: Array  # (3 bodies,) work space, as in `Work`
    v: Array
    turn: Array  # (2, bodies)
    big: Array  # (P, 6)
    row_g: Array  # (3,)
    rates: Array  # (nodes, n) velocities of the run
    seed: Array  # (E, Z) dG/d(state)
    costate: Array  # (R, 2, Z)
    eta: Array  # (nodes, R, Z) adjoint of the step that ends at a node, as equation of its states
    slopes: Array  # (., Z, 10) as from `linearise`


def work_space(tables: Tables, dtype: Any = np.float64) -> Work:
    """Arrays for the evaluations of one system."""
    n, m, p = len(tables.mass), len(tables.row), len(tables.pair)
    full = n + tables.motion.shape[2]
    members, states = tables.scale.size, tables.state_pair.size

    def zeros(*shape: int) -> Array:
        return np.zeros(shape, dtype)

    return Work(
        q=zeros(full), v=zeros(full), turn=zeros(2, full // 3), force=zeros(n), k=zeros(n, n), c=zeros(n, n),
        phi=zeros(m), phi_q=zeros(m, n),
        big=zeros(p, 6), fr=zeros(p, 3), kr=zeros(p, 3, 3), cr=zeros(p, 3, 3),
        half=zeros(3, 6),
        row_g=zeros(3), row_h=zeros(3, 3),
        delta=zeros(members), rate=zeros(members), f=zeros(members), fd=zeros(members), fv=zeros(members),
        z=zeros(states), zdot=zeros(states), slopes=zeros(states, 10), out=zeros(2), energy=zeros(1),
    )  # fmt: skip
