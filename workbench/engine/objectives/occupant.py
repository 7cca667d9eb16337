"""What an occupant's accelerations amount to behind filters, as objectives with exact slopes.

The slopes of a value by filtered samples go back through the transposed filter; what reaches a node is a
direction there, and one backward sweep takes all nodes.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..errors import NotSupported
from ..integration.grids import one_step_length
from .filters import SignalFilter, WholeBodyFilter
from .injury import ROUND, PointAcceleration
from .quantities import Slopes
from .reductions import NodeWeight, Window, nodes_within

__all__ = ["Filtered", "RideComfort"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """A series as a quantity without rates, for the value and the nodal slopes of another objective."""

    series: Array
    has_rates: bool = False

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,)."""
        return self.series

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """Raises NotSupported: samples behind a filter have no rates of their own."""
        raise NotSupported("filtered samples have no rates; peaks are refined through nodal values")

    def slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises NotSupported: a filtered sample depends on other nodes too."""
        raise NotSupported("filtered samples depend on many nodes; take the slopes of the objective")

    def rate_slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises NotSupported, as `rates`."""
        raise NotSupported("filtered samples have no rates; peaks are refined through nodal values")


@dataclass(frozen=True, slots=True, kw_only=True)
class AlongDirections:
    """The acceleration's components in the body's axes, added with weights of their own at every node."""

    acceleration: PointAcceleration
    directions: Array  # (steps + 1, 3)
    has_rates: bool = False

    def values(self, trajectory: Any) -> Array:
        """(steps + 1,)."""
        return np.asarray((self.acceleration.components(trajectory) * self.directions).sum(axis=1))

    def rates(self, trajectory: Any, nodes: Array) -> Array:
        """Raises NotSupported, as those of the acceleration."""
        return self.acceleration.rates(trajectory, nodes)

    def slopes(self, trajectory: Any, node: int) -> Slopes:
        """Partial derivatives at a node."""
        return self.acceleration.component_slopes(trajectory, node, self.directions[node])

    def rate_slopes(self, trajectory: Any, node: int) -> Slopes:
        """Raises NotSupported, as those of the acceleration."""
        return self.acceleration.rate_slopes(trajectory, node)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Filtered:
    """An objective of filtered samples: `HeadInjury`, `ClipLevel`, `Maximum`, `PNorm` or `Integral`.

    Of a `PointAcceleration` the components in the body's axes are filtered, as an accelerometer's channels
    are, and the resultant is taken behind the filter; of other quantities the series.
    """

    objective: Any
    filter: SignalFilter

    def _behind(self, trajectory: Any) -> tuple[Any, Array | None, Array]:
        """The objective of the filtered samples, the filtered components if any, and the samples."""
        h, quantity = one_step_length(trajectory.times, "a filter"), self.objective.quantity
        parts = None
        if isinstance(quantity, PointAcceleration):
            parts = self.filter.applied(quantity.components(trajectory), h)
            series = np.sqrt((parts**2).sum(axis=1) + ROUND**2)
        else:
            series = self.filter.applied(np.asarray(quantity.values(trajectory)), h)
        return replace(self.objective, quantity=Given(series=series)), parts, series

    def value(self, trajectory: Any) -> float:
        """The objective."""
        return float(self._behind(trajectory)[0].value(trajectory))

    @property
    def quantity(self) -> Any:
        """What is filtered; a resultant has other directions at every node, see `seen`."""
        return self.objective.quantity

    def seen(self, trajectory: Any) -> tuple[Any, tuple[NodeWeight, ...]]:
        """The quantity and the weights of all nodes that the value depends on, back through the filter."""
        behind, parts, series = self._behind(trajectory)
        h = one_step_length(trajectory.times, "a filter")
        weights = np.zeros(len(series))
        for part in behind.weights(trajectory):
            weights[part.node] += part.weight
        if parts is None:
            back = self.filter.transposed(weights, h)
            return self.quantity, tuple(NodeWeight(i, float(w)) for i, w in enumerate(back) if w)
        directions = self.filter.transposed((weights / series)[:, None] * parts, h)
        return _along(self.objective.quantity, directions)

    def weights(self, trajectory: Any) -> tuple[NodeWeight, ...]:
        """The weights of `seen`."""
        return self.seen(trajectory)[1]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RideComfort:
    """Root of the sum of squares of weighted accelerations, rms per axis of the body, ISO 2631-1:1997, 8.2.

        G = sqrt(kx^2 ax^2 + ky^2 ay^2 + kz^2 az^2),   a^2 the mean of the squared weighted samples

    factors: (1, 1, 1) for a seat's comfort, (1.4, 1.4, 1) for health (which takes the worst axis alone).
    window: the part of the run that counts; the filters start at its beginning at rest. Records of a few
    seconds say nothing about health.
    """

    acceleration: PointAcceleration
    factors: tuple[float, float, float] = (1.0, 1.0, 1.0)
    filters: tuple[SignalFilter, SignalFilter, SignalFilter] = (
        WholeBodyFilter(weighting="Wd"), WholeBodyFilter(weighting="Wd"), WholeBodyFilter(weighting="Wk"),
    )  # fmt: skip
    window: Window | None = None

    def _weighted(self, trajectory: Any) -> tuple[Array, slice, float]:
        """(nodes, 3) weighted components times their factors, the nodes, and the step."""
        first, last = nodes_within(trajectory, self.window)
        h, part = one_step_length(trajectory.times, "a filter"), slice(first, last + 1)
        a = self.acceleration.components(trajectory)[part].copy()
        for i, (k, f) in enumerate(zip(self.factors, self.filters, strict=True)):
            a[:, i] = k * f.applied(a[:, i], h)
        return a, part, h

    def value(self, trajectory: Any) -> float:
        """The total, m/s^2."""
        weighted, _, _ = self._weighted(trajectory)
        return float(np.sqrt((weighted**2).sum() / len(weighted)))

    @property
    def quantity(self) -> Any:
        """What is weighted; see `seen`."""
        return self.acceleration

    def seen(self, trajectory: Any) -> tuple[Any, tuple[NodeWeight, ...]]:
        """The quantity and the weights of all nodes that the value depends on."""
        weighted, part, h = self._weighted(trajectory)
        total = np.sqrt((weighted**2).sum() / len(weighted))
        by = weighted / (len(weighted) * max(total, ROUND))
        directions = np.zeros((len(trajectory.times), 3))
        for i, (k, f) in enumerate(zip(self.factors, self.filters, strict=True)):
            directions[part, i] = k * f.transposed(by[:, i], h)
        return _along(self.acceleration, directions)

    def weights(self, trajectory: Any) -> tuple[NodeWeight, ...]:
        """The weights of `seen`."""
        return self.seen(trajectory)[1]


def _along(acceleration: PointAcceleration, directions: Array) -> tuple[Any, tuple[NodeWeight, ...]]:
    nodes = np.flatnonzero(directions.any(axis=1))
    return AlongDirections(acceleration=acceleration, directions=directions), tuple(
        NodeWeight(int(node), 1.0) for node in nodes
    )
