"""Consistent initial places and velocities of a system in natural coordinates."""

from dataclasses import replace
from typing import Any

import numpy as np

from ..errors import AssemblyError
from ..integration.chart import chart
from ..integration.independent import IndependentEquations
from ..integration.redundancy import FEASIBLE, RANK
from ._kernels_equations import evaluate_rates
from .compiled import Compiled, compiled, on_grid, rates_of
from .system import NaturalSystem
from .tables import NaturalTables, work_space

__all__ = ["checked", "independent_equations", "look", "moving"]

Array = np.ndarray[Any, Any]


def independent_equations(parts: Compiled, tables: NaturalTables) -> IndependentEquations:
    """Work space and arrays for runs on the grid of `tables`."""
    n, m = len(tables.mass), len(tables.constant)
    return IndependentEquations(
        tables=tables,
        work=work_space(tables),
        rates=rates_of(parts, tables.times),
        chart=chart(tables.mass, np.ones(n), m, full=n),
        row_names=parts.row_names,
    )


def look(equations: IndependentEquations, node: int, q: Array, v: Array, w: Array) -> None:
    """Conditions and their rates at a state."""
    evaluate_rates(*equations[:4], node, q, v, w)


def checked(parts: Compiled, tables: NaturalTables) -> tuple[Array, Array, Array]:
    """q0, v0 and Phi_q there; raises AssemblyError with the nearest positions or velocities that fit."""
    equations = independent_equations(parts, on_grid(parts, np.zeros(len(parts.power)), tables.times[:1]))
    q, v = (x.copy() for x in parts.start)
    zero = np.zeros_like(q)
    look(equations, 0, q, v, zero)
    phi, phi_q = equations.work.phi.copy(), equations.work.phi_q.copy()
    if len(phi) == 0:
        return q, v, phi_q
    worst = int(np.abs(phi).argmax())
    if abs(phi[worst]) > FEASIBLE:
        fixed = q.copy()
        for _ in range(50):
            look(equations, 0, fixed, v, zero)
            fixed -= np.linalg.lstsq(equations.work.phi_q, equations.work.phi, rcond=RANK)[0]
        left, size = float(np.abs(equations.work.phi).max()), float(np.abs(fixed - q).max())
        name = parts.row_names[worst]
        if left > FEASIBLE:
            raise AssemblyError(
                f"conditions contradict each other: '{name}' is off by {abs(phi[worst]):.3g}, and no nearby "
                f"positions satisfy all of them (best residual {left:.3g}). Check points, axes and lengths",
                fixed,
                size,
            )
        raise AssemblyError(
            f"initial positions do not satisfy the conditions: '{name}' is off by {abs(phi[worst]):.3g} "
            "(allowed "
            f"{FEASIBLE:.0e}). The nearest assembled positions move a coordinate by up to {size:.3g}",
            fixed,
            size,
        )
    rate = phi_q @ v + equations.chart.t1
    worst = int(np.abs(rate).argmax())
    if abs(rate[worst]) > 1e-8 * max(1.0, np.abs(v).max(initial=0.0)):
        move = np.linalg.lstsq(phi_q, rate, rcond=RANK)[0]
        raise AssemblyError(
            f"initial velocities do not satisfy the conditions: '{parts.row_names[worst]}' changes at "
            f"{abs(rate[worst]):.3g} per second. Give one point's velocity and take moving(system, "
            f"{{...}}) for the "
            "others",
            v - move,
            float(np.abs(move).max()),
        )
    return q, v, phi_q


def moving(system: NaturalSystem, known: dict[str, tuple[float, float, float]]) -> NaturalSystem:
    """The system with velocities of some points (m/s) or unit vectors (1/s) given, all others following.

    Where the conditions leave freedom the others move as little as possible. Raises AssemblyError when the
    conditions do not allow the given velocities.
    """
    parts = compiled(system)
    tables = on_grid(parts, np.zeros(len(parts.power)), np.zeros(1))
    equations = independent_equations(parts, tables)
    q = parts.start[0].copy()
    look(equations, 0, q, np.zeros_like(q), np.zeros_like(q))
    rows, right = [equations.work.phi_q], [-equations.chart.t1]
    for name, velocity in known.items():
        if name not in parts.index:
            raise ValueError(f"system has no point or vector '{name}'; it has {', '.join(parts.index)}")
        at = parts.index[name]
        if at >= len(q):
            raise ValueError(f"'{name}' is fixed and cannot move")
        rows.append(np.eye(len(q))[at : at + 3])
        right.append(np.array(velocity, float))
    matrix, value = np.vstack(rows), np.concatenate(right)
    v = np.linalg.lstsq(matrix, value, rcond=RANK)[0]
    off = float(np.abs(matrix @ v - value).max())
    if off > 1e-9 * max(1.0, float(np.abs(v).max())):
        raise AssemblyError(
            f"the conditions do not allow the velocities of {', '.join(known)}: off by {off:.3g}. Give "
            "one point's "
            "velocity along its path",
            v,
            off,
        )

    def of(name: str) -> tuple[float, float, float]:
        at = parts.index[name]
        x, y, z = (float(u) for u in v[at : at + 3]) if at < len(q) else (0.0, 0.0, 0.0)
        return x, y, z

    return replace(
        parts.full,
        points=tuple(replace(p, velocity=of(p.name)) for p in parts.full.points),
        vectors=tuple(replace(u, rate=of(u.name)) for u in parts.full.vectors),
    )
