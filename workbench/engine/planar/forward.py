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
from ._kernels.equations import contract, evaluate
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
    alpha_m, alpha_f, gamma, beta = (float(x) for x in scheme.numbers)
    h, c = float(r.times[1] - r.times[0]), (1 - alpha_f) / (1 - alpha_m)
    nodes, n = r.position.shape
    m, N = r.multiplier.shape[1], len(density)
    work = work_space(tables)
    sorted_members = bool((np.diff(parts.order) > 0).all())
    slope = scale_slope(parts, density)
    table = np.empty((nodes, n, N))
    rates = np.empty((2, nodes, n, N)) if with_rates else np.empty((2, 0, n, N))
    X, V, W, A, F = (np.zeros((n, N)) for _ in range(5))
    unit, nothing, matrix = np.eye(n), np.zeros(0), np.zeros((n + m, n + m))
    for node in range(nodes):
        evaluate(
            tables,
            work,
            node,
            r.position[node],
            r.velocity[node],
            r.multiplier[node],
            nothing,
            nothing,
            0.0,
            True,
        )
        F[:] = 0.0
        for i in range(n):
            contract(tables, work, node, unit[i], F[i])
        if not (slope == 1.0).all():
            F *= slope
        share, ahead, ahead2 = (1.0, 0.0, 0.0) if node == 0 else (c, h * gamma, h * h * beta)
        matrix[:n, :n] = np.diag(tables.mass) + share * (ahead * work.c + ahead2 * work.k)
        matrix[:n, n:] = work.phi_q.T
        matrix[n:, :n] = work.phi_q
        inverse = np.linalg.inv(matrix)  # small: n + m coordinates and multipliers, N right-hand sides
        if node:
            known = (alpha_f * W - alpha_m * A) / (1 - alpha_m) if alpha_f or alpha_m else np.zeros((n, N))
            Q = X + h * V + (h * h * (0.5 - beta)) * A
            U = V + (h * (1 - gamma)) * A
            if alpha_f or alpha_m:
                Q += (h * h * beta) * known
                U += (h * gamma) * known
            F += work.k @ Q
            if work.c.any():
                F += work.c @ U
            W = inverse[:n, :n] @ -F
            if m:
                W -= inverse[:n, n:] @ (work.phi_q @ Q) / (ahead2 * c)
            A = known + c * W if alpha_f or alpha_m else W
            X = Q + (ahead2 * c) * W if ahead2 else Q
            V = U + (ahead * c) * W
        else:
            W = inverse[:n, :n] @ -F
            A = W.copy()
        table[node] = X
        if with_rates:
            rates[0, node], rates[1, node] = V, W
    if not sorted_members:
        back = np.argsort(parts.order)  # segment order -> member order
        table, rates = table[:, :, back], rates[..., back]
    return StateSensitivities(position=table, velocity=rates[0], acceleration=rates[1])
