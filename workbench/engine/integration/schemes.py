"""Integration schemes: which formula advances the state, and how tightly its equations are solved."""

from dataclasses import dataclass
from typing import Any

import numpy as np

__all__ = ["BDF2", "GeneralisedAlpha", "IndependentAlpha", "RungeKutta8", "Scheme", "VelocityVerlet"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class GeneralisedAlpha:
    """Generalised-alpha for the index-3 DAE, (2.29) to (2.34): second order, damping above 1/h set by rho.

        alpha_m = (2 rho - 1)/(rho + 1),  alpha_f = rho/(rho + 1)
        gamma = 1/2 - alpha_m + alpha_f,  beta = (1/2 + gamma)^2/4

    rho: spectral radius at infinity, 0 (strongest damping) to 1 (none). With joints and rho above 0.99 the
    run is taken over by `IndependentAlpha`: at rho = 1 accelerations and joint forces of the index-3 form
    have the eigenvalue -1 twice, and their alternation grows in long runs.
    tolerance: relative error left in the accelerations of a step.
    iterations: the most Newton steps per step.
    halvings: how often a step that they do not settle is made in halves before the run stops; of trees. The
    run shows the nodes asked for all the same, and its diagnosis says which steps were halved.

    >>> GeneralisedAlpha(rho=1.0).numbers
    array([0.5 , 0.5 , 0.5 , 0.25])
    """

    rho: float = 0.8
    tolerance: float = 1e-12
    iterations: int = 25
    halvings: int = 6

    def __post_init__(self) -> None:
        if not 0.0 <= self.rho <= 1.0:
            raise ValueError(f"generalised-alpha needs 0 <= rho <= 1, got rho={self.rho}")
        if self.halvings < 0:
            raise ValueError(f"generalised-alpha needs halvings >= 0, got halvings={self.halvings}")

    @property
    def numbers(self) -> Array:
        """alpha_m, alpha_f, gamma, beta."""
        alpha_m = (2.0 * self.rho - 1.0) / (self.rho + 1.0)
        alpha_f = self.rho / (self.rho + 1.0)
        # (2.31) prints "- alpha_f"; Chung & Hulbert 1993 have "+": only so is the order 2 and rho = 1 gives
        # 1/2
        gamma = 0.5 - alpha_m + alpha_f
        return np.array([alpha_m, alpha_f, gamma, 0.25 * (0.5 + gamma) ** 2])


@dataclass(frozen=True, slots=True, kw_only=True)
class IndependentAlpha:
    """Generalised-alpha on the independent coordinates of a system with joints.

    The joints hold on positions, velocities and accelerations; Wehage and Haug 1982 (coordinate
    partitioning), Chung and Hulbert 1993.

    q1_I = q_I + h v_I + h^2 ((1/2 - beta) a_I + beta a1_I),   Phi(q1) = 0,  Phi' = 0,  Phi'' = 0

    Nothing alternates at rho = 1, and redundant rows are set aside. Independent coordinates are chosen at
    every step by pivoting, angles first. rho, tolerance, iterations: as in `GeneralisedAlpha`.

    >>> IndependentAlpha().numbers
    array([0.5 , 0.5 , 0.5 , 0.25])
    """

    rho: float = 1.0
    tolerance: float = 1e-12
    iterations: int = 25

    def __post_init__(self) -> None:
        if not 0.0 <= self.rho <= 1.0:
            raise ValueError(f"independent alpha needs 0 <= rho <= 1, got rho={self.rho}")

    @property
    def numbers(self) -> Array:
        """alpha_m, alpha_f, gamma, beta."""
        return GeneralisedAlpha(rho=self.rho).numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocityVerlet:
    """Velocity Verlet: beta = 0, gamma = 1/2 of that family; explicit where forces ignore the velocity.

    For systems without joints. The layout figures of the two-body study were taken with it.
    """

    tolerance: float = 1e-12
    iterations: int = 25

    @property
    def numbers(self) -> Array:
        """alpha_m, alpha_f, gamma, beta."""
        return np.array([0.0, 0.0, 0.5, 0.0])


@dataclass(frozen=True, slots=True, kw_only=True)
class BDF2:
    """Second-order backward differences, index-3 DAE; started by generalised-alpha, strongest damping."""

    tolerance: float = 1e-12
    iterations: int = 25


@dataclass(frozen=True, slots=True, kw_only=True)
class RungeKutta8:
    """Explicit Runge-Kutta of order 8 (Dormand and Prince) at a fixed step, for smooth systems.

    With joints it runs on the independent coordinates.
    """


Scheme = GeneralisedAlpha | IndependentAlpha | VelocityVerlet | BDF2 | RungeKutta8
