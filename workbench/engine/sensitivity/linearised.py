"""The equations of motion linearised at the nodes of a run: M, C, K, Phi_q and the design matrix dF/dalpha.

What the forward methods (direct, time integration, iterative, constant load) and the continuous adjoint
share. They
propagate positions and velocities only; systems with breakable bushings have more states and are refused.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..objectives.quantities import scale_slope
from ..planar._kernels.equations import evaluate, place, unit_rows
from ..planar._kernels.tables import Tables, Work, work_space
from ..planar.compiled import Compiled, compiled
from ..planar.trajectory import Trajectory

__all__ = ["Linearised", "Tangents"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Tangents:
    """F, K = d(F + Phi_q^T lambda)/dq, C = dF/dv, Phi and Phi_q at one state; fresh arrays."""

    force: Array  # (n,)
    stiffness: Array  # (n, n)
    damping: Array  # (n, n)
    constraint: Array  # (m,)
    jacobian: Array  # (m, n)


class Linearised:
    """Linearisations of a trajectory's system, on its own grid or on another (`tables`)."""

    def __init__(
        self, trajectory: Trajectory, tables: Tables | None = None, *, method: str = "this method"
    ) -> None:
        if any(bushing.breakable for bushing in trajectory.system.bushings):
            raise NotSupported(
                f"{method} does not carry the damage state of breakable bushings; "
                "use method='discrete_adjoint'"
            )
        self.parts: Compiled = compiled(trajectory.system)
        if self.parts.user:
            raise NotSupported(f"{method} does not know user laws; use method='discrete_adjoint'")
        self.tables: Tables = trajectory.tables if tables is None else tables
        self.work: Work = work_space(self.tables)
        self.mass: Array = self.tables.mass
        self.size = len(self.mass)
        self.rows = len(self.tables.row)
        self.members = len(trajectory.density)
        self._slope = scale_slope(trajectory)
        self._b = np.zeros((3, self.members))
        self._z = np.zeros(len(self.tables.bushing_pair))

    def tangents(self, node: int, q: Array, v: Array, lam: Array) -> Tangents:
        """Linearise at a state."""
        evaluate(self.tables, self.work, node, q, v, lam, self._z, self._z, 0.0, True)
        w = self.work
        return Tangents(
            force=w.force.copy(), stiffness=w.k.copy(), damping=w.c.copy(),
            constraint=w.phi.copy(), jacobian=w.phi_q.copy(),
        )  # fmt: skip

    def design(self, node: int, q: Array, v: Array) -> Array:
        """(n, N) dF/dalpha at a state, member order; -B^T dF_g/dalpha in the letters of (6.7), corrected."""
        place(self.tables, self.work, node, q, v)
        unit_rows(self.tables, self.work, node, self._b)
        out = np.zeros((self.size, self.members))
        arrays, order = self.parts.arrays, self.parts.order
        for pair, _, first, last in arrays["segment"]:
            columns = self._b[:, first:last] * self._slope[first:last]
            i, j = arrays["pair"][pair]
            jac = self._pair_map(i, j, self.work.big[pair])
            for body, part in ((i, jac[:, :3]), (j, jac[:, 3:])):
                if 3 * body < self.size:
                    out[3 * body : 3 * body + 3, order[first:last]] += part.T @ columns
        return out

    def _pair_map(self, i: int, j: int, big: Array) -> Array:
        angle = self.work.q[3 * j + 2]
        c, s = np.cos(angle), np.sin(angle)
        return np.array(
            [[c, s, 0.0, -c, -s, big[1]], [-s, c, 0.0, s, -c, -big[0]], [0.0, 0.0, 1.0, 0.0, 0.0, -1.0]]
        )

    def saddle(self, block: Array, jacobian: Array) -> Array:
        """[[block, J^T], [J, 0]]."""
        n, m = self.size, self.rows
        out = np.zeros((n + m, n + m))
        out[:n, :n] = block
        out[:n, n:] = jacobian.T
        out[n:, :n] = jacobian
        return out
