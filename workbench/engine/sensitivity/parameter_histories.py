"""How a quantity's history follows a parameter, from the backward sweeps of its values at several times."""

from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory
from ..objectives.quantities import Quantity
from ..objectives.reductions import AtTime
from .parameter_slopes import Parameters, parameter_jacobian

__all__ = ["parameter_histories"]

Array = np.ndarray[Any, Any]
INSTANTS = 51


def parameter_histories(
    trajectory: AnyTrajectory, quantity: Quantity, parameters: Parameters, *, times: Any = None
) -> tuple[Array, dict[str, Array]]:
    """Slopes dg(t)/dp of a quantity g over time by a few parameters of whatever kind, exact for the run: what
    forward sensitivities give, for every kind of system and scheme that `parameter_jacobian` takes.

    times: (T,) s, within the run; None for 51 of its nodes, evenly. In trees all instants share one sweep; in
    other systems each has one of its own.

    Args:    parameters: name -> (the value that ran, the system at a value), as for `parameter_slopes`
    Returns: times (T,), and name -> (T,) slopes, the unit of the quantity by that of the parameter
    Raises as `parameter_slopes`, and ValueError for times outside the run.
    """
    if times is None:
        last = len(trajectory.times) - 1
        nodes = np.unique(np.linspace(0, last, min(INSTANTS, last + 1)).round().astype(int))
        times = trajectory.times[nodes]
    instants = np.array(times, float).ravel()
    objectives: list[Any] = [AtTime(quantity=quantity, time=float(t)) for t in instants]
    return instants, parameter_jacobian(trajectory, objectives, parameters)
