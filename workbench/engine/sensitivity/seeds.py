"""From objectives to the seeds of a sensitivity: dG/d(state) at the nodes, and the explicit dG/dalpha."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..objectives.quantities import Slopes
from ..objectives.reductions import Objective
from ..planar.trajectory import Trajectory

__all__ = ["NodeSeeds", "Seeds", "node_seeds", "seeds"]

Array = np.ndarray[Any, Any]

STATES = ("position", "velocity", "acceleration", "multiplier", "damage")


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSeeds:
    """Seeds of R objectives: E entries, latest node first; objectives in the order of their latest nodes."""

    order: Array  # (R,) objective of each row
    starts: Array  # (R,) latest node of each row, descending
    at: Array  # (E, 2) node and row of each entry
    position: Array  # (E, n)
    velocity: Array
    acceleration: Array
    multiplier: Array  # (E, m)
    damage: Array  # (E, bushings)
    density: Array  # (R, N) explicit part of the gradients


@dataclass(frozen=True, slots=True, kw_only=True)
class Seeds:
    """dG/d(node state) of one objective as arrays over all nodes; `last` is the latest node with a seed."""

    position: Array  # (steps + 1, n)
    velocity: Array
    acceleration: Array
    multiplier: Array  # (steps + 1, m)
    damage: Array  # (steps + 1, bushings)
    density: Array  # (N,) explicit part of the gradient
    last: int


def node_seeds(trajectory: Trajectory, objectives: Sequence[Objective]) -> NodeSeeds:
    """Differentiate objectives of one run with respect to the nodal states they depend on."""
    parts = [sorted(objective.weights(trajectory), reverse=True) for objective in objectives]
    starts = np.array([entries[0].node if entries else 0 for entries in parts], np.int64)
    order = np.argsort(-starts, kind="stable")
    entries = sorted(
        ((part.node, row, part) for row, index in enumerate(order) for part in parts[index]), reverse=True
    )
    at = np.array([(node, row) for node, row, _ in entries], np.int64).reshape(-1, 2)
    found = {name: np.zeros((len(entries), getattr(trajectory, name).shape[1])) for name in STATES}
    density = np.zeros((len(objectives), len(trajectory.density)))
    for entry, (node, row, part) in enumerate(entries):
        quantity = objectives[order[row]].quantity
        if part.weight:
            _add(found, density[row], entry, part.weight, quantity.slopes(trajectory, node))
        if part.rate_weight:
            _add(found, density[row], entry, part.rate_weight, quantity.rate_slopes(trajectory, node))
    return NodeSeeds(order=order, starts=starts[order], at=at, density=density, **found)


def seeds(trajectory: Trajectory, objective: Objective) -> Seeds:
    """Differentiate one objective with respect to every nodal state."""
    sparse = node_seeds(trajectory, (objective,))
    dense = {name: np.zeros_like(getattr(trajectory, name)) for name in STATES}
    for name, table in dense.items():
        np.add.at(table, sparse.at[:, 0], getattr(sparse, name))
    return Seeds(density=sparse.density[0], last=int(sparse.starts[0]), **dense)


def _add(found: dict[str, Array], density: Array, entry: int, weight: float, slopes: Slopes) -> None:
    for name in STATES:
        part = getattr(slopes, name)
        if part is not None:
            found[name][entry] += weight * part
    if slopes.density is not None:
        density += weight * slopes.density
