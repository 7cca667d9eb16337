"""Gradients of runs in independent coordinates (planar with joints, spatial in natural coordinates), by
their own
discrete adjoints: exact for the computed objective."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..natural.compiled import natural_compiled
from ..natural.runs import NaturalTrajectory, natural_gradient
from ..objectives.quantities import in_member_order
from ..objectives.reductions import Objective
from ..planar.independent import planar_gradient
from ..planar.trajectory import Trajectory
from .seeds import seeds

__all__ = ["independent_gradients"]

Array = np.ndarray[Any, Any]


def independent_gradients(
    trajectory: Trajectory | NaturalTrajectory, objectives: Sequence[Objective]
) -> Array:
    """(R, N) dG/dalpha of several objectives, each by a backward sweep of its own."""
    r: Any = trajectory
    rows = []
    for objective in objectives:
        start = seeds(r, objective)
        if isinstance(trajectory, NaturalTrajectory):
            rows.append(_members(trajectory, natural_gradient(trajectory, start)) + start.density)
        else:
            rows.append(in_member_order(trajectory, planar_gradient(trajectory, start)) + start.density)
    return np.array(rows).reshape(len(objectives), len(r.density))


def _members(trajectory: NaturalTrajectory, by_scale: Array) -> Array:
    """From slopes by scale in segment order to slopes by density in member order."""
    parts = natural_compiled(trajectory.system)
    out = np.zeros_like(by_scale)
    out[parts.order] = by_scale
    power, alpha = parts.power, trajectory.density
    return np.asarray(out * np.where(power == 1.0, 1.0, power * alpha ** (power - 1.0)))
