"""Static equilibrium of trees, as a start, and small vibrations about it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import block_diag, null_space

from ..errors import NotConverged
from ._kernels.forces import look_linearised, look_moved
from ._kernels.tables import TreeTables, TreeWork, tree_work
from .compiled import TreeCompiled, tree_compiled, tree_on_grid
from .elements import CoordinateSpring
from .restart import restarted
from .system import TreeSystem

__all__ = ["Equilibrium", "Modes", "equilibrium", "modes"]

Array = np.ndarray[Any, Any]

LONGEST = 0.2  # rad or m: no coordinate moves further in one step
FLAT = 1e-9  # of the largest singular value: directions in which nothing holds and nothing pulls
STEPS = (0.1, 0.3, 0.6, 1.0)  # of gravity and loads, where the whole at once fails


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Equilibrium:
    """A system that starts at rest in equilibrium.

    torques: of the coordinates that were held, (body, coordinate) -> N m or N, already among its springs.
    residual: largest unbalanced joint force (N or N m) over the level of the forces.
    moved: largest change of a coordinate, rad or m.
    free: directions in which the system is indifferent (a car may stand anywhere).
    """

    system: TreeSystem
    torques: dict[tuple[str, int], float]
    residual: float
    moved: float
    free: int
    iterations: int


def equilibrium(
    system: TreeSystem,
    density: Array,
    *,
    held: Sequence[tuple[str, int]] = (),
    tolerance: float = 1e-10,
    iterations: int = 200,
) -> Equilibrium:
    """Find the positions at which nothing accelerates, from the given start: r(q, 0, 0) = 0 by Newton.

    held: coordinates (body, number) that stay where they are; constant torques balance them. States of
    first order are zero, functions of time stand at t = 0. Steps are limited; where the whole load
    does not settle, gravity and loads grow in parts. Raises NotConverged with the bodies out of balance.
    """
    parts = tree_compiled(system)
    tables = _tables(parts, density)
    columns = [parts.columns[body].start + coordinate for body, coordinate in held]
    n, full = len(tables.column), parts.size
    # forces of cut joints are found along with the places
    loose = np.append(np.setdiff1d(np.arange(n), columns), np.arange(full - len(tables.cut), full))
    found = _settle(parts, tables, parts.start[0], loose, tolerance, iterations)
    if found.size > tolerance:
        q, count = parts.start[0], found.count
        for share in STEPS:
            part = tables._replace(gravity=share * tables.gravity, load_sample=share * tables.load_sample)
            found = _settle(parts, part, q, loose, tolerance, iterations)
            q, count = found.q, count + found.count
        found = replace(found, count=count)
    if found.size > tolerance:
        raise NotConverged(_unbalanced(parts, found), 0.0)
    torques = {which: float(found.force[column]) for which, column in zip(held, columns, strict=True)}
    there = restarted(system, found.q)
    springs = there.springs + tuple(
        CoordinateSpring(body=body, coordinate=i, torque=torque) for (body, i), torque in torques.items()
    )
    return Equilibrium(
        system=replace(there, springs=springs), torques=torques, residual=found.size,
        moved=float(np.abs(found.q - parts.start[0]).max()), free=found.free, iterations=found.count,
    )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _Settled:
    q: Array
    force: Array
    size: float
    free: int
    count: int
    loose: Array


def _tables(parts: TreeCompiled, density: Array) -> TreeTables:
    """The tables at the start; an opening of 1 m of a cut joint counts like the weight (or 1 N)."""
    weight = float(parts.arrays["inertia"][:, 0].sum()) * float(np.linalg.norm(parts.arrays["gravity"]))
    return tree_on_grid(parts, np.asarray(density, float), np.zeros(1), closing=np.array([max(weight, 1.0)]))


def _forces(
    parts: TreeCompiled, tables: TreeTables, work: TreeWork, q: Array, pull: Array
) -> tuple[Array, float]:
    """Joint forces at rest under the forces of cut joints in `pull`, and their level: weight times the lever
    of each coordinate, in one number. States stand as they start."""
    rest = parts.start[1].copy()
    rest[: len(tables.column)] = 0.0
    look_linearised(tables, work, 0, q, rest, pull)
    return work.force.copy(), float(np.abs(work.force).max())


def _start_pull(parts: TreeCompiled, tables: TreeTables, work: TreeWork, q: Array, loose: Array) -> Array:
    """(n,) zeros, and the forces of cut joints that balance the loose coordinates best."""
    pull, first = np.zeros(parts.size), parts.size - len(tables.cut)
    if first < parts.size:
        force, _ = _forces(parts, tables, work, q, pull)
        rows = loose[loose < first]
        pull[first:] = -np.linalg.lstsq(work.m[rows, first:], force[rows], rcond=FLAT)[0]
    return pull


def _settle(
    parts: TreeCompiled, tables: TreeTables, start: Array, loose: Array, tolerance: float, iterations: int
) -> _Settled:
    work = tree_work(tables, len(parts.states))
    n, first = len(tables.column), parts.size - len(tables.cut)
    pull = _start_pull(parts, tables, work, start, loose)
    weight = float(tables.inertia[:, 0].sum()) * float(np.linalg.norm(tables.gravity))
    unit = tables.closing[0]  # of forces of cut joints, so that stiff and unit entries do not mix
    q, free = start.copy(), 0
    force, level = _forces(parts, tables, work, q, pull)
    level = max(level, weight, 1e-12)
    size = np.linalg.norm(force[loose]) / level
    count = 0
    while count < iterations:
        if np.abs(force[loose]).max(initial=0.0) <= tolerance * level:
            break
        count += 1
        slopes = work.k.copy()
        slopes[:, first:] = unit * work.m[:, first:]  # forces of cut joints stand among the rates
        u, s, vt = np.linalg.svd(slopes[np.ix_(loose, loose)])
        keep = s > FLAT * s.max(initial=0.0)
        free = int((~keep).sum())
        move = np.zeros(parts.size)
        move[loose] = -vt[keep].T @ ((u[:, keep].T @ force[loose]) / s[keep])
        move *= min(1.0, LONGEST / max(float(np.abs(move[:n]).max()), 1e-300))
        share, better = 1.0, False
        for _ in range(12):
            there = np.empty_like(q)
            look_moved(tables, q, share * move, there)
            pulled = _pulled(pull, share * unit * move, first)
            tried, _ = _forces(parts, tables, work, there, pulled)
            now = np.linalg.norm(tried[loose]) / level
            if now < size * (1.0 - 1e-4 * share):
                better = True
                break
            share *= 0.5
        if not better:  # over the hill: a step of full length, once more uphill, may find another valley
            look_moved(tables, q, 0.5 * move, there)
            pulled = _pulled(pull, 0.5 * unit * move, first)
            tried, _ = _forces(parts, tables, work, there, pulled)
            now = np.linalg.norm(tried[loose]) / level
        q, pull, force, size = there, pulled, tried, now
    worst = float(np.abs(force[loose]).max(initial=0.0)) / level
    return _Settled(q=q, force=force, size=worst, free=free, count=count, loose=loose)


def _pulled(pull: Array, move: Array, first: int) -> Array:
    """The forces of cut joints after a step."""
    out = pull.copy()
    out[first:] += move[first:]
    return out


def _unbalanced(parts: TreeCompiled, found: _Settled) -> str:
    pulls = {}
    for body, columns in parts.columns.items():
        own = np.intersect1d(np.arange(columns.start, columns.stop), found.loose)
        if len(own):
            pulls[body] = float(np.abs(found.force[own]).max())
    worst = sorted(pulls, key=lambda body: -pulls[body])[:3]
    return (
        f"no equilibrium near the start after {found.count} steps: out of balance stay "
        + ", ".join(f"'{body}' ({pulls[body]:.3g} N or N m)" for body in worst)
        + ". Hold coordinates with held=, or give the springs that carry them"
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Modes:
    """Small vibrations about the start: one row per oscillation or decay, slowest first.

    eigenvalues: (k,) complex, 1/s.  frequency: (k,) |eigenvalue|/2 pi, Hz.  damping: (k,) ratio, 1 for a
    decay, negative where it grows.  shapes: (k, n) small motions of the joints, largest entry 1.
    """

    eigenvalues: Array
    frequency: Array
    damping: Array
    shapes: Array


def modes(system: TreeSystem, density: Array, *, slowest: float = 1e-3) -> Modes:
    """Linearise about the start (as `equilibrium` leaves it) and solve for its motions, first-order states
    included.

    slowest: Hz below which motions count as rigid and are left out.
    """
    parts = tree_compiled(system)
    tables = _tables(parts, density)
    work = tree_work(tables, len(parts.states))
    n, full = len(tables.column), parts.size - len(tables.cut)
    _forces(
        parts, tables, work, parts.start[0], _start_pull(parts, tables, work, parts.start[0], np.arange(n))
    )
    # motions that the cut joints leave: q = free y
    free = null_space(work.k[full:, :n]) if len(tables.cut) else np.eye(n)
    k = free.shape[1]
    basis = block_diag(free, np.eye(full - n))
    mass = basis.T @ work.m[:full, :full] @ basis
    a = np.zeros((k + k + full - n, k + k + full - n))
    a[:k, k : 2 * k] = np.eye(k)
    a[k:, :k] = -np.linalg.solve(mass, basis.T @ work.k[:full, :n] @ free)
    a[k:, k:] = -np.linalg.solve(mass, basis.T @ work.c[:full, :full] @ basis)
    values, vectors = np.linalg.eig(a)
    some = (values.imag >= 0.0) & (np.abs(values) > 2.0 * np.pi * slowest)
    values, shapes = values[some], (free @ vectors[:k, some]).T
    order = np.argsort(np.abs(values))
    values, shapes = values[order], shapes[order]
    largest = np.take_along_axis(shapes, np.abs(shapes).argmax(axis=1)[:, None], axis=1)
    return Modes(
        eigenvalues=values, frequency=np.abs(values) / (2.0 * np.pi), damping=-values.real / np.abs(values),
        shapes=shapes / largest,
    )  # fmt: skip
