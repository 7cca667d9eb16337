"""Work arrays of a planar system in independent coordinates, and the rates of what is prescribed."""

from typing import Any

import numpy as np

from ..integration.chart import Chart, Rates, chart
from ._kernels.row_kinds import ANGLE
from ._kernels.tables import Tables
from .compiled import Compiled, drive_slopes

__all__ = ["chart_of", "rates_of"]

Array = np.ndarray[Any, Any]

TURNING = 0.1  # angles become dependent only where ten times as well determined as positions


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
