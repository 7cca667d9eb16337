"""When something happens along a run: the time at which a quantity reaches a level, with exact slopes."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..integration.kinds import AnyTrajectory
from .quantities import Quantity, Slopes
from .reductions import NodeWeight, Window, nodes_within

__all__ = ["FirstCrossing", "State"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class State:
    """A first-order state of a system by its name, such as the damage of a bushing or the slip of a tyre.

    >>> State(name="damage of bushing 'seat'").has_rates
    False
    """

    name: str
    has_rates: bool = False

    def _column(self, trajectory: Any) -> int:
        names = list(trajectory.state_names)
        if self.name not in names:
            raise ValueError(f"system has no state '{self.name}'; it has {', '.join(names) or 'none'}")
        return names.index(self.name)

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,) the state at every node."""
        return np.asarray(trajectory.states[:, self._column(trajectory)])

    def slopes(self, trajectory: Any, node: int) -> Slopes:
        """One, by itself."""
        by = np.zeros(trajectory.states.shape[1])
        by[self._column(trajectory)] = 1.0
        return Slopes(states=by)

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """(len(nodes),) its rate."""
        return np.asarray(trajectory.state_rates[nodes, self._column(trajectory)])

    def rate_slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises ValueError: a rate is not a function of the states alone."""
        raise ValueError(f"state '{self.name}' has no slopes of its rate; its peaks use nodal values")


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstCrossing:
    """G = the first time at which a quantity rises through a level, linear between nodes, s.

    Where it never does, G is the end of the run (or window) and its slopes are 0; where it starts above the
    level, the beginning. The slopes are those of the computed value; they jump where another crossing
    becomes the first.
    """

    quantity: Quantity
    level: float = 0.0
    window: Window | None = None

    def _interval(self, trajectory: AnyTrajectory) -> tuple[int, int, Array]:
        """Node before the crossing (-1: none), last node, values."""
        first, last = nodes_within(trajectory, self.window)
        g = np.asarray(self.quantity.values(trajectory)) - self.level
        up = np.flatnonzero((g[first:last] < 0.0) & (g[first + 1 : last + 1] >= 0.0))
        if g[first] >= 0.0:
            return -1, first, g
        return (first + int(up[0]) if len(up) else -1), last, g

    def value(self, trajectory: AnyTrajectory) -> float:
        """The time."""
        node, end, g = self._interval(trajectory)
        if node < 0:
            return float(trajectory.times[end])
        step = float(trajectory.times[node + 1] - trajectory.times[node])
        return float(trajectory.times[node] - step * g[node] / (g[node + 1] - g[node]))

    def happens(self, trajectory: AnyTrajectory) -> bool:
        """Whether the level is reached."""
        node, end, g = self._interval(trajectory)
        return node >= 0 or bool(g[end] >= 0.0)

    def weights(self, trajectory: AnyTrajectory) -> tuple[NodeWeight, ...]:
        """dG/dg at the two nodes around the crossing."""
        node, end, g = self._interval(trajectory)
        if node < 0:
            return (NodeWeight(end, 0.0),)
        step, rise = float(trajectory.times[node + 1] - trajectory.times[node]), g[node + 1] - g[node]
        return (
            NodeWeight(node, float(-step * g[node + 1] / rise**2)),
            NodeWeight(node + 1, float(step * g[node] / rise**2)),
        )
