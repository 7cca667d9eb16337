"""Steps of generalised-alpha that do not converge, made in parts: halves, halves of these, and so on.

    t - h -> t    becomes    t - h -> t - h/2 -> t

A run shows the nodes that were asked for; its gradients go back over all that were taken, so they are those
of what was computed. The scheme says how often a step may be halved.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...integration.grids import changes_of
from ...integration.schemes import GeneralisedAlpha
from .._kernels.alpha import march
from .._kernels.factors import Pattern
from .._kernels.tables import TreeRun, TreeTables, TreeWork

__all__ = ["TakenSteps", "closing_of", "marched"]

Array = np.ndarray[Any, Any]
OnGrid = Callable[[Array], TreeTables]

SAMPLED = ("times", "load_sample", "friction_sample", "motion")  # rows of the tables, one for each node
OF_NODES = ("position", "velocity", "rate", "move")
TANGENTS = ("stiffness", "damping", "factors")
NAMED = 5  # times that a sentence lists


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TakenSteps:
    """All steps that were taken.

    tables, nodes: at all nodes.  grid: (2, nodes) as from `step_changes`.  at: which of the nodes were asked
    for, growing.
    """

    tables: TreeTables
    nodes: TreeRun
    grid: Array
    at: Array

    @property
    def whole(self) -> bool:
        """Whether no step was halved."""
        return len(self.at) == len(self.nodes.position)

    @property
    def halved(self) -> tuple[float, ...]:
        """Where the steps end that were made in parts, s."""
        inside = np.flatnonzero(np.diff(self.at) > 1)
        return tuple(self.tables.times[self.at[inside + 1]].tolist())

    def sentence(self) -> str:
        """How many were halved, and where."""
        found = [f"{t:.6g}" for t in self.halved]
        listed = ", ".join(found[:NAMED]) + (" and later" if len(found) > NAMED else "")
        return (
            f"{len(found)} of {len(self.at) - 1} steps did not converge and were made in parts, the shortest "
            f"of {self.grid[0].min():.3g} s: those to t = {listed} s"
        )

    def from_node(self, first: int) -> "TakenSteps":
        """The steps behind a node that was asked for, without the others."""
        if first == 0:
            return self
        sampled = (*SAMPLED, "closing")
        tables = self.tables._replace(**{name: getattr(self.tables, name)[first:] for name in sampled})
        names = (*OF_NODES, *(TANGENTS if len(self.nodes.stiffness) > 1 else ()))
        nodes = self.nodes._replace(**{name: getattr(self.nodes, name)[first:] for name in names})
        return TakenSteps(
            tables=tables, nodes=nodes, grid=self.grid[:, first:], at=self.at[first:] - first
        )  # fmt: skip

    def asked(self) -> TreeRun:
        """The nodes that were asked for."""
        if self.whole:
            return self.nodes
        n = len(self.nodes.right)
        none = {name: np.empty((1, n, n)) for name in TANGENTS}
        return self.nodes._replace(**{name: getattr(self.nodes, name)[self.at] for name in OF_NODES}, **none)


def closing_of(scheme: GeneralisedAlpha, lengths: Array) -> Array:
    """(nodes,) 1/(h^2 beta c): with it the rows of conditions have the slopes of their forces; accelerations
    first."""
    am, af, _, beta = scheme.numbers
    out: Array = (1.0 - am) / (lengths * lengths * beta * (1.0 - af))
    out[0] = 0.0
    return out


def marched(
    on_grid: OnGrid,
    pattern: Pattern,
    scheme: GeneralisedAlpha,
    steps: TakenSteps,
    work: TreeWork,
    known: int,
) -> tuple[TakenSteps, int]:
    """Solve for all nodes behind the first `known`, as `march`; a step that fails is halved and tried again.

    on_grid: the tables of the run at some times.
    Returns the steps taken, and what `march` says of the last attempt: 0, or the node that failed.
    """
    depth = np.zeros(len(steps.at), int)
    while True:
        failed = march(
            steps.tables, work, pattern, steps.nodes, scheme.numbers, steps.grid, scheme.tolerance,
            scheme.iterations, known,
        )  # fmt: skip
        node = abs(failed)
        if failed == 0 or node == len(depth) or depth[node] >= scheme.halvings:
            return steps, failed
        depth = np.insert(depth, node, depth[node] + 1)
        depth[node + 1] += 1
        steps, known = _halved(on_grid, scheme, steps, node), node


def _halved(on_grid: OnGrid, scheme: GeneralisedAlpha, steps: TakenSteps, node: int) -> TakenSteps:
    """The step that leads to a node in two halves, neither of them made yet."""
    tables, nodes = steps.tables, steps.nodes
    middle = 0.5 * (tables.times[node - 1] + tables.times[node])
    now = on_grid(np.array([middle]))
    lengths = np.insert(steps.grid[0], node, 0.5 * steps.grid[0, node])
    lengths[node + 1] = lengths[node]
    names = (*OF_NODES, *(TANGENTS if len(nodes.stiffness) > 1 else ()))
    return TakenSteps(
        tables=tables._replace(
            closing=closing_of(scheme, lengths),
            **{name: np.insert(getattr(tables, name), node, getattr(now, name)[0], 0) for name in SAMPLED},
        ),
        nodes=nodes._replace(**{name: np.insert(getattr(nodes, name), node, 0.0, 0) for name in names}),
        grid=changes_of(lengths, joints=len(tables.cut) > 0),
        at=steps.at + (steps.at >= node),
    )  # fmt: skip
