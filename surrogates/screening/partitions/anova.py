"""The likelihood of canonical runs under an ANOVA correlation: each unit has a weight beside its theta.

    R = prod_u (1 + w_u exp(-theta_u D_u)) / (1 + w_u),    D_u = |h_u|^eta

Multiplied out it is a sum over sets of units, as the functional ANOVA decomposition of a response is
(Durrande, Ginsbourger, Roustant and Carraro, J. Multivar. Anal. 115, 2013, 57-67). In the usual product of
exp(-theta_u D_u), the limit of large w_u, a unit that acts weakly has a small theta, and so is nearly a
straight line; here a weak unit may bend and wave, as its weight is small instead. A unit without effect has
w_u = 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

from .canonical import CanonicalRuns
from .packed import packed_distances

__all__ = ["AnovaLandscape", "AnovaOptimum", "anova_landscape"]

Array = NDArray[np.float64]

WEIGHTS = (1e-4, 1e3)  # of a unit that acts
MOST_WEIGHT = 100.0  # while all units are in
THETAS = (0.02, 300.0)
TOLERANCE = 1e-6  # relative, of l


@dataclass(frozen=True, slots=True, kw_only=True)
class AnovaOptimum:
    """Where an ascent ended: weight and log theta of each of `units`, log nugget, and l there."""

    units: tuple[int, ...]
    weight: Array
    log_theta: Array
    log_nugget: float
    value: float

    def without(self, place: int) -> "AnovaOptimum":
        """The same point with one unit taken out; its value is that of before."""
        kept = [i for i in range(len(self.units)) if i != place]
        return AnovaOptimum(
            units=tuple(self.units[i] for i in kept),
            weight=self.weight[kept],
            log_theta=self.log_theta[kept],
            log_nugget=self.log_nugget,
            value=self.value,
        )

    def joined_by(self, unit: int, weight: float, log_theta: float) -> "AnovaOptimum":
        """The same point with one unit more; its value is that of before."""
        return AnovaOptimum(
            units=(*self.units, unit),
            weight=np.append(self.weight, weight),
            log_theta=np.append(self.log_theta, log_theta),
            log_nugget=self.log_nugget,
            value=self.value,
        )


@dataclass(slots=True)
class AnovaLandscape:
    """distances (u, n (n - 1) / 2) of the units, standardised responses y (n,), bounds of the nugget."""

    distances: Array
    y: Array
    restricted: bool
    nugget: tuple[float, float]
    evaluations: int = 0

    @property
    def n_units(self) -> int:
        """How many units may act."""
        return len(self.distances)

    def value(self, at: AnovaOptimum) -> float:
        """l at a point."""
        return self._likelihood(at.units, at.weight, at.log_theta, at.log_nugget)[0]

    def climb_weights(
        self, units: Sequence[int], weight: float, log_theta: float, log_nugget: float, *, steps: int
    ) -> AnovaOptimum:
        """Climb over the nugget and the weights, 0 included, from `weight` for all, theta fixed."""
        m = len(units)
        shared = np.full(m, log_theta)

        def fall(p: Array) -> tuple[float, Array]:
            value, gradient = self._likelihood(units, p[:m], shared, p[m])
            return -value, -np.append(gradient[:m], gradient[2 * m])

        end = self._descend(fall, np.append(np.full(m, weight), log_nugget), [(0.0, MOST_WEIGHT)] * m, steps)
        return self._optimum(units, end[:m], shared, float(end[m]))

    def climb(self, at: AnovaOptimum, *, steps: int) -> AnovaOptimum:
        """Climb over weights, thetas and nugget from a point."""
        m = len(at.units)

        def fall(p: Array) -> tuple[float, Array]:
            weight = np.exp(p[:m])
            value, gradient = self._likelihood(at.units, weight, p[m : 2 * m], p[2 * m])
            gradient[:m] *= weight
            return -value, -gradient

        log_weight = np.log(np.clip(at.weight, *WEIGHTS))
        log_theta = np.clip(at.log_theta, *np.log(THETAS))
        bounds = [tuple(np.log(WEIGHTS))] * m + [tuple(np.log(THETAS))] * m
        end = self._descend(fall, np.concatenate([log_weight, log_theta, [at.log_nugget]]), bounds, steps)
        return self._optimum(at.units, np.exp(end[:m]), end[m : 2 * m], float(end[2 * m]))

    def left_out_errors(self, at: AnovaOptimum) -> Array:
        """(n,) errors of the leave-one-out predictions at a point, v_i / P_ii; the trend is a constant."""
        n = len(self.y)
        packed = np.ones(self.distances.shape[1])
        for unit, weight, log_theta in zip(at.units, at.weight, at.log_theta, strict=True):
            packed *= (1.0 + weight * np.exp(-np.exp(log_theta) * self.distances[unit])) / (1.0 + weight)
        c = np.empty((n, n))
        i, j = np.tril_indices(n, -1)
        c[i, j] = c[j, i] = packed
        c.flat[:: n + 1] = 1.0 + np.exp(at.log_nugget)
        inverse = np.linalg.inv(c)
        one = inverse.sum(axis=1)
        p = np.diagonal(inverse) - one**2 / one.sum()
        v = inverse @ self.y - one * (one @ self.y) / one.sum()
        return np.asarray(v / p)

    def _likelihood(
        self, units: Sequence[int], weight: Array, log_theta: Array, log_nugget: float
    ) -> tuple[float, Array]:
        gradient = np.zeros(2 * len(units) + 1)
        self.evaluations += 1
        value, _ = _kernels().anova_likelihood(
            self.distances,
            np.array(units, dtype=np.intp),
            self.y,
            np.asarray(weight, dtype=float),
            np.exp(log_theta),
            float(np.exp(log_nugget)),
            self.restricted,
            gradient,
        )
        return float(value), gradient

    def _descend(self, fall: Any, start: Array, bounds: list[tuple[float, float]], steps: int) -> Array:
        low, high = np.log(self.nugget)
        start[-1] = np.clip(start[-1], low, high)
        found = minimize(
            fall,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=[*bounds, (low, high)],
            options={"maxiter": steps, "ftol": TOLERANCE},
        )
        return np.asarray(found.x)

    def _optimum(
        self, units: Sequence[int], weight: Array, log_theta: Array, log_nugget: float
    ) -> AnovaOptimum:
        value, _ = self._likelihood(units, weight, log_theta, log_nugget)
        return AnovaOptimum(
            units=tuple(units), weight=weight, log_theta=log_theta, log_nugget=log_nugget, value=value
        )


def anova_landscape(
    runs: CanonicalRuns, *, restricted: bool, eta: float, nugget: tuple[float, float]
) -> AnovaLandscape:
    """The landscape of canonical runs."""
    return AnovaLandscape(packed_distances(runs, eta), runs.y, restricted, nugget)


def _kernels() -> Any:
    from ...likelihood import _kernels_anova  # compiled on first use only

    return _kernels_anova
