"""The equations of motion linearised at the nodes of a run: M, C, K, Phi_q and the design matrix dF/dalpha.

What the forward methods (direct, time integration, iterative, constant load) and the continuous adjoint
share. They propagate positions and velocities only; systems with more states (damage) are refused.
"""

from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import Linearisation
from ._kernels.energy import member_power
from ._kernels.equations import evaluate, place, unit_rows
from ._kernels.tables import Tables, Work, work_space
from .compiled import Compiled, scale_slope

__all__ = ["LinearisedRun"]

Array = np.ndarray[Any, Any]


class LinearisedRun:
    """Linearisations of a planar system on the grid of `tables`; `method` is named in what is refused."""

    def __init__(self, parts: Compiled, tables: Tables, density: Array, *, method: str) -> None:
        if parts.system.has_states:
            raise NotSupported(
                f"{method} does not carry the states of force elements, as the damage of breakable bushings; "
                "use method='discrete_adjoint'"
            )
        if parts.user:
            raise NotSupported(f"{method} does not know user laws; use method='discrete_adjoint'")
        self.parts = parts
        self.tables = tables
        self.work: Work = work_space(self.tables)
        self.mass: Array = self.tables.mass
        self.size = len(self.mass)
        self.rows = len(self.tables.row)
        self.members = len(density)
        self._slope = scale_slope(parts, density)
        self._b = np.zeros((3, self.members))
        self._z = np.zeros(len(self.tables.state_pair))

    def tangents(self, node: int, q: Array, v: Array, lam: Array) -> Linearisation:
        """Linearise at a state."""
        # copies: the kernel is compiled for arrays that could be written
        q, v, lam = q.copy(), v.copy(), lam.copy()
        evaluate(self.tables, self.work, node, q, v, lam, self._z, self._z, 0.0, True)
        w = self.work
        return Linearisation(
            force=w.force.copy(), stiffness=w.k.copy(), damping=w.c.copy(),
            constraint=w.phi.copy(), jacobian=w.phi_q.copy(),
        )  # fmt: skip

    def design(self, node: int, q: Array, v: Array) -> Array:
        """(n, N) dF/dalpha at a state, member order; -B^T dF_g/dalpha in the letters of (6.7), corrected."""
        place(self.tables, self.work, node, q.copy(), v.copy())
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

    def member_stiffness(self, node: int, q: Array, v: Array) -> Array:
        """(n, n) stiffness of the members alone at a state."""
        n = self.size
        full = n + self.tables.motion.shape[2]
        stiffness = np.empty((full, full))
        states = np.zeros((2, node + 1, n))
        states[:, node] = q, v
        member_power(
            self.tables, self.work, np.array([node]), states[0], states[1],
            np.empty(1), np.empty((1, 2, full)), stiffness, np.zeros((1, 2, self.members)),
        )  # fmt: skip
        return stiffness[:n, :n]

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
