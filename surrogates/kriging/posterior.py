"""The process given the runs: best linear unbiased prediction, its covariance, and its slopes in x.

    m(x)    = f' b + r' v                                                    eqs. (3.10), (3.11)
    k(x, z) = sigma^2 [R(x, z) - r_x' C^-1 r_z + h_x' (F' C^-1 F)^-1 h_z],   h = f - F' C^-1 r

The third term is what estimating the trend costs. The nugget is noise of the runs: m passes through the runs
only without it, and k is the covariance of the process without the noise of a new run.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..likelihood.correlation import Correlation
from ..likelihood.likelihood import Factor, _solve
from .trend import Term, TrendFunction, basis

__all__ = ["Posterior", "Scaling", "TrendBasis"]

Array = NDArray[np.float64]
BLOCK = 4_000_000  # numbers in the largest temporary array of a prediction


@dataclass(frozen=True, slots=True, kw_only=True)
class Scaling:
    """x -> (x - low) / width - 1/2 for coordinates; label columns keep their codes (width 1, low -1/2)."""

    low: Array
    width: Array

    def __call__(self, x: Array) -> Array:
        """Scaled coordinates of x (m, d)."""
        return np.ascontiguousarray((x - self.low) / self.width - 0.5)


@dataclass(frozen=True, slots=True, kw_only=True)
class TrendBasis:
    """F at any points: polynomial terms of the scaled inputs, or chosen columns of a user's function of X."""

    terms: tuple[Term, ...] = ()
    function: TrendFunction | None = None
    columns: tuple[int, ...] = ()
    size: Array | float = 1.0

    def __call__(self, u: Array, x: Array) -> Array:
        """F (m, p) at scaled points u, which are x in the user's coordinates."""
        if self.function is None:
            return basis(u, self.terms)
        f = np.asarray(self.function(x), dtype=np.float64)
        if f.ndim != 2 or len(f) != len(x):
            raise ValueError(f"trend function needs to return an array of shape ({len(x)}, p), got {f.shape}")
        return np.asarray(f[:, list(self.columns)] / self.size)


