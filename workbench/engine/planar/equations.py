"""Planar systems as the time loops see them: compiled kernels, and the laws that users write in Python."""

from typing import Any

import numpy as np

from ._kernels.equations import (
    add_segment,
    contract,
    contract_segment,
    evaluate,
    measure_segment,
    place,
)
from ._kernels.tables import Tables, work_space
from .compiled import Compiled, UserSegment

__all__ = ["SampledEquations"]

Array = np.ndarray[Any, Any]


class SampledEquations:
    """`Equations` of a planar system on a sampled grid; states of force elements stay 0 here."""

    def __init__(self, parts: Compiled, tables: Tables) -> None:
        self.tables = tables
        self.parts = parts
        self.work = work_space(tables)
        self.size, self.rows, self.members = len(tables.mass), len(tables.row), len(tables.scale)
        self.mass = np.diag(tables.mass)
        self.force, self.stiffness, self.damping = self.work.force, self.work.k, self.work.c
        self.constraint, self.jacobian = self.work.phi, self.work.phi_q
        self._z = np.zeros(len(tables.state_pair))

    def look(self, node: int, q: Array, v: Array, lam: Array) -> None:
        """Evaluate everything at a state."""
        evaluate(self.tables, self.work, node, q, v, lam, self._z, self._z, 0.0, True)
        for segment in self.parts.user:
            self._apply(segment, float(self.tables.times[node]))
            add_segment(self.tables, self.work, segment.pair, segment.first, segment.last, True)

    def contract(self, node: int, q: Array, v: Array, mu: Array, gradient: Array) -> None:
        """gradient (N,) += (dF/dscale)^T mu, segment order."""
        place(self.tables, self.work, node, q, v)
        contract(self.tables, self.work, node, mu, gradient)
        for segment in self.parts.user:
            self._apply(segment, float(self.tables.times[node]))
            contract_segment(self.tables, self.work, segment.pair, segment.first, segment.last, mu, gradient)

    def _apply(self, segment: UserSegment, t: float) -> None:
        """Fill the work arrays of one user's segment: force and slopes at unit density."""
        w, part, law = self.work, slice(segment.first, segment.last), segment.law
        measure_segment(self.tables, w, segment.pair, segment.first, segment.last)
        delta, rate = w.delta[part].copy(), w.rate[part].copy()
        w.f[part], w.fd[part], w.fv[part] = law.linearised(delta, rate, t)
