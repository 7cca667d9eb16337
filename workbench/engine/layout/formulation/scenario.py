"""One scenario of a moving system: its run at a density, values at the nodes, and their gradients.

Gradients come forward, by dq/dalpha at every node, or backward, by one adjoint sweep for all rows wanted.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...integration.kinds import AnySystem, AnyTrajectory, StateSensitivities
from ...integration.schemes import Scheme
from ...objectives.quantities import Deviation
from ...objectives.reductions import (
    Maximum,
    NodeWeight,
    Peak,
    find_peaks,
    nodes_within,
)
from ...sensitivity.discrete_adjoint import discrete_adjoints
from .law_variables import LawVariable, extended_gradients

__all__ = ["Scenario", "ScenarioRun"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]


@dataclass(frozen=True, slots=True, kw_only=True)
class Scenario:
    """One run: a system, the maximum of a quantity, time and scheme; its values are divided by `scale`.

    scheme None: generalised-alpha with rho 0.8.
    """

    system: AnySystem
    objective: Maximum
    t_end: float
    steps: int
    scheme: Scheme | None = None
    scale: float = 1.0
    name: str = ""


@dataclass(slots=True, kw_only=True)
class ScenarioRun:
    """One scenario at one density; sensitivities are computed when first asked for.

    forward: gradients by sweeps forward where many are wanted
    values: (nodes,) over the scale; nodes outside the window lie below all inside
    tops: refined peaks by their highest node.  first, last: nodes of the window.
    variables: of the laws; gradients then are (N + K,), by densities and by their shares.
    """

    scenario: Scenario
    trajectory: AnyTrajectory
    forward: bool
    variables: tuple[LawVariable, ...] = ()
    values: Array = field(init=False)
    tops: dict[int, Peak] = field(init=False)
    first: int = field(init=False)
    last: int = field(init=False)
    _sensitivities: StateSensitivities | None = None
    _seen: tuple[Array, Array] | None = None
    _jacobian: Array | None = None

    def __post_init__(self) -> None:
        quantity, scale = self.scenario.objective.quantity, self.scenario.scale
        self.first, self.last = nodes_within(self.trajectory, self.scenario.objective.window)
        values = np.full(len(self.trajectory.times), -np.inf)
        values[self.first : self.last + 1] = quantity.values(self.trajectory)[self.first : self.last + 1]
        self.tops = {}
        if self.scenario.objective.refine:
            peaks = find_peaks(self.trajectory, quantity, self.first, self.last, sign=1.0, refine=True)
            for peak in peaks:
                if len(peak.parts) > 1:
                    top = max(peak.parts, key=lambda part: part.weight).node
                    self.tops[top] = peak
                    values[top] = peak.height
        # nodes outside the window can never be the largest
        low = values[self.first : self.last + 1].min()
        self.values = np.where(np.isneginf(values), low - abs(low) - 1e-300, values) / scale

    @property
    def sensitivities(self) -> StateSensitivities:
        """dq/dalpha, computed once."""
        if self._sensitivities is None:
            plain = isinstance(self.scenario.objective.quantity, Deviation) and not self.tops
            self._sensitivities = self.trajectory.state_sensitivities(with_rates=not plain)
        return self._sensitivities

    def parts(self, node: int) -> tuple[NodeWeight, ...]:
        """The nodes behind a value."""
        return self.tops[node].parts if node in self.tops else (NodeWeight(node, 1.0),)

    def gradients(self, nodes: Rows, *, few: bool = False) -> Array:
        """(rows, N) of the values at nodes; few: no more than a few rows are wanted of this run."""
        quantity, times = self.scenario.objective.quantity, self.trajectory.times
        if self.forward and not (few and self._sensitivities is None):
            return np.array([self._by_sensitivities(int(node)) for node in nodes])
        peaks: list[Any] = [
            Peak(
                quantity=quantity,
                time=float(times[node]),
                height=0.0,
                parts=self.parts(int(node)),
                at_end=False,
            )
            for node in nodes
        ]
        return self.by_design(peaks) / self.scenario.scale

    def by_design(self, objectives: list[Any]) -> Array:
        """(R, N + K) gradients of objectives of this run by densities and law variables."""
        if self.variables:
            return extended_gradients(self.trajectory, objectives, self.variables)
        return discrete_adjoints(self.trajectory, objectives)

    @property
    def width(self) -> int:
        """N + K, the number of design variables."""
        return len(self.trajectory.density) + len(self.variables)

    def _by_sensitivities(self, node: int) -> Array:
        """(N,) of the value at a node from dq/dalpha."""
        quantity, r = self.scenario.objective.quantity, self.trajectory
        if isinstance(quantity, Deviation) and node not in self.tops:
            R, J = self.residual
            return 2 * (R[node] @ J[node]) / self.scenario.scale  # type: ignore[no-any-return]
        total = np.zeros(len(r.density))
        for part in self.parts(node):
            pairs = [(part.weight, quantity.slopes(r, part.node))]
            if part.rate_weight:
                pairs.append((part.rate_weight, quantity.rate_slopes(r, part.node)))
            for weight, slopes in pairs:
                s = self.sensitivities
                for slope, table in (
                    (slopes.position, s.position), (slopes.velocity, s.velocity),
                    (slopes.acceleration, s.acceleration),
                ):  # fmt: skip
                    if slope is not None:
                        total += weight * (slope @ table[part.node])
                if slopes.density is not None:
                    total += weight * slopes.density
        return np.asarray(total / self.scenario.scale)

    @property
    def residual(self) -> tuple[Array, Array]:
        """sqrt(W) R (nodes, 2) and its derivative by the densities (nodes, 2, N), for a `Deviation`."""
        if self._jacobian is None:
            R, slopes = self.view()
            self._jacobian = np.matmul(slopes, self.sensitivities.position)
            self._seen = (R, slopes)
        assert self._seen is not None
        return self._seen[0], self._jacobian

    def view(self) -> tuple[Array, Array]:
        """sqrt(W) R (nodes, 2) and its derivative by the coordinates (nodes, 2, n)."""
        quantity, r = self.scenario.objective.quantity, self.trajectory
        assert isinstance(quantity, Deviation)
        view = quantity.view(r)
        root, series = np.sqrt(np.array(quantity.weights)), view.series()
        return (series - series[0]) * root, view.jacobian() * root[:, None]
