"""The "reverse method" for the compatibility matrix, eqs. (2.23) to (2.26): a counter-example, not a tool.

It solves B [q_{n+1} - q_0, ...] = -[Delta_{n+1} - Delta_0, ...] from j_n = 3 consecutive states. The three
increments are velocity, acceleration and jerk directions of one path, so the solve returns J a + v^T H v
instead of J a: its error does not shrink with the step, while its condition number grows. The analytic B of
the engine costs less. (2.26) also prints the right side with the sign opposite to (2.24).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.engine.planar._kernels.equations import place, unit_rows
from workbench.engine.planar._kernels.tables import work_space
from workbench.engine.planar.compiled import compiled
from workbench.engine.planar.trajectory import Trajectory

__all__ = ["ReverseCompatibility", "reverse_compatibility"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReverseCompatibility:
    """Relative error of the reversed matrix in the Frobenius norm, and the condition of its solve."""

    relative_error: float
    condition: float


def reverse_compatibility(trajectory: Trajectory, body: str, *, node: int) -> ReverseCompatibility:
    """Rebuild d(Delta)/dq of one body from nodes node .. node + 3 and compare with the analytic one.

    The members are those of the trajectory's system that end on `body`; other bodies move as they do.
    Raises ValueError when three nodes do not follow.
    """
    if not 0 <= node <= len(trajectory.times) - 4:
        raise ValueError(
            f"reverse method needs three nodes after node {node}, the run has {len(trajectory.times)}"
        )
    at = trajectory.system.coordinate(body)
    tables, parts = trajectory.tables, compiled(trajectory.system)
    work = work_space(tables)
    count = len(trajectory.density)
    rows = np.zeros((3, count))

    def deltas(index: int) -> Array:
        place(tables, work, index, trajectory.position[index], trajectory.velocity[index])
        unit_rows(tables, work, index, rows)
        return work.delta.copy()

    start = deltas(node)
    exact = np.zeros((count, 3))
    index = at.start // 3
    for pair, _, first, last in parts.arrays["segment"]:
        i, j = parts.arrays["pair"][pair]
        if index not in (i, j):
            continue
        b = (rows[:, first:last] / np.where(work.f[first:last] == 0.0, 1.0, work.f[first:last])).T
        big = work.big[pair]
        c, s = np.cos(work.q[3 * j + 2]), np.sin(work.q[3 * j + 2])
        jac = np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        if index == j:
            jac = np.array([[-c, -s, big[1]], [s, -c, -big[0]], [0.0, 0.0, -1.0]])
        exact[first:last] = b @ jac
    moves = np.array([trajectory.position[node + k, at] - trajectory.position[node, at] for k in (1, 2, 3)]).T
    grown = np.array([deltas(node + k) - start for k in (1, 2, 3)]).T
    found = np.linalg.solve(moves.T, grown.T).T
    known = np.abs(exact).sum(axis=1) > 0.0
    error = np.linalg.norm(found[known] - exact[known]) / np.linalg.norm(exact[known])
    return ReverseCompatibility(relative_error=float(error), condition=float(np.linalg.cond(moves)))
