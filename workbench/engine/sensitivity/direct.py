"""Direct differentiation (DDM, section 2.5) of generalised-alpha: d(state)/dalpha for every member.

Differentiates the discrete step itself, so it equals the discrete adjoint to rounding; it costs n x N
products per step but has the gradient of every quantity at every time at the end.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.kinds import AnyTrajectory, Linearised
from ..integration.schemes import GeneralisedAlpha, VelocityVerlet
from ..integration.seeds import Seeds
from ..objectives.reductions import Objective
from .seeds import seeds

__all__ = ["StateSlopes", "direct", "state_slopes"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class StateSlopes:
    """d(state)/dalpha at a node: (n, N) each, multiplier (m, N)."""

    node: int
    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array

    def project(self, start: Seeds) -> Array:
        """(N,) the node's share of the gradient."""
        return np.asarray(
            start.position[self.node] @ self.position
            + start.velocity[self.node] @ self.velocity
            + start.acceleration[self.node] @ self.acceleration
            + start.multiplier[self.node] @ self.multiplier
        )


def start_slopes(system: Linearised, trajectory: AnyTrajectory) -> StateSlopes:
    """Node 0: positions and velocities are given, accelerations and multipliers follow from the equations."""
    r, n = trajectory, system.size
    at = system.tangents(0, r.position[0], r.velocity[0], r.multiplier[0])
    right = np.zeros((n + system.rows, system.members))
    right[:n] = -system.design(0, r.position[0], r.velocity[0])
    found = np.linalg.solve(system.saddle(np.diag(system.mass), at.jacobian), right)
    zero = np.zeros((n, system.members))
    return StateSlopes(node=0, position=zero, velocity=zero, acceleration=found[:n], multiplier=found[n:])


def state_slopes(trajectory: AnyTrajectory, last: int | None = None) -> Iterator[StateSlopes]:
    """d(state)/dalpha node by node, of the scheme as computed."""
    scheme = trajectory.scheme
    if not isinstance(scheme, GeneralisedAlpha | VelocityVerlet):
        raise NotSupported(f"direct differentiation knows the alpha family, not {type(scheme).__name__}")
    system = trajectory.linearised(method="direct differentiation")
    r, n, h = trajectory, system.size, trajectory.step
    am, af, gamma, beta = scheme.numbers
    c = (1.0 - af) / (1.0 - am)
    state = start_slopes(system, trajectory)
    yield state
    alike = state.acceleration
    for node in range(1, (len(r.times) - 1 if last is None else last) + 1):
        known = (af * state.acceleration - am * alike) / (1.0 - am)
        sq = state.position + h * state.velocity + h * h * ((0.5 - beta) * alike + beta * known)
        sv = state.velocity + h * ((1.0 - gamma) * alike + gamma * known)
        at = system.tangents(node, r.position[node], r.velocity[node], r.multiplier[node])
        block = np.diag(system.mass) + h * gamma * c * at.damping + h * h * beta * c * at.stiffness
        right = np.zeros((n + system.rows, system.members))
        right[:n] = -(
            system.design(node, r.position[node], r.velocity[node]) + at.stiffness @ sq + at.damping @ sv
        )
        if system.rows:
            right[n:] = -(at.jacobian @ sq) / (h * h * beta * c)
        found = np.linalg.solve(system.saddle(block, at.jacobian), right)
        alike = known + c * found[:n]
        state = StateSlopes(
            node=node, position=sq + h * h * beta * c * found[:n], velocity=sv + h * gamma * c * found[:n],
            acceleration=found[:n], multiplier=found[n:],
        )  # fmt: skip
        yield state


def direct(trajectory: AnyTrajectory, objective: Objective) -> Array:
    """(N,) dG/dalpha by forward sensitivities."""
    start = seeds(trajectory, objective)
    gradient = start.density.copy()
    for state in state_slopes(trajectory, start.last):
        gradient += state.project(start)
    return gradient
