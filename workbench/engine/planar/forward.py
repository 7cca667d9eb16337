"""Forward sensitivities of the states at every node: dq/dalpha for all members along a trajectory.

The discrete state equations differentiated step by step, so they are exact for the computed trajectory (the
direct method of chapter V with the matrices of the converged point):

    S w1' + Phi_q^T lambda1' = -(F_alpha + K Q* + C V*),   Phi_q w1' = -Phi_q Q*/(h^2 beta c)
    S = M + h gamma c C + h^2 beta c K,   Q*, V* the parts of q1', v1' that are known before the step

A rigid-body layout has a handful of coordinates and many members: each step is a few (n x n)(n x N)
products, and the gradient at *every* time comes with it. An adjoint sweep is cheaper for one gradient,
dearer for many peaks.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..integration.kinds import StateSensitivities
from ._kernels.forward import forward_sweep
from ._kernels.tables import Tables, work_space
from .compiled import Compiled, scale_slope

__all__ = ["forward_sensitivities"]

Array = NDArray[np.float64]


def forward_sensitivities(
    parts: Compiled, tables: Tables, density: Array, scheme: Any, states: Any, *, with_rates: bool
) -> StateSensitivities:
    """Differentiate a run of the alpha family by all densities, (N,) in member order.

    with_rates: also keep the sensitivities of velocity and acceleration; otherwise those arrays are empty.
    """
    r = states
    nodes, n = r.position.shape
    m, N = r.multiplier.shape[1], len(density)
    sorted_members = bool((np.diff(parts.order) > 0).all())
    table = np.empty((nodes, n, N))
    rates = np.empty((2, nodes if with_rates else 0, n, N))
    forward_sweep(
        tables, work_space(tables), np.array(scheme.numbers, dtype=float), float(r.times[1] - r.times[0]),
        r.position, r.velocity, r.multiplier, np.zeros(0), scale_slope(parts, density), np.eye(n + m),
        np.empty((n + m, n + m)), np.zeros(n + m, np.int64), np.empty((n + m, n + m)),
        *np.zeros((2, n, N)), np.zeros((m, N)), *np.zeros((4, n, N)), table, rates,
    )  # fmt: skip
    if not sorted_members:
        back = np.argsort(parts.order)  # segment order -> member order
        table, rates = table[:, :, back], rates[..., back]
    return StateSensitivities(position=table, velocity=rates[0], acceleration=rates[1])
