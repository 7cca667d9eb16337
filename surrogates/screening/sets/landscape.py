"""The likelihood of canonical runs over partitions of the units into groups with one theta each.

A screening compares partitions: every unit on its own (ARD), a few selected units on their own and the
rest without effect (units in no group have theta = 0), or the rest pooled in one group with a common theta,
as published. A `Landscape` climbs from a start to a maximum of l for a given partition. Two ways lead up: up
to `PACKED_RUNS` runs a compiled ascent over packed distances, for larger designs matrix products over the
inputs. Both take average-information steps.

Coordinates: log theta of each group, log nugget last; the nugget is fixed where its bounds meet.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...likelihood.ascent import ascend
from ...likelihood.correlation import Correlation
from ...likelihood.likelihood import Likelihood, Workspace
from .canonical import CanonicalRuns

__all__ = [
    "PACKED_RUNS",
    "DenseLandscape",
    "Landscape",
    "Optimum",
    "PackedLandscape",
    "landscape_of",
    "left_out_q2",
    "log_reach",
    "packed_distances",
    "standard_scores",
]

Array = NDArray[np.float64]
Partition = tuple[tuple[int, ...], ...]  # units of each group; a unit in none has theta = 0

PACKED_RUNS = 130  # where LAPACK's blocked factorisation overtakes the compiled loops
LOWEST, HIGHEST = -16.0, 6.0  # log theta on [0, 1]: a range of 3000 box widths, and of a twentieth
FAILED = -1e300
CACHED = 1_000_000  # doubles of grouped distances that are kept


@dataclass(frozen=True, slots=True, kw_only=True)
class Optimum:
    """A point of the landscape: where an ascent ended.

    Attributes:
        partition: units of each group.
        phi: (m + 1,) log theta of each group, log nugget.
        value: l of the standardised response.
        sigma2: process variance of the standardised response.
        evaluations: how many likelihoods it took.
    """

    partition: Partition
    phi: Array
    value: float
    sigma2: float
    evaluations: int

    def log_theta(self, n_units: int) -> Array:
        """(u,) log theta of every unit; that of one without a group lies on the lower bound."""
        out = np.full(n_units, LOWEST)
        for group, value in zip(self.partition, self.phi, strict=False):
            out[list(group)] = value
        return out

    def log_effect(self, reach: Array) -> Array:
        """(u,) log of theta times the `reach` of every unit of a landscape, -inf where that is 0."""
        return self.log_theta(len(reach)) + log_reach(reach)

    def theta(self, n_units: int) -> Array:
        """(u,) theta of every unit, 0 on the lower bound."""
        log_theta = self.log_theta(n_units)
        return np.where(log_theta <= LOWEST, 0.0, np.exp(log_theta))


def log_reach(reach: Array) -> Array:
    """Logarithm of the reach of units, -inf for those that are constant."""
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(reach))


class Landscape(Protocol):
    """What a search needs."""

    n_units: int
    n_runs: int
    y: Array
    reach: Array
    """(u,) mean distance of each unit: theta times reach says how far a unit lowers the mean correlation.

    It is 0 for a unit that a part of the runs leaves constant, which has no effect there.
    """

    def climb(
        self,
        partition: Partition,
        start: Array,
        *,
        nugget: tuple[float, float],
        tolerance: float,
        max_evaluations: int,
    ) -> Optimum:
        """Climb from start; `nugget` bounds the nugget."""

    def value(self, partition: Partition, phi: Array) -> float:
        """l at phi."""

    def slopes(self, optimum: Optimum) -> tuple[Array, Array]:
        """dl / dlog theta and average information of every unit's own log theta, each (u,)."""

    def correlation(self, optimum: Optimum) -> Array:
        """R + nugget I, (n, n)."""


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
        lower, upper = _bounds(len(partition), nugget)
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
        lower, upper = _bounds(len(partition), nugget)
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


def _kernels() -> Any:
    from ...likelihood import (
        _kernels_likelihood,  # compiled on first use only: large designs need no compiler
    )

    return _kernels_likelihood


def _bounds(m: int, nugget: tuple[float, float]) -> tuple[Array, Array]:
    lower, upper = np.full(m + 1, LOWEST), np.full(m + 1, HIGHEST)
    lower[m], upper[m] = np.log(nugget[0]), np.log(nugget[1])
    return lower, upper


def standard_scores(landscape: Landscape, optimum: Optimum) -> Array:
    """(u,) for every unit: dl / dlog theta of its own, in standard deviations by the average information."""
    gradient, information = landscape.slopes(optimum)
    # both vanish with theta (as theta and theta^2), so the ratio has a limit at theta = 0
    return np.asarray(gradient / np.sqrt(np.maximum(information, 1e-300)))


def left_out_q2(landscape: Landscape, optimum: Optimum) -> float:
    """Q^2 of the leave-one-out predictions at an optimum: 1 - sum (v_i / P_ii)^2 / sum y_i^2."""
    c, y = landscape.correlation(optimum), landscape.y.ravel()
    b = np.linalg.solve(c, np.column_stack([np.ones(len(y)), y]))
    inverse = np.linalg.inv(c)
    s11 = b[:, 0].sum()
    p = np.diagonal(inverse) - b[:, 0] ** 2 / s11
    v = b[:, 1] - b[:, 0] * (b[:, 1].sum() / s11)
    # a run that the others do not inform about has P_ii near 0 and is left out, as the trend is fitted to it
    usable = p > 1e-12 * p.max()
    spread = y[usable] - y.mean()
    return float(1.0 - ((v[usable] / p[usable]) ** 2).sum() / (spread @ spread))


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


def landscape_of(
    runs: CanonicalRuns,
    *,
    restricted: bool = True,
    eta: float | Array = 2.0,
    rows: NDArray[np.intp] | None = None,
) -> Landscape:
    """The landscape of canonical runs, or of some of their rows."""
    if rows is not None:
        runs = replace(runs, x=np.ascontiguousarray(runs.x[rows]), y=runs.y[rows])
    if len(runs.y) <= PACKED_RUNS or np.ptp(eta) > 0.0:
        return PackedLandscape(packed_distances(runs, eta), runs.y, restricted)
    eta = float(np.max(eta))
    correlation = Correlation(
        kind="gaussian" if eta == 2.0 else "power_exponential", eta=eta, labels=runs.labels
    )
    return DenseLandscape(
        Likelihood(
            x=runs.x,
            f=np.ones((len(runs.y), 1)),
            y=runs.y[:, None],
            correlation=correlation,
            groups=np.zeros(runs.x.shape[1], dtype=np.intp),
            restricted=restricted,
        ),
        runs.units,
    )
