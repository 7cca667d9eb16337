"""Seeds of a sensitivity: dG/d(state) at the nodes, as a trajectory's adjoint takes them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

__all__ = ["PARTS", "NodeSeeds", "Seeds", "row_by_row"]

Array = np.ndarray[Any, Any]

PARTS = ("position", "velocity", "acceleration", "multiplier", "states")  # of the state of a system


@dataclass(frozen=True, slots=True, kw_only=True)
class Seeds:
    """dG/d(node state) of one objective as arrays over all nodes; `last` is the latest node with a seed."""

    position: Array  # (steps + 1, n)
    velocity: Array
    acceleration: Array
    multiplier: Array  # (steps + 1, m)
    states: Array  # (steps + 1, first-order states)
    density: Array  # (N,) explicit part of the gradient
    last: int


@dataclass(frozen=True, slots=True, kw_only=True)
class NodeSeeds:
    """Seeds of R objectives: E entries, latest node first; objectives in the order of their latest nodes."""

    nodes: int  # of the run, steps + 1
    order: Array  # (R,) objective of each row
    starts: Array  # (R,) latest node of each row, descending
    at: Array  # (E, 2) node and row of each entry
    position: Array  # (E, n)
    velocity: Array
    acceleration: Array
    multiplier: Array  # (E, m)
    states: Array  # (E, first-order states)
    density: Array  # (R, N) explicit part of the gradients

    def dense(self, row: int) -> Seeds:
        """The seeds of one row as arrays over all nodes."""
        own = self.at[:, 1] == row
        found = {}
        for name in PARTS:
            entries = getattr(self, name)[own]
            table = np.zeros((self.nodes, entries.shape[1]))
            np.add.at(table, self.at[own, 0], entries)
            found[name] = table
        return Seeds(density=self.density[row], last=int(self.starts[row]), **found)

    def of_objectives(self, first: int, last: int) -> tuple[Array, "NodeSeeds"]:
        """The rows of the objectives first..last-1, and their seeds."""
        if first <= 0 and last >= len(self.order):
            return np.arange(len(self.order)), self
        rows = np.flatnonzero((self.order >= first) & (self.order < last))
        place = np.full(len(self.order), -1)
        place[rows] = np.arange(len(rows))
        own = place[self.at[:, 1]] >= 0
        at = np.column_stack([self.at[own, 0], place[self.at[own, 1]]])
        part = replace(
            self, order=self.order[rows], starts=self.starts[rows], at=at, density=self.density[rows],
            **{name: getattr(self, name)[own] for name in PARTS},
        )  # fmt: skip
        return rows, part


def row_by_row(trajectory: Any, seeds: NodeSeeds, one: Callable[[Any, Seeds], Array]) -> Array:
    """(R, N) gradients by density of a loop that takes one row at a time and answers by scale."""
    out = np.empty((len(seeds.starts), len(trajectory.density)))
    for row in range(len(out)):
        out[row] = trajectory.by_density(one(trajectory, seeds.dense(row)))
    return out
