"""Planar systems as the time loops see them: compiled kernels, the laws that users write in Python, and the
work arrays of schemes in independent coordinates with the rates of what is prescribed."""

from typing import Any

import numpy as np

from ..integration.chart import Chart, Rates, chart
from ._kernels.equations import (
    add_segment,
    contract,
    contract_segment,
    evaluate,
    measure_segment,
    place,
)
from ._kernels.row_kinds import ANGLE
from ._kernels.tables import Tables, work_space
from .compiled import Compiled, UserSegment, drive_slopes

__all__ = ["SampledEquations", "chart_of", "rates_of"]

Array = np.ndarray[Any, Any]

TURNING = 0.1  # angles become dependent only where ten times as well determined as positions


class SampledEquations:
    """`Equations` of a planar system on a sampled grid; states of force elements are 0 unless given."""

    def __init__(self, parts: Compiled, tables: Tables) -> None:
        self.tables = tables
        self.parts = parts
        self.work = work_space(tables)
        self.size, self.rows, self.members = len(tables.mass), len(tables.row), len(tables.scale)
        self.mass = np.diag(tables.mass)
        self.force, self.stiffness, self.damping = self.work.force, self.work.k, self.work.c
        self.constraint, self.jacobian = self.work.phi, self.work.phi_q
        self._z = np.zeros(len(tables.state_pair))

    def look(self, node: int, q: Array, v: Array, lam: Array, z: Array | None = None) -> None:
        """Evaluate everything at a state; z: of the force elements."""
        given = self._z if z is None else z
        evaluate(self.tables, self.work, node, q, v, lam, given, self._z, 0.0, True)
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


def chart_of(tables: Tables, phi_q: Array, dtype: Any = float) -> Chart:
    """The arrays of a planar system; phi_q is its Jacobian at the start, for the scale of the angles."""
    n, m = len(tables.mass), len(tables.row)
    weight = np.ones(n)
    for at in range(2, n, 3):
        longest = np.abs(phi_q[tables.row[:, 0] != ANGLE, at]).max(initial=0.0)
        weight[at] = TURNING / max(longest, 1e-12) if longest > 0.0 else TURNING
    full = n + tables.motion.shape[2]
    return chart(np.diag(tables.mass), weight, m, full=full, states=len(tables.state_pair), dtype=dtype)


def rates_of(parts: Compiled, times: Array) -> Rates:
    """Derivatives of a planar system's motions and drives at the given times."""
    motion = np.zeros((len(times), 3 * len(parts.motions)))
    for index, body in enumerate(parts.motions[:-1]):
        motion[:, 3 * index : 3 * index + 3] = [body.push(float(t)) for t in times]
    drive = np.zeros((len(times), 2, len(parts.drives)))
    if any(function is not None for function in parts.drives):
        for node, t in enumerate(times):
            drive[node] = drive_slopes(parts, float(t))
    return Rates(motion=motion, drive=drive)
