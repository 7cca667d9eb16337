"""Averages of correlation and trend over the law of each input, whose products are averages over all."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ..kriging.posterior import Posterior
from .measure import Measure

__all__ = ["Averages"]

Array = NDArray[np.float64]


class Averages:
    """Sums of the correlation and the trend over each input's measure, for products over the inputs."""

    def __init__(self, posterior: Posterior, measures: Sequence[Measure]) -> None:
        if posterior.trend.function is not None:
            raise ValueError(
                "effects need a polynomial trend: a function of the user is no product over inputs"
            )
        self.posterior = posterior
        d = posterior.u.shape[1]
        self.points = [
            (m.points - low) / width - 0.5
            for m, low, width in zip(measures, posterior.scaling.low, posterior.scaling.width, strict=True)
        ]
        self.weights = [m.weights for m in measures]
        self.to_runs = [self.weights[k] @ self.along(k, self.points[k]) for k in range(d)]
        self.within = [
            float(self.weights[k] @ self.between(k, self.points[k]) @ self.weights[k]) for k in range(d)
        ]
        self.trend = [self.weights[k] @ self.powers(k, self.points[k]) for k in range(d)]

    def along(self, k: int, u: Array) -> Array:
        """r_k between values u (q,) of input k and the runs, (q, n)."""
        p = self.posterior
        return p.correlation.along(u[:, None] - p.u[None, :, k], float(p.theta[k]), column=k)

    def between(self, k: int, u: Array, v: Array | None = None) -> Array:
        """r_k between values of input k."""
        p = self.posterior
        other = u if v is None else v
        return p.correlation.along(u[:, None] - other[None, :], float(p.theta[k]), column=k)

    def powers(self, k: int, u: Array) -> Array:
        """The factor of input k in every trend term, (q, p)."""
        return np.stack([u ** term.count(k) for term in self.posterior.trend.terms], axis=1)
