"""From an objective to the seeds of a sensitivity: dG/d(state) at every node, and the explicit dG/dalpha."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..multibody.objectives import Objective
from ..multibody.quantities import Slopes
from ..multibody.trajectory import Trajectory

__all__ = ["Seeds", "seeds"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Seeds:
    """dG/d(node state) as arrays over all nodes; `last` is the latest node with a seed."""

    position: Array  # (steps + 1, n)
    velocity: Array
    acceleration: Array
    multiplier: Array  # (steps + 1, m)
    damage: Array  # (steps + 1, bushings)
    density: Array  # (N,) explicit part of the gradient
    last: int


def seeds(trajectory: Trajectory, objective: Objective) -> Seeds:
    """Differentiate the objective with respect to every nodal state."""
    out = Seeds(
        position=np.zeros_like(trajectory.position),
        velocity=np.zeros_like(trajectory.position),
        acceleration=np.zeros_like(trajectory.position),
        multiplier=np.zeros_like(trajectory.multiplier),
        damage=np.zeros_like(trajectory.damage),
        density=np.zeros(len(trajectory.density)),
        last=0,
    )
    last = 0
    for part in objective.weights(trajectory):
        last = max(last, part.node)
        if part.weight:
            _add(out, part.node, part.weight, objective.quantity.slopes(trajectory, part.node))
        if part.rate_weight:
            _add(out, part.node, part.rate_weight, objective.quantity.rate_slopes(trajectory, part.node))
    object.__setattr__(out, "last", last)
    return out


def _add(out: Seeds, node: int, weight: float, slopes: Slopes) -> None:
    for name in ("position", "velocity", "acceleration", "multiplier", "damage"):
        part = getattr(slopes, name)
        if part is not None:
            getattr(out, name)[node] += weight * part
    if slopes.density is not None:
        out.density[:] += weight * slopes.density
