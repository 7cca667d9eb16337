"""Iterative sensitivities (chapter VI): finite differences in time of dq/dalpha by steps, (6.9) to (6.29).

    S_n dq_n/dalpha = -(dF_n/dalpha + M sum c_i dq_{n-i}/dalpha + C sum b_i dq_{n-i}/dalpha),  Phi_q dq_n = 0
    S_n = c_0 M + b_0 C + K

dr/dalpha is -B^T dF_g/dalpha: (6.7) and (6.33) to (6.46) write dK/dalpha q, which holds for linear systems
only, and (6.31) counts F_n twice. Three sets of coefficients: "printed" (6.10), which the text calls second
order and is first; "bdf2", the true second-order ones applied twice; "truncated", (6.10) with the inverse
(6.45), conditionally stable.
"""

from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory
from ..objectives.reductions import Objective
from .seeds import seeds

__all__ = ["iterative"]

Array = np.ndarray[Any, Any]

# times 1/h^2 and 1/h
SECOND = {"printed": (1.0, -2.0, 1.0), "bdf2": (9 / 4, -6.0, 11 / 2, -2.0, 1 / 4)}
FIRST = {"printed": (1.0, -1.0), "bdf2": (3 / 2, -2.0, 1 / 2)}


def iterative(trajectory: AnyTrajectory, objective: Objective, *, form: str = "bdf2") -> Array:
    """(N,) dG/dalpha of chapter VI; form: "bdf2", "printed" or "truncated"."""
    if form not in ("bdf2", "printed", "truncated"):
        raise ValueError(f"form needs to be 'bdf2', 'printed' or 'truncated', got '{form}'")
    truncated = form == "truncated"
    system = trajectory.linearised(method="the iterative method")
    if truncated and system.rows:
        raise NotSupported("the truncated inverse (6.45) is for systems without joints; use form='bdf2'")
    second = SECOND["printed" if truncated else form]
    first = FIRST["printed" if truncated else form]
    start = seeds(trajectory, objective)
    r, n, h = trajectory, system.size, trajectory.step
    gradient: Array = start.density.copy()
    # dq is zero at and before the start: positions and velocities there do not depend on the design
    zero: Array = np.zeros((n, system.members))
    past = [zero] * (len(second) - 1)
    mass = np.diag(system.mass)
    for node in range(1, start.last + 1):
        q, v = r.position[node], r.velocity[node]
        at = system.tangents(node, q, v, r.multiplier[node])
        pulled = sum((c / h**2 * s for c, s in zip(second[1:], past, strict=True)), start=zero)
        drifted = sum((b / h * s for b, s in zip(first[1:], past[: len(first) - 1], strict=True)), start=zero)
        right = np.zeros((n + system.rows, system.members))
        right[:n] = -(system.design(node, q, v) + system.mass[:, None] * pulled + at.damping @ drifted)
        if truncated:
            light = h * h / second[0] / system.mass
            stiff = at.stiffness + first[0] / h * at.damping
            found: Array = light[:, None] * right - light[:, None] * (stiff @ (light[:, None] * right))
        else:
            block = second[0] / h**2 * mass + first[0] / h * at.damping + at.stiffness
            found = np.linalg.solve(system.saddle(block, at.jacobian), right)
        now = found[:n]
        gradient += start.position[node] @ now
        if start.velocity[node].any():
            gradient += start.velocity[node] @ (first[0] / h * now + drifted)
        if start.acceleration[node].any():
            gradient += start.acceleration[node] @ (second[0] / h**2 * now + pulled)
        if start.multiplier[node].any():
            gradient += start.multiplier[node] @ found[n:]
        past = [now, *past[:-1]]
    return gradient
