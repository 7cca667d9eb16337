"""gradient: dG/dalpha of an objective along a trajectory, by the method of your choice."""

from typing import Any

import numpy as np

from ..multibody.objectives import Objective
from ..multibody.system import System
from ..multibody.trajectory import Trajectory
from .discrete_adjoint import ByParameter, discrete_adjoint, parameter_gradient

__all__ = ["ByParameter", "gradient", "parameter_gradient"]

Array = np.ndarray[Any, Any]


def gradient(
    system: System,
    density: Array,
    trajectory: Trajectory,
    objective: Objective,
    method: str = "discrete_adjoint",
) -> Array:
    """(N,) dG/dalpha.

    method: "discrete_adjoint" (default: exact for the computed objective, cost independent of N).
    Raises ValueError when the trajectory is not of this system and density, or the method is unknown.
    """
    if trajectory.system is not system:
        raise ValueError("trajectory belongs to another system; simulate this one first")
    if not np.array_equal(np.asarray(density, float), trajectory.density):
        raise ValueError("trajectory was computed with other densities; simulate again with these")
    if method == "discrete_adjoint":
        return discrete_adjoint(trajectory, objective)
    raise ValueError(f"method needs to be one of discrete_adjoint, got '{method}'")
