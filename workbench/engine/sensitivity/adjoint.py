"""The continuous adjoint (AVM, section 2.5): the adjoint differential equations, integrated backwards.

    d(lam_q)/dt = (M^-1 K)^T lam_v,   d(lam_v)/dt = -lam_q + (M^-1 C)^T lam_v,
    dG/dalpha = integral of -lam_v^T M^-1 dF/dalpha dt                                (2.44), (2.45)

Differentiate-then-discretise: Runge-Kutta of order 4 over each step, states by cubic Hermite at the middle,
Simpson for the integral, so it agrees with the discrete gradient to second order only. Objectives that are
maxima or end values enter as jumps of lambda at their nodes; (2.41) to (2.45) print the integral form alone.
Without joints only.
"""

from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory
from ..objectives.reductions import Objective
from .seeds import seeds

__all__ = ["adjoint"]

Array = np.ndarray[Any, Any]


def adjoint(trajectory: AnyTrajectory, objective: Objective) -> Array:
    """(N,) dG/dalpha by the continuous adjoint. Raises NotSupported for systems with joints."""
    if trajectory.multiplier.shape[1]:
        raise NotSupported(
            "the continuous adjoint is written for systems without joints; use method='discrete_adjoint', "
            "which holds for joints as well"
        )
    r, h = trajectory, trajectory.step
    start = seeds(trajectory, objective)
    fine = np.linspace(0.0, float(r.times[-1]), 2 * len(r.times) - 1)
    system = trajectory.linearised(method="the continuous adjoint", times=fine)
    inverse = 1.0 / system.mass
    none = np.zeros(0)

    def look(q: Array, v: Array, index: int) -> tuple[Array, Array, Array]:
        at = system.tangents(index, q, v, none)
        design = system.design(index, q, v)
        return (
            (at.stiffness * inverse[:, None]).T,
            (at.damping * inverse[:, None]).T,
            -(design * inverse[:, None]),
        )

    n = system.size
    lq, lv = np.zeros(n), np.zeros(n)
    gradient = start.density.copy()
    node = start.last
    k1, c1, d1 = look(r.position[node], r.velocity[node], 2 * node)
    while True:
        push = start.acceleration[node]  # acceleration = -M^-1 F at the node
        lq = lq + start.position[node] - k1 @ push
        lv = lv + start.velocity[node] - c1 @ push
        gradient += push @ d1
        if node == 0:
            return gradient
        q0, q1, v0, v1 = r.position[node - 1], r.position[node], r.velocity[node - 1], r.velocity[node]
        w0, w1 = r.acceleration[node - 1], r.acceleration[node]
        qm = 0.5 * (q0 + q1) + h / 8.0 * (v0 - v1)
        vm = 0.5 * (v0 + v1) + h / 8.0 * (w0 - w1)
        km, cm, dm = look(qm, vm, 2 * node - 1)
        k0, c0, d0 = look(q0, v0, 2 * node - 2)
        aq, av = k1 @ lv, -lq + c1 @ lv
        bq, bv = km @ (lv - h / 2 * av), -(lq - h / 2 * aq) + cm @ (lv - h / 2 * av)
        eq, ev = km @ (lv - h / 2 * bv), -(lq - h / 2 * bq) + cm @ (lv - h / 2 * bv)
        fq, fv = k0 @ (lv - h * ev), -(lq - h * eq) + c0 @ (lv - h * ev)
        lq_next = lq - h / 6.0 * (aq + 2 * bq + 2 * eq + fq)
        lv_next = lv - h / 6.0 * (av + 2 * bv + 2 * ev + fv)
        slope_next = -lq_next + c0 @ lv_next
        middle = 0.5 * (lv + lv_next) - h / 8.0 * (av - slope_next)
        gradient += h / 6.0 * (lv @ d1 + 4.0 * middle @ dm + lv_next @ d0)
        lq, lv, k1, c1, d1 = lq_next, lv_next, k0, c0, d0
        node -= 1
