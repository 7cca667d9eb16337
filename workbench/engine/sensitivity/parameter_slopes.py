"""Slopes of a computed objective by any parameter of a system, told by the systems that it makes."""

from collections.abc import Callable, Mapping
from typing import Any

from ..integration.kinds import AnySystem, AnyTrajectory, Change
from ..objectives.reductions import Objective
from .seeds import node_seeds

__all__ = ["parameter_slopes"]


def parameter_slopes(
    trajectory: AnyTrajectory,
    objective: Objective,
    parameters: Mapping[str, tuple[float, Callable[[float], Any]]],
) -> dict[str, float]:
    """Slopes of an objective by parameters of whatever kind: points, frames, laws, loads, joints, the start.

    For trees, natural coordinates, and planar systems without damage, under every scheme.

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
    changes = [Change(system=system, value=float(value)) for value, system in parameters.values()]
    for name, change in zip(parameters, changes, strict=True):
        _same(name, change.system(change.value), trajectory)
    seeds = node_seeds(trajectory, (objective,))
    found = trajectory.change_adjoint(objective.value, seeds, changes)
    return dict(zip(parameters, (float(x) for x in found), strict=True))


def _same(name: str, system: AnySystem, trajectory: AnyTrajectory) -> None:
    if type(system) is not type(trajectory.system):
        raise ValueError(
            f"parameter '{name}' needs a function that gives a {type(trajectory.system).__name__}, got "
            f"{type(system).__name__}"
        )
