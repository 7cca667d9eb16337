"""The discrete adjoint: exact gradients of computed objectives, for any number of members.

The trajectory goes backwards by itself (`AnyTrajectory.adjoint`); here objectives become seeds, and the
explicit parts are added. It holds for the index-3 DAE too, where the source had no adjoint (its claim that an
adjoint is not available is refuted here).
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory
from ..objectives.reductions import Objective
from .seeds import node_seeds

__all__ = ["discrete_adjoint", "discrete_adjoints", "parameter_gradient"]

Array = np.ndarray[Any, Any]


def discrete_adjoint(trajectory: AnyTrajectory, objective: Objective) -> Array:
    """(N,) dG/dalpha of the computed objective, exact to rounding."""
    return np.asarray(discrete_adjoints(trajectory, (objective,))[0])


def discrete_adjoints(trajectory: AnyTrajectory, objectives: Sequence[Objective]) -> Array:
    """(R, N) gradients of several objectives of one run: one backward sweep carries them all where it can."""
    start = node_seeds(trajectory, objectives)
    out = np.empty((len(objectives), len(trajectory.density)))
    out[start.order] = trajectory.adjoint(start) + start.density
    return out


def parameter_gradient(trajectory: AnyTrajectory, objective: Objective) -> Any:
    """The same sweep, contracted with every parameter of members, springs, bushings and bodies.

    Returns the record of the kind of system, whatever its scheme: `planar.parameters.ByParameter`,
    `tree.gradients.TreeGradient`. The objective's explicit dependence on a parameter other than density
    (stored energy on k, say) is not included. Raises NotSupported for systems with a UserLaw and for natural
    coordinates, whose numbers `parameter_slopes` takes by name.
    """
    return trajectory.parameter_adjoint(node_seeds(trajectory, (objective,)))
