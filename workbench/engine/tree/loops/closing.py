"""Loops closed at the start: the nearest places and velocities of the joints that meet all cut joints.

With phi(q) = 0 and J = phi_q: Newton steps of least size, dq = -J^+ phi, then dv = -J^+ phi'. Conditions that
others imply are set aside.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...errors import AssemblyError, InvalidSystem
from ...integration.redundancy import redundancy
from .._kernels.cuts import TURN
from .._kernels.factors import elimination
from .._kernels.forces import look_linearised, look_moved
from .._kernels.tables import TreeTables, TreeWork, tree_work
from .cuts import CutRows

__all__ = ["Nearest", "closed", "nearest"]

Array = np.ndarray[Any, Any]
OnGrid = Callable[..., TreeTables]  # `compiled.tree_on_grid`

CLOSE = 0.01  # m, rad, m/s, rad/s: what is closed without asking; typed with three digits passes
TIGHT = 1e-13  # m or rad: rounding
LEFT = 1e-9  # m or rad: a loop that stays open by more cannot be closed
LONGEST = 0.2  # rad or m: no joint moves further in one step
FLAT = 1e-8  # of the largest singular value: directions in which conditions say nothing
STEPS = 100


@dataclass(frozen=True, slots=True, kw_only=True)
class Nearest:
    """Joints moved so that the loops close: q, v; slopes J there; phi, phi' (m,) before and after."""

    q: Array
    v: Array
    jacobian: Array
    before: tuple[Array, Array]
    after: tuple[Array, Array]


def nearest(parts: Any, on_grid: OnGrid, loose: Array) -> Nearest:
    """The nearest places and velocities that meet the conditions, columns other than `loose` held.

    parts: a `TreeCompiled`.
    """
    given, speed = parts.start
    full, n = len(speed), len(parts.arrays["column"])
    places, rates = (
        on_grid(parts, np.ones(len(parts.power)), np.zeros(1), closing=np.array([level]))
        for level in (1.0, -1.0)
    )
    work = tree_work(places, len(parts.states))
    q, rest = given.copy(), np.zeros(full)
    phi, jacobian = _conditions(places, work, q, rest)
    before = phi
    for _ in range(STEPS):
        if np.abs(phi).max() <= TIGHT:
            break
        move = np.zeros(full)
        move[loose] = _least(jacobian[:, loose], phi)
        move *= min(1.0, LONGEST / max(float(np.abs(move[:n]).max()), 1e-300))
        there = np.empty_like(q)
        look_moved(places, q, move, there)
        found, slopes = _conditions(places, work, there, rest)
        if np.abs(found).max() >= np.abs(phi).max() and np.abs(phi).max() < LEFT:
            break
        q, phi, jacobian = there, found, slopes
    v = speed.copy()
    rate, _ = _conditions(rates, work, q, v)
    first = rate
    if np.abs(rate).max() > TIGHT:
        v[loose] += _least(jacobian[:, loose], rate)
        rate, _ = _conditions(rates, work, q, v)
    return Nearest(q=q, v=v, jacobian=jacobian, before=(before, first), after=(phi, rate))


def _conditions(tables: TreeTables, work: TreeWork, q: Array, v: Array) -> tuple[Array, Array]:
    """Rows of the conditions in the residual, and their slopes by the joints."""
    look_linearised(tables, work, 0, q, v, np.zeros(len(v)))
    rows = slice(len(v) - len(tables.cut), None)
    return work.force[rows].copy(), work.k[rows, : len(tables.column)].copy()


def _least(jacobian: Array, phi: Array) -> Array:
    return -np.linalg.lstsq(jacobian, phi, rcond=FLAT)[0]


def closed(parts: Any, on_grid: OnGrid) -> Any:
    """The tables with a start that meets the conditions, and with those that are independent there.

    Raises AssemblyError where a loop is open or parts at the start, InvalidSystem where nothing can move.
    """
    rows, n = parts.cut_rows, len(parts.arrays["column"])
    found = nearest(parts, on_grid, np.arange(n))
    for sizes, limit, units, verb in (
        (found.before[0], CLOSE, ("m", "rad"), "is open"),
        (found.after[0], LEFT, ("m", "rad"), "cannot be closed and stays open"),
        (found.before[1], CLOSE, ("m/s", "rad/s"), "parts"),
        (found.after[1], LEFT, ("m/s", "rad/s"), "cannot be held together and parts"),
    ):
        said = opening(parts, rows, sizes, limit, units)
        if said:
            raise AssemblyError(
                f"{said[0]} {verb} at the start by {said[1]}. close_loops(system, held=...) moves the other "
                "joints so that it closes",
                found.q, float(np.abs(found.q - parts.start[0]).max()),
            )  # fmt: skip
    independent = redundancy(rows.names, found.jacobian)
    if independent.rank >= n:
        raise InvalidSystem(
            f"cut joints leave no motion: {independent.rank} independent conditions on {n} velocities"
        )
    kept = np.array([name not in independent.rows for name in rows.names])
    arrays = parts.arrays | {"cut": rows.table[kept], "cut_place": rows.place[kept]}
    states = len(parts.states)
    return replace(
        parts, arrays=arrays, start=(found.q, found.v[: n + states + int(kept.sum())]), kept=kept,
        pattern=elimination(arrays, states),
    )  # fmt: skip


def opening(
    parts: Any, rows: CutRows, sizes: Array, limit: float, units: Sequence[str]
) -> tuple[str, str] | None:
    """The worst cut joint and by how much it is open in both units; None where all are within the limit."""
    if np.abs(sizes).max() <= limit:
        return None
    worst = rows.joint[int(np.abs(sizes).argmax())]
    own, turns = rows.joint == worst, rows.table[:, 1] == TURN
    parts_of = [
        f"{np.abs(sizes[own & some]).max():.3g} {unit}"
        for some, unit in zip((~turns, turns), units, strict=True)
        if (own & some).any()
    ]
    return f"cut joint '{parts.cuts[worst].label}'", " and ".join(parts_of)
