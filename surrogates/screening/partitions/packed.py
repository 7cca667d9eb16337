"""The likelihood over partitions by compiled ascents over packed distances: for some hundred runs."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .canonical import CanonicalRuns
from .optimum import LOWEST, Optimum, Partition, bounds_of

__all__ = ["PackedLandscape", "packed_distances"]

Array = NDArray[np.float64]

CACHED = 1_000_000  # doubles of grouped distances that are kept


@dataclass(slots=True)
class PackedLandscape:
    """Compiled, for small designs: memory u n (n - 1) / 2 doubles."""

    distances: Array
    """(u, n (n - 1) / 2) of each unit, pairs packed by rows of the lower triangle."""
    y: Array
    restricted: bool = True
    n_units: int = field(init=False)
    n_runs: int = field(init=False)
    reach: Array = field(init=False)
    _cache: dict[Partition, Array] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        self.n_units, self.n_runs = len(self.distances), len(self.y)
        self.reach = self.distances.mean(axis=1)

    def _rows(self, partition: Partition) -> tuple[Array, NDArray[np.intp]]:
        """Distances and the row of each group: a group of one unit has its own among all of them."""
        if sum(map(len, partition)) == len(partition):
            return self.distances, np.array([g[0] for g in partition], dtype=np.intp)
        if partition not in self._cache:
            if len(self._cache) * self.distances.shape[1] * len(partition) > CACHED:
                self._cache.clear()
            self._cache[partition] = np.array([self.distances[list(g)].sum(axis=0) for g in partition])
        return self._cache[partition], np.arange(len(partition))

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
        rows = self._rows(partition)
        phi, value, sigma2, evaluations = _kernels().ascend(
            *rows, self.y, start, lower, upper, self.restricted, max_evaluations, tolerance
        )
        return Optimum(partition=partition, phi=phi, value=value, sigma2=sigma2, evaluations=evaluations)

    def slopes(self, optimum: Optimum) -> tuple[Array, Array]:
        """Gradient and information of the units."""
        m = self.n_units
        gradient, information = np.zeros(m + 1), np.zeros((m + 1, m + 1))
        phi = np.append(optimum.log_theta(m), optimum.phi[-1])
        everyone, never = np.arange(m), -np.inf
        _kernels().likelihood(
            self.distances, everyone, self.y, phi, self.restricted, 2, gradient, information, never, never
        )
        return gradient[:m], np.diagonal(information)[:m]

    def correlation(self, optimum: Optimum) -> Array:
        """R + nugget I."""
        n = self.n_runs
        c = np.empty((n, n))
        i, j = np.tril_indices(n, -1)
        c[i, j] = c[j, i] = np.exp(-optimum.theta(self.n_units) @ self.distances)
        c.flat[:: n + 1] = 1.0 + np.exp(optimum.phi[-1])
        return c

    def value(self, partition: Partition, phi: Array) -> float:
        """l at phi."""
        none = np.empty((0, 0))
        out = none.ravel(), none
        value, _ = _kernels().likelihood(
            *self._rows(partition), self.y, phi, self.restricted, 0, *out, LOWEST, -np.inf
        )
        return float(value)


def packed_distances(runs: CanonicalRuns, eta: float | Array) -> Array:
    """(u, n (n - 1) / 2): sum over the inputs of a unit of |h|^eta, or of 'labels differ'."""
    etas = np.broadcast_to(eta, len(runs.units))
    i, j = np.tril_indices(len(runs.y), -1)
    out = np.zeros((len(runs.units), len(i)))
    for u, columns in enumerate(runs.units):
        for k in columns:
            h = runs.x[i, k] - runs.x[j, k]
            if k in runs.labels:
                out[u] += h != 0.0
            else:
                out[u] += h * h if etas[u] == 2.0 else np.abs(h) ** etas[u]
    return out


def _kernels() -> Any:
    from ...likelihood import (
        _kernels_likelihood,  # compiled on first use only: large designs need no compiler
    )

    return _kernels_likelihood
