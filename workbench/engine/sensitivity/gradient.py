"""gradient and gradients: the methods by name, and the checks of what they are given."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..integration.kinds import AnySystem, AnyTrajectory
from ..objectives.reductions import Objective
from .adjoint import adjoint
from .constant_load import constant_load
from .direct import direct
from .discrete_adjoint import discrete_adjoint, discrete_adjoints
from .iterative import iterative
from .time_integration import time_integration

__all__ = ["METHODS", "gradient", "gradients"]

Array = np.ndarray[Any, Any]

METHODS: dict[str, Callable[[AnyTrajectory, Objective], Array]] = {
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
    system: AnySystem,
    density: Array,
    trajectory: AnyTrajectory,
    objective: Objective,
    method: str = "discrete_adjoint",
) -> Array:
    """(N,) dG/dalpha of an objective along a trajectory.

    Args:    density: (N,) the one the trajectory was computed with    method: a key of `METHODS`
    Raises ValueError when the trajectory is not of this system and density or the method is unknown,
    NotSupported when the method cannot treat the system.

    >>> from workbench.engine import Body, Coordinate, Member, Spring, System, Terminal, gradient, simulate
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1, 0), law=Spring(k=10.0))
    >>> system = System(bodies=(mass,), members=(spring,))
    >>> run = simulate(system, [1.0], t_end=1.0, steps=500)
    >>> objective = Terminal(quantity=Coordinate(bodies=("mass",), direction=(1.0, 0.0)))
    >>> gradient(system, [1.0], run, objective).round(3)  # k v0/(2 k) (t cos wt - sin(wt)/w), w = sqrt(k/m)
    array([-0.248])
    """
    _check_run(system, density, trajectory)
    if method not in METHODS:
        raise ValueError(f"method needs to be one of {', '.join(METHODS)}, got '{method}'")
    return METHODS[method](trajectory, objective)


def gradients(
    system: AnySystem, density: Array, trajectory: AnyTrajectory, objectives: Sequence[Objective]
) -> Array:
    """(R, N) dG/dalpha of several objectives along one trajectory, in one backward sweep.

    The discrete adjoint of each, as `gradient` gives it, for little more than the price of one: the
    equations are linearised once for all. Peaks of one quantity are objectives: `Maximum(...).peaks(run)`.

    Raises ValueError when the trajectory is not of this system and density.

    >>> from workbench.engine import Body, Deviation, Maximum, Member, Spring, System, gradients, simulate
    >>> mass = Body(name="mass", mass=1.0, inertia=1.0, velocity=(0.5, 0.0, 0.0), gravity=False)
    >>> spring = Member(a="mass", b="ground", point_b=(-1, 0), law=Spring(k=40.0))
    >>> system = System(bodies=(mass,), members=(spring,))
    >>> run = simulate(system, [1.0], t_end=0.9, steps=500)
    >>> peaks = Maximum(quantity=Deviation(bodies=("mass",))).peaks(run)
    >>> [round(peak.height, 5) for peak in peaks]       # v0^2/w^2 at every half period
    [0.00625, 0.00625]
    >>> gradients(system, [1.0], run, peaks).round(5)   # -v0^2/(w^2 alpha)
    array([[-0.00625],
           [-0.00625]])
    """
    _check_run(system, density, trajectory)
    return discrete_adjoints(trajectory, tuple(objectives))


def _check_run(system: AnySystem, density: Array, trajectory: AnyTrajectory) -> None:
    if trajectory.system is not system:
        raise ValueError("trajectory belongs to another system; simulate this one first")
    if not np.array_equal(np.asarray(density, float), trajectory.density):
        raise ValueError("trajectory was computed with other densities; simulate again with these")
