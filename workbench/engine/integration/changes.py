"""Slopes of an objective by any number of a system, from the multipliers of the points that a run solved.

    dG/dp = dG/dp at held states + dL/dp at held states + dG/d(start) . d(start)/dp

L is the sum of `_kernels.lagrangian`. It holds for every scheme whose backward sweep tells its multipliers:
what a scheme does between the points has no parameters.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from ._kernels.lagrangian import lagrangian
from .independent import IndependentEquations, Pulled
from .kinds import Change
from .seeds import Seeds

__all__ = ["Multipliers", "OfStates", "lagrangian_of", "moved_start", "multipliers", "slopes_by_change"]

Array = np.ndarray[Any, Any]


class OfStates(NamedTuple):
    """First-order states at the points, and the adjoint of their trapezoidal step that ends there."""

    z: Array  # (points, Z)
    eta: Array  # (points, Z), 0 at point 0


class Multipliers(NamedTuple):
    """Points at which the equations of a run were solved, and what its objective feels there.

    Point 0 is at the start. Of an index-3 scheme nu belongs to Phi at later points, to Phi'' at the start.
    """

    times: Array  # (points,)
    q: Array  # (points, n)
    v: Array
    w: Array
    lam: Array  # (points, m)
    mu: Array  # (points, n) adjoint of the equations of motion
    nu: Array  # (points, 3, m) adjoints of Phi, Phi', Phi''
    by_q: Array  # (n,) slopes by the place at the start
    by_v: Array
    whole: bool  # whether they hold what the equations at point 0 feel of the start
    states: OfStates | None = None


def multipliers(found: Pulled, times: Array, q: Array, v: Array) -> Multipliers:
    """Of a run in independent coordinates, at its points."""
    return Multipliers(
        times=times, q=q, v=v, w=found.w, lam=found.lam, mu=found.mu, nu=found.nu, by_q=found.by_q,
        by_v=found.by_v, whole=False,
    )  # fmt: skip


def moved_start(found: Multipliers, start: tuple[Array, Array]) -> tuple[Array, Array]:
    """q and v of all points, those of point 0 replaced where `by_q` and `by_v` leave its equations out."""
    q, v = found.q.copy(), found.v.copy()
    if not found.whole:
        q[0], v[0] = start
    return q, v


def lagrangian_of(equations: IndependentEquations, found: Multipliers, start: tuple[Array, Array]) -> float:
    """L with the numbers of a system on the run's samples, from a start of its own."""
    q, v = moved_start(found, start)
    out = np.zeros(1)
    lagrangian(*equations[:4], q, v, found.w, found.lam, found.mu, found.nu, out)
    return float(out[0])


def slopes_by_change(
    found: Multipliers,
    seeds: Seeds,
    changes: Sequence[Change],
    *,
    start: Callable[[Any], tuple[Array, Array]],
    total: Callable[[Any], float],
    held: Callable[[Any], float],
) -> Array:
    """(changes,) slopes, from the numbers of each change's systems by differences.

    start(system): place and velocity it starts from.  total(system): L with its numbers.  held(system): the
    objective at the states that ran, the first of them at that system's start.
    """
    out = []
    for change in changes:
        systems = change.around()
        starts = [start(system) for system in systems]
        dq, dv = (change.slope([one[part] for one in starts]) for part in range(2))
        # `held` moves the first node: what its seeds say of it is in there
        by_start = (found.by_q - seeds.position[0]) @ dq + (found.by_v - seeds.velocity[0]) @ dv
        explicit = change.slope([total(system) + held(system) for system in systems])
        out.append(float(by_start + explicit))
    return np.array(out)
