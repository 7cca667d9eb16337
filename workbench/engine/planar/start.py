"""Consistent initial conditions: positions, velocities, accelerations and multipliers.

M w + F + Phi_q^T lambda = 0,   Phi_q w = -(d/dt Phi_q) v - ...   at t = 0 (section 2.4: a_0 = q''_0)
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import AssemblyError
from ..integration.redundancy import FEASIBLE, RANK
from ._kernels.equations import evaluate
from ._kernels.row_kinds import ANGLE, LINE
from ._kernels.tables import Tables, Work, work_space
from .compiled import (
    Compiled,
    compiled,
    drive_slopes,
    on_grid,
)
from .system import System

__all__ = ["assembled"]

Array = np.ndarray[Any, Any]

SHIFT = 1e-8  # proximal term for redundant joints, relative to the inverse mass; Newton removes its effect


def residual_of_joints(tables: Tables, work: Work, q: Array, v: Array) -> tuple[Array, Array]:
    """Phi and Phi_q at the first sample."""
    z = np.zeros(len(tables.state_pair))
    evaluate(tables, work, 0, q, v, np.zeros(len(tables.row)), z, z, 0.0, False)
    return work.phi.copy(), work.phi_q.copy()


def rates_of_joints(parts: Compiled, work: Work, t: float) -> tuple[Array, Array]:
    """dPhi/dt, and d2Phi/dt2 with the free accelerations left out, at the state `work` holds."""
    arrays = parts.arrays
    free = 3 * len(parts.system.free)
    aa = np.zeros_like(work.q)
    for index, body in enumerate(parts.motions[:-1]):
        aa[free + 3 * index : free + 3 * index + 3] = body.push(t)
    first, second = drive_slopes(parts, t)
    rate, bend = -first, -second
    numbers = arrays["row"].tolist()
    angles = work.q[2::3]
    cosine, sine = np.cos(angles).tolist(), np.sin(angles).tolist()
    # every case of an attack comes here: numbers of Python are faster than elements of arrays
    v, a = work.v.tolist(), aa.tolist()
    for r, (kind, _, i, j) in enumerate(numbers):
        data = arrays["row_data"][r]
        if kind < LINE:
            ends = data.tolist()
            for body, sign, s0, s1 in ((i, 1.0, ends[0], ends[1]), (j, -1.0, ends[2], ends[3])):
                c, s, om, al = cosine[body], sine[body], v[3 * body + 2], a[3 * body + 2]
                arm = c * s0 - s * s1, s * s0 + c * s1
                perp = -arm[1], arm[0]
                rate[r] += sign * (v[3 * body + kind] + om * perp[kind])
                bend[r] += sign * (a[3 * body + kind] + al * perp[kind] - om**2 * arm[kind])
            continue
        x, u, acc = _pair_motion(work.q, work.v, aa, i, j)
        if kind == ANGLE:
            rate[r] += u[2]
            bend[r] += acc[2]
            continue
        c, s = np.cos(x[2]), np.sin(x[2])
        lever = np.array([c * data[0] - s * data[1], s * data[0] + c * data[1]])
        perpendicular = np.array([-lever[1], lever[0]])
        d = lever + x[:2] - data[2:4]
        d1 = u[:2] + u[2] * perpendicular
        d2 = acc[:2] + acc[2] * perpendicular - u[2] ** 2 * lever
        if kind == LINE:
            rate[r] += data[4:6] @ d1
            bend[r] += data[4:6] @ d2
        else:
            rate[r] += d @ d1 / data[6]
            bend[r] += (d1 @ d1 + d @ d2) / data[6]
    return rate, bend


def _pair_motion(q: Array, v: Array, acc: Array, i: int, j: int) -> tuple[Array, Array, Array]:
    """Pair coordinates with their first and second time derivatives."""
    th, om, al = q[3 * j + 2], v[3 * j + 2], acc[3 * j + 2]
    c, s = np.cos(th), np.sin(th)
    turn = np.array([[c, s], [-s, c]])
    spin = np.array([[0.0, 1.0], [-1.0, 0.0]])  # d(A^T)/dtheta = spin A^T
    d, d1, d2 = (z[3 * i : 3 * i + 2] - z[3 * j : 3 * j + 2] for z in (q, v, acc))
    x = turn @ d
    u = turn @ d1 + om * spin @ x
    a = turn @ d2 + 2.0 * om * spin @ (turn @ d1) + al * spin @ x - om**2 * x
    angle = [z[3 * i + 2] - z[3 * j + 2] for z in (q, v, acc)]
    return np.append(x, angle[0]), np.append(u, angle[1]), np.append(a, angle[2])


def check_start(parts: Compiled, tables: Tables) -> tuple[Array, Array, Array]:
    """Initial q, v and Phi_q after the checks; raises AssemblyError with the nearest consistent state."""
    q, v = (x.copy() for x in parts.start)
    work = work_space(tables)
    phi, phi_q = residual_of_joints(tables, work, q, v)
    if len(phi) == 0:
        return q, v, phi_q
    worst = int(np.abs(phi).argmax())
    if abs(phi[worst]) > FEASIBLE:
        fixed, size, left = _assemble(tables, work, q, v)
        name = parts.row_names[worst]
        if left > FEASIBLE:
            raise AssemblyError(
                f"joints contradict each other: '{name}' is off by {abs(phi[worst]):.3g}, and no nearby "
                f"positions satisfy all joints (best residual {left:.3g}). Check its points and lengths",
                fixed,
                size,
            )
        raise AssemblyError(
            f"initial positions do not satisfy the joints: '{name}' is off by {abs(phi[worst]):.3g} (allowed "
            f"{FEASIBLE:.0e}). The nearest assembled positions move a coordinate by up to {size:.3g}; "
            "take them with assembled(system)",
            fixed,
            size,
        )
    rate, _ = rates_of_joints(parts, work, float(tables.times[0]))
    worst = int(np.abs(rate).argmax())
    if abs(rate[worst]) > 1e-8 * max(1.0, np.abs(v).max(initial=0.0)):
        move = _least_motion(phi_q, rate, tables.mass)
        raise AssemblyError(
            f"initial velocities do not satisfy the joints: '{parts.row_names[worst]}' separates at "
            f"{abs(rate[worst]):.3g} per second. The nearest consistent velocities change one by up to "
            f"{np.abs(move).max():.3g}; take them with assembled(system)",
            v + move,
            float(np.abs(move).max()),
        )
    return q, v, phi_q


def _least_motion(phi_q: Array, residual: Array, mass: Array) -> Array:
    """Smallest change, in the metric of the masses, that removes a residual of the joints."""
    root = 1.0 / np.sqrt(mass)
    return np.asarray(-root * np.linalg.lstsq(phi_q * root, residual, rcond=RANK)[0])


def _assemble(tables: Tables, work: Work, q: Array, v: Array) -> tuple[Array, float, float]:
    x = q.copy()
    left = np.inf
    for _ in range(50):
        phi, phi_q = residual_of_joints(tables, work, x, v)
        left = float(np.abs(phi).max())
        if left < 1e-13:
            break
        x += _least_motion(phi_q, phi, tables.mass)
    return x, float(np.abs(x - q).max()), left


def assembled(system: System) -> System:
    """The system with its bodies moved to the nearest positions and velocities that satisfy the joints.

    Nearest in the metric of the masses. Raises AssemblyError when there are none nearby.
    """
    parts = compiled(system)
    tables = on_grid(parts, np.zeros(len(system.members)), np.zeros(1))
    work = work_space(tables)
    q, v = (x.copy() for x in parts.start)
    q, size, left = _assemble(tables, work, q, v)
    if left > FEASIBLE:
        raise AssemblyError(
            f"joints contradict each other: no nearby positions satisfy all of them "
            f"(best residual {left:.3g})",
            q,
            size,
        )
    _, phi_q = residual_of_joints(tables, work, q, v)
    rate, _ = rates_of_joints(parts, work, 0.0)
    v = v + _least_motion(phi_q, rate, tables.mass)
    states = iter(zip(q.reshape(-1, 3), v.reshape(-1, 3), strict=True))
    bodies = []
    for body in system.bodies:
        if body.motion is None:
            (x, y, th), (vx, vy, om) = (map(float, part) for part in next(states))
            body = replace(body, position=(x, y, th), velocity=(vx, vy, om))
        bodies.append(body)
    return replace(system, bodies=tuple(bodies))


def initial_accelerations(
    parts: Compiled, tables: Tables, work: Work, q: Array, v: Array
) -> tuple[Array, Array]:
    """w_0 (n,) and lambda_0 (m,) from the saddle system; least squares when joints are redundant."""
    z = np.zeros(len(tables.state_pair))
    evaluate(tables, work, 0, q, v, np.zeros(len(tables.row)), z, z, 0.0, False)
    return accelerations_from(parts, tables, work)


def accelerations_from(parts: Compiled, tables: Tables, work: Work) -> tuple[Array, Array]:
    """The same from forces and Phi_q already evaluated with lambda = 0."""
    if len(tables.row) == 0:
        return -work.force / tables.mass, np.zeros(0)
    force, phi_q = work.force.copy(), work.phi_q.copy()
    _, bend = rates_of_joints(parts, work, float(tables.times[0]))
    root = 1.0 / np.sqrt(tables.mass)
    # projection in the metric of the masses: stable for any rank
    j = phi_q * root
    free = -root * force
    s = free + np.linalg.lstsq(j, -bend - j @ free, rcond=RANK)[0]
    lam = np.linalg.lstsq(j.T, free - s, rcond=RANK)[0]
    return root * s, lam


def proximal(tables: Tables, *, redundant: bool) -> float:
    """Size of the regularisation of the multipliers: none for independent joints."""
    return SHIFT / float(tables.mass.min()) if redundant else 0.0
