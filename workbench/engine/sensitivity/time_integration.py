"""Time-integration-incorporated sensitivities (chapter V): differentiate one Newton step from the predictor.

    [q1; lambda1] = [q0; 0] - S0^-1 [r0; Phi0],   S0 at the predictor, lambda = 0, zero acceleration  (5.11)

and its derivative (5.13), with or without the term dS/dalpha. (5.5) prints the signs (+, -, -); the chain
rule gives + on all three. With dS/dalpha it is the exact gradient as far as one Newton step solves a step of
the scheme. Taken at the converged point instead, the term disappears: that is `direct`.
"""

from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory, Linearised
from ..integration.schemes import GeneralisedAlpha
from ..objectives.reductions import Objective
from .direct import StateSlopes, start_slopes
from .seeds import seeds

__all__ = ["time_integration"]

Array = np.ndarray[Any, Any]

DIFFERENCE = 1e-5  # relative size of the central differences that make dS/dalpha along the Newton step


def time_integration(trajectory: AnyTrajectory, objective: Objective, *, matrix_slope: bool = True) -> Array:
    """(N,) dG/dalpha of chapter V; matrix_slope=False drops dS/dalpha."""
    scheme = trajectory.scheme
    if not isinstance(scheme, GeneralisedAlpha):
        raise NotSupported(f"chapter V is written for generalised-alpha, not {type(scheme).__name__}")
    start = seeds(trajectory, objective)
    system = trajectory.linearised(method="time integration")
    r, n, h = trajectory, system.size, trajectory.step
    am, af, gamma, beta = scheme.numbers
    heavy = (1.0 - am) / (h * h * beta * (1.0 - af))  # beta', gamma' of (2.34)
    quick = gamma / (h * beta)
    none = np.zeros(system.rows)
    slopes = start_slopes(system, trajectory)
    gradient = start.density + slopes.project(start)
    s_alike, alike = slopes.acceleration, r.acceleration[0]
    for node in range(1, start.last + 1):
        # predictor (2.32) and its slopes (5.6) to (5.10)
        a0 = (af * r.acceleration[node - 1] - am * alike) / (1.0 - am)
        q0 = r.position[node - 1] + h * r.velocity[node - 1] + h * h * ((0.5 - beta) * alike + beta * a0)
        v0 = r.velocity[node - 1] + h * ((1.0 - gamma) * alike + gamma * a0)
        sa0 = (af * slopes.acceleration - am * s_alike) / (1.0 - am)
        sq0 = slopes.position + h * slopes.velocity + h * h * ((0.5 - beta) * s_alike + beta * sa0)
        sv0 = slopes.velocity + h * ((1.0 - gamma) * s_alike + gamma * sa0)
        at = system.tangents(node, q0, v0, none)
        matrix = system.saddle(heavy * np.diag(system.mass) + quick * at.damping + at.stiffness, at.jacobian)
        right = np.zeros((n + system.rows, system.members))
        right[:n] = -(at.stiffness @ sq0 + at.damping @ sv0 + system.design(node, q0, v0))
        right[n:] = -(at.jacobian @ sq0)
        if matrix_slope:
            step = np.concatenate([r.position[node] - q0, r.multiplier[node]])
            right -= _matrix_slope(system, node, q0, v0, step, quick, sq0, sv0)
        found = np.linalg.solve(matrix, right)
        slopes = StateSlopes(
            node=node, position=sq0 + found[:n], velocity=sv0 + quick * found[:n],
            acceleration=heavy * found[:n], multiplier=found[n:],
        )  # fmt: skip
        s_alike = sa0 + (1.0 - af) / (1.0 - am) * slopes.acceleration
        alike = a0 + (1.0 - af) / (1.0 - am) * r.acceleration[node]
        gradient += slopes.project(start)
    return np.asarray(gradient)


def _matrix_slope(
    system: Linearised, node: int, q: Array, v: Array, step: Array, quick: float, sq: Array, sv: Array
) -> Array:
    """(dS/dalpha) step: slopes of forces are symmetric, so one directional difference of (K, C) does it."""
    n = system.size
    move, lam = step[:n], step[n:]
    size = max(float(np.abs(move).max()), 1e-300)
    e = DIFFERENCE / max(size, quick * size * 1e-3)
    none = np.zeros_like(lam)
    up = system.tangents(node, q + e * move, v + e * quick * move, none)
    down = system.tangents(node, q - e * move, v - e * quick * move, none)
    by_q = (up.stiffness - down.stiffness) / (2.0 * e)
    by_v = (up.damping - down.damping) / (2.0 * e)
    # d(Phi_q^T lambda)/dq is what lambda adds to the stiffness
    geometric = system.tangents(node, q, v, lam).stiffness - system.tangents(node, q, v, none).stiffness
    design = (
        system.design(node, q + e * move, v + e * quick * move)
        - system.design(node, q - e * move, v - e * quick * move)
    ) / (2.0 * e)
    out = np.zeros((len(step), system.members))
    out[:n] = by_q @ sq + by_v @ sv + design + geometric @ sq
    out[n:] = ((up.jacobian - down.jacobian) / (2.0 * e)) @ sq
    return out
