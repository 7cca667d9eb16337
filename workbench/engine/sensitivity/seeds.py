"""From objectives to the seeds of a sensitivity: dG/d(state) at the nodes, and the explicit dG/dalpha."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory
from ..integration.seeds import PARTS, NodeSeeds, Seeds
from ..objectives.quantities import Quantity, Slopes
from ..objectives.reductions import NodeWeight, Objective

__all__ = ["node_seeds", "seeds"]

Array = np.ndarray[Any, Any]


def node_seeds(trajectory: AnyTrajectory, objectives: Sequence[Objective]) -> NodeSeeds:
    """Differentiate objectives of one run with respect to the nodal states they depend on."""
    seen = [_seen(trajectory, objective) for objective in objectives]
    parts = [sorted(weights, reverse=True) for _, weights in seen]
    starts = np.array([entries[0].node if entries else 0 for entries in parts], np.int64)
    order = np.array(sorted(range(len(starts)), key=(-starts).tolist().__getitem__), np.int64)
    entries = sorted(
        ((part.node, row, part) for row, index in enumerate(order) for part in parts[index]), reverse=True
    )
    at = np.array([(node, row) for node, row, _ in entries], np.int64).reshape(-1, 2)
    found = {
        name: np.zeros((len(entries), width)) for name, width in zip(PARTS, trajectory.widths, strict=True)
    }
    density = np.zeros((len(objectives), len(trajectory.density)))
    for entry, (node, row, part) in enumerate(entries):
        quantity = seen[order[row]][0]
        if part.weight:
            _add(found, density[row], entry, part.weight, quantity.slopes(trajectory, node))
        if part.rate_weight:
            _add(found, density[row], entry, part.rate_weight, quantity.rate_slopes(trajectory, node))
    return NodeSeeds(
        nodes=len(trajectory.times), order=order, starts=starts[order], at=at, density=density, **found
    )


def _seen(trajectory: AnyTrajectory, objective: Any) -> tuple[Quantity, tuple[NodeWeight, ...]]:
    """What an objective looks at along a run, and the weights of its nodes."""
    if hasattr(objective, "seen"):  # behind a filter: a direction at every node
        found: tuple[Quantity, tuple[NodeWeight, ...]] = objective.seen(trajectory)
        return found
    return objective.quantity, tuple(objective.weights(trajectory))


def seeds(trajectory: AnyTrajectory, objective: Objective) -> Seeds:
    """Differentiate one objective with respect to every nodal state."""
    return node_seeds(trajectory, (objective,)).dense(0)


def _add(found: dict[str, Array], density: Array, entry: int, weight: float, slopes: Slopes) -> None:
    for name in PARTS:
        part = getattr(slopes, name)
        if part is not None:
            found[name][entry] += weight * part
    if slopes.density is not None:
        density += weight * slopes.density
