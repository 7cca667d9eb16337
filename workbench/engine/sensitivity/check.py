"""A gradient check for five runs: along one random direction, against central differences."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..integration.kinds import AnySystem
from ..integration.schemes import Scheme
from ..objectives.reductions import Objective
from ..simulation.simulate import simulate
from .gradient import gradient

__all__ = ["GradientCheck", "gradient_check"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class GradientCheck:
    """The two directional derivatives and their relative difference."""

    analytic: float
    differences: float
    relative_error: float
    step: float

    def __str__(self) -> str:
        return (
            f"gradient check: {self.analytic:.8g} analytic, {self.differences:.8g} by differences of step "
            f"{self.step:.1g}, relative difference {self.relative_error:.1e}"
        )


def gradient_check(
    system: AnySystem,
    density: Array,
    objective: Objective,
    *,
    t_end: float,
    steps: int,
    rng: np.random.Generator,
    scheme: Scheme | None = None,
    method: str = "discrete_adjoint",
    step: float = 1e-4,
) -> GradientCheck:
    """Compare dG/dalpha . d with fourth-order central differences of G along a random unit direction d.

    The direction points inside: at alpha = 0 it has no component that would make a density negative.
    """
    density = np.asarray(density, float)
    direction = rng.normal(size=len(density))
    direction[density < 2.5 * step * np.abs(direction)] = 0.0
    direction /= max(float(np.linalg.norm(direction)), 1e-300)
    run = simulate(system, density, t_end, steps, scheme=scheme)
    analytic = float(gradient(system, density, run, objective, method=method) @ direction)
    g = {
        k: objective.value(simulate(system, density + k * step * direction, t_end, steps, scheme=scheme))
        for k in (-2, -1, 1, 2)
    }
    found = (8.0 * (g[1] - g[-1]) - (g[2] - g[-2])) / (12.0 * step)
    scale = max(abs(analytic), abs(found))
    error = abs(analytic - found) / scale if scale > 0.0 else 0.0
    return GradientCheck(analytic=analytic, differences=found, relative_error=error, step=step)