@dataclass(frozen=True, slots=True, kw_only=True)
class Posterior:
    """Everything a prediction needs. Arrays are in scaled coordinates and scaled responses.

    Attributes:
        scaling, trend: from the user's coordinates to u and F.
        u: (n, d) runs.   f: (n, p).   correlation, theta: of the process.   factor: of C.
        coefficients: (p,) b.   weights: (n,) v.   sigma2: of the scaled response.
        shift, scale: response = shift + scale * scaled response.
        new_run: variance over sigma2 of a new run about the process, where std is that of a run.
    """

    scaling: Scaling
    trend: TrendBasis
    u: Array
    f: Array
    correlation: Correlation
    theta: Array
    factor: Factor
    coefficients: Array
    weights: Array
    sigma2: float
    shift: float
    scale: float
    new_run: float = 0.0

    def calibrated(self, factor: float, *, nugget: float) -> "Posterior":
        """The same with deviations `factor` times as large, and std that of a new run."""
        return replace(self, sigma2=self.sigma2 * factor**2, new_run=nugget)

    def _blocks(self, m: int) -> list[slice]:
        size = max(1, BLOCK // max(len(self.u), 1))
        return [slice(i, i + size) for i in range(0, m, size)]

    def mean(self, x: Array) -> Array:
        """m at x (m, d) in the user's coordinates, (m,)."""
        out = np.empty(len(x))
        for rows in self._blocks(len(x)):
            u = self.scaling(x[rows])
            r = self.correlation.cross(u, self.u, self.theta)
            out[rows] = self.trend(u, x[rows]) @ self.coefficients + r @ self.weights
        return self.shift + self.scale * out

    def mean_and_std(self, x: Array) -> tuple[Array, Array]:
        """m and the square root of k(x, x) + sigma^2 new_run, each (m,)."""
        mean, variance = np.empty(len(x)), np.empty(len(x))
        for rows in self._blocks(len(x)):
            u = self.scaling(x[rows])
            r = self.correlation.cross(u, self.u, self.theta)
            f = self.trend(u, x[rows])
            mean[rows] = f @ self.coefficients + r @ self.weights
            a, h = self._reduce(r, f)
            variance[rows] = 1.0 - np.einsum("ij,ij->j", a, a) + np.einsum("ij,ij->j", h, h)
        variance = np.maximum(variance, 0.0) + self.new_run
        return self.shift + self.scale * mean, self.scale * np.sqrt(self.sigma2 * variance)

    def _reduce(self, r: Array, f: Array) -> tuple[Array, Array]:
        """L^-1 r and (rf')^-1 h for cross correlations r (m, n) and trend f (m, p)."""
        a = _solve(self.factor.lower, r.T, lower=True)
        h = _solve(self.factor.rf, f.T - self.factor.rf.T @ (self.factor.q.T @ a), transposed=True)
        return a, h

    def covariance(self, x: Array) -> tuple[Array, Array]:
        """m (m,) and k between all rows of x, (m, m)."""
        u = self.scaling(x)
        r = self.correlation.cross(u, self.u, self.theta)
        f = self.trend(u, x)
        a, h = self._reduce(r, f)
        k = self.correlation.matrix(u, self.theta)
        k -= a.T @ a
        k += h.T @ h
        mean = self.shift + self.scale * (f @ self.coefficients + r @ self.weights)
        return mean, self.scale**2 * self.sigma2 * 0.5 * (k + k.T)

    def slopes(self, x: Array) -> tuple[Array, Array]:
        """Gradients of m and of k(x, x) in x, each (m, d), in the user's units; zero for label inputs."""
        mean, variance = np.empty(x.shape), np.empty(x.shape)
        for rows in self._blocks(len(x)):
            mean[rows], variance[rows] = self._slopes(x[rows])
        return mean, variance

    def _slopes(self, x: Array) -> tuple[Array, Array]:
        u = self.scaling(x)
        r = self.correlation.cross(u, self.u, self.theta)
        f = self.trend(u, x)
        a, h = self._reduce(r, f)
        # k = sigma^2 (1 - a'a + h'h): dk = 2 sigma^2 [ (df)' g - dr' (C^-1 r + C^-1 F g) ], g = rf^-1 h
        g = _solve(self.factor.rf, h)
        inner = a + self.factor.q @ h
        pull = _solve(self.factor.lower, inner, lower=True, transposed=True).T
        along = self.correlation.slopes
        mean = np.asarray(along(u, self.u, self.theta, weights=r * self.weights) / self.scaling.width)
        variance = -2.0 * along(u, self.u, self.theta, weights=r * pull) / self.scaling.width
        for k in range(x.shape[1]):
            if k in self.correlation.labels:
                continue
            df = self._trend_slope(u, x, k)
            mean[:, k] += df @ self.coefficients
            variance[:, k] += 2.0 * np.einsum("ij,ji->i", df, g)
        return self.scale * mean, self.scale**2 * self.sigma2 * variance

    def _trend_slope(self, u: Array, x: Array, k: int) -> Array:
        """dF/dx_k (m, p): exact for polynomials, central differences for a user's function."""
        if self.trend.function is not None:
            step = 1e-6 * self.scaling.width[k]
            up, down = x.copy(), x.copy()
            up[:, k] += step
            down[:, k] -= step
            return np.asarray((self.trend(u, up) - self.trend(u, down)) / (2.0 * step))
        df = np.zeros((len(u), len(self.trend.terms)))
        for column, term in enumerate(self.trend.terms):
            for at, inner in enumerate(term):
                if inner == k:
                    rest = term[:at] + term[at + 1 :]
                    df[:, column] += np.prod(u[:, list(rest)], axis=1) if rest else 1.0
        return np.asarray(df / self.scaling.width[k])
