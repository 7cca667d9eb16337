"""The likelihood over partitions by matrix products over the inputs: for large designs."""

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from ...likelihood.ascent import ascend
from ...likelihood.likelihood import Likelihood, Workspace
from .optimum import FAILED, Optimum, Partition, bounds_of

__all__ = ["DenseLandscape"]

Array = NDArray[np.float64]


@dataclass(slots=True)
class DenseLandscape:
    """Matrix products, for large designs: memory O(n^2 + n d)."""

    likelihood: Likelihood
    units: tuple[tuple[int, ...], ...]
    n_units: int = field(init=False)
    n_runs: int = field(init=False)
    y: Array = field(init=False)
    reach: Array = field(init=False)

    def __post_init__(self) -> None:
        self.n_units, self.n_runs, self.y = len(self.units), len(self.likelihood.y), self.likelihood.y[:, 0]
        self.likelihood = replace(self.likelihood, work=Workspace(self.n_runs))
        x = self.likelihood.x
        each = 2.0 * x.var(axis=0) * len(x) / max(len(x) - 1, 1)  # mean over pairs of (x_i - x_j)^2
        for k in self.likelihood.correlation.labels:
            share = np.unique(x[:, k], return_counts=True)[1] / len(x)
            each[k] = (1.0 - float(share @ share)) * len(x) / max(len(x) - 1, 1)
        self.reach = np.array([each[list(u)].sum() for u in self.units])

    def _likelihood(self, partition: Partition, nugget: float | None) -> Likelihood:
        group = {k: g for g, members in enumerate(partition) for u in members for k in self.units[u]}
        kept = sorted(group)
        whole = self.likelihood
        correlation = replace(
            whole.correlation, labels=tuple(i for i, k in enumerate(kept) if k in whole.correlation.labels)
        )
        return replace(
            whole,
            x=np.ascontiguousarray(whole.x[:, kept]),
            correlation=correlation,
            groups=np.array([group[k] for k in kept], dtype=np.intp),
            nugget=nugget,
        )

    def climb(
        self,
        partition: Partition,
        start: Array,
        *,
        nugget: tuple[float, float],
        tolerance: float,
        max_evaluations: int,
    ) -> Optimum:
        """Climb from start."""
        lower, upper = bounds_of(len(partition), nugget)
        m = len(partition)
        free = nugget[0] < nugget[1]
        k = m + 1 if free else m
        surface = self._likelihood(partition, None if free else nugget[0])
        end = ascend(
            surface.evaluate,
            np.clip(start, lower, upper)[:k],
            lower=lower[:k],
            upper=upper[:k],
            tolerance=tolerance,
            max_evaluations=max_evaluations,
        )
        if end is None:
            return Optimum(partition=partition, phi=start, value=FAILED, sigma2=1.0, evaluations=1)
        phi = end.parameters if free else np.append(end.parameters, np.log(nugget[0]))
        return Optimum(
            partition=partition,
            phi=phi,
            value=end.value,
            sigma2=float(end.sigma2[0]),
            evaluations=end.evaluations,
        )

    def slopes(self, optimum: Optimum) -> tuple[Array, Array]:
        """Gradient and information of the units."""
        everyone = tuple((u,) for u in range(self.n_units))
        surface = self._likelihood(everyone, float(np.exp(optimum.phi[-1])))
        at = surface.evaluate(optimum.log_theta(self.n_units))
        if at is None or at.information is None:
            return np.zeros(self.n_units), np.ones(self.n_units)
        return at.gradient, np.diagonal(at.information)

    def correlation(self, optimum: Optimum) -> Array:
        """R + nugget I."""
        surface = self._likelihood(optimum.partition, float(np.exp(optimum.phi[-1])))
        c = surface.correlation.matrix(surface.x, surface.unpack(optimum.phi[:-1]).theta)
        c.flat[:: len(c) + 1] += np.exp(optimum.phi[-1])
        return c

    def value(self, partition: Partition, phi: Array) -> float:
        """l at phi."""
        surface = self._likelihood(partition, float(np.exp(phi[-1])))
        value = surface.value(phi[:-1])
        return value if np.isfinite(value) else FAILED
