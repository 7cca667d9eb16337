"""Slopes of computed objectives by any parameter of a system, told by the systems that it makes."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ..integration.kinds import AnySystem, AnyTrajectory, Change
from ..objectives.reductions import Objective
from .seeds import node_seeds

__all__ = ["parameter_jacobian", "parameter_slopes"]

Array = np.ndarray[Any, Any]
Parameters = Mapping[str, tuple[float, Callable[[float], Any]]]  # the value that ran, the system at a value


def parameter_slopes(
    trajectory: AnyTrajectory,
    objective: Objective,
    parameters: Parameters,
) -> dict[str, float]:
    """Slopes of an objective by parameters of whatever kind: points, frames, laws, loads, joints, the start.

    For trees, natural coordinates and planar systems, under every scheme.

        dG/dp = dG/dp at the computed states + dG/d(start) . d(start)/dp + sum over steps of mu^T dr/dp

    One backward sweep gives mu, with the adjoints of the joints, for all parameters. dr/dp is found for each
    parameter: of trees by a complex step through the equations, of other systems by differences of them. How
    the numbers of the system follow p (lengths and rests taken from the start among them) is found by central
    differences of fourth order of the system's tables, at steps of 1e-3 of its value (1e-3 where it is 0): no
    run is made.

    Args:    parameters: name -> (the value that ran, the system at a value), in the units of the parameter
    Returns: name -> slope, the unit of the objective by that of the parameter
    Raises ValueError where a parameter's systems are of another kind or structure than the one that ran, and
    AssemblyError where their start does not close the joints.
    """
    found = parameter_jacobian(trajectory, (objective,), parameters)
    return {name: float(slopes[0]) for name, slopes in found.items()}


def parameter_jacobian(
    trajectory: AnyTrajectory, objectives: Sequence[Objective], parameters: Parameters
) -> dict[str, Array]:
    """Slopes of several objectives of one run by any parameters: `parameter_slopes` of each at once.

    In trees the objectives share the backward sweep and what a parameter changes in the tables, which is most
    of the work: one parameter costs about as much for twenty objectives as for one.

    Args:    parameters: name -> (the value that ran, the system at a value), in the units of the parameter
    Returns: name -> (R,) slopes in the order of the objectives, each in its unit by that of the parameter
    Raises as `parameter_slopes`.
    """
    changes = [Change(system=system, value=float(value)) for value, system in parameters.values()]
    for name, change in zip(parameters, changes, strict=True):
        _same(name, change.system(change.value), trajectory)
    if not objectives:
        return {name: np.zeros(0) for name in parameters}
    seeds = node_seeds(trajectory, objectives)
    found = trajectory.change_adjoint([one.value for one in objectives], seeds, changes)
    return dict(zip(parameters, found.T, strict=True))


def _same(name: str, system: AnySystem, trajectory: AnyTrajectory) -> None:
    if type(system) is not type(trajectory.system):
        raise ValueError(
            f"parameter '{name}' needs a function that gives a {type(trajectory.system).__name__}, got "
            f"{type(system).__name__}"
        )
