"""gradient: dG/dalpha of an objective along a trajectory, by the method of your choice.

discrete_adjoint          exact for the computed objective; the default; cost independent of the number of
members
direct                    the same numbers by forward sensitivities of the scheme (DDM)
adjoint                   continuous adjoint (AVM), second order, systems without joints
constant_load             chapter IV, an estimate whose direction may be wrong
time_integration          chapter V with dS/dalpha; time_integration_without_ds drops the term
iterative                 chapter VI with true BDF2; iterative_printed is (6.10), iterative_truncated
(6.45)
"""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from ..multibody.objectives import Objective
from ..multibody.system import System
from ..multibody.trajectory import Trajectory
from .adjoint import adjoint
from .check import GradientCheck, gradient_check
from .constant_load import constant_load
from .direct import direct
from .discrete_adjoint import ByParameter, discrete_adjoint, parameter_gradient
from .iterative import iterative
from .time_integration import time_integration

__all__ = ["METHODS", "ByParameter", "GradientCheck", "gradient", "gradient_check", "parameter_gradient"]

Array = np.ndarray[Any, Any]

METHODS: dict[str, Callable[[Trajectory, Objective], Array]] = {
    "discrete_adjoint": discrete_adjoint,
    "direct": direct,
    "adjoint": adjoint,
    "constant_load": constant_load,
    "time_integration": time_integration,
    "time_integration_without_ds": partial(time_integration, matrix_slope=False),
    "iterative": iterative,
    "iterative_printed": partial(iterative, form="printed"),
    "iterative_truncated": partial(iterative, form="truncated"),
}


def gradient(
    system: System,
    density: Array,
    trajectory: Trajectory,
    objective: Objective,
    method: str = "discrete_adjoint",
) -> Array:
    """(N,) dG/dalpha of an objective along a trajectory.

    Args:    density: (N,) the one the trajectory was computed with    method: a key of `METHODS`
    Raises ValueError when the trajectory is not of this system and density or the method is unknown,
    NotSupported
    when the method cannot treat the system.

    >>> from workbench.engine import Body, Coordinate, Member, Spring, System, Terminal, gradient, simulate
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1, 0), law=Spring(k=10.0))
    >>> system = System(bodies=(mass,), members=(spring,))
    >>> run = simulate(system, [1.0], t_end=1.0, steps=500)
    >>> objective = Terminal(quantity=Coordinate(bodies=("mass",), direction=(1.0, 0.0)))
    >>> gradient(system, [1.0], run, objective).round(3)  # k v0/(2 k) (t cos wt - sin(wt)/w), w = sqrt(k/m)
    array([-0.248])
    """
    if trajectory.system is not system:
        raise ValueError("trajectory belongs to another system; simulate this one first")
    if not np.array_equal(np.asarray(density, float), trajectory.density):
        raise ValueError("trajectory was computed with other densities; simulate again with these")
    if method not in METHODS:
        raise ValueError(f"method needs to be one of {', '.join(METHODS)}, got '{method}'")
    return METHODS[method](trajectory, objective)
