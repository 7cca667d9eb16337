"""Correlations of a stationary process: products over the inputs of one-dimensional correlations.

    R(a, b) = prod_k r(|a_k - b_k|; theta_k)                                     eq. (3.4) of the dissertation

    gaussian            r(h) = exp(-theta h^2)
    power_exponential   r(h) = exp(-theta h^eta),              1 <= eta <= 2
    matern32            r(h) = (1 + a) exp(-a),                a = sqrt(3 theta) h
    matern52            r(h) = (1 + a + a^2/3) exp(-a),        a = sqrt(5 theta) h
    matern72            r(h) = (1 + a + 2 a^2/5 + a^3/15) exp(-a),   a = sqrt(7 theta) h

A larger theta means a more active input in all five; theta^(-1/2) is the range of a Matern correlation. An
input that is only a label (categorical) has r = exp(-theta) between different labels and 1 between equal
ones: compound symmetry with a positive correlation, so the product stays positive definite for any number of
labels.

Memory is O(n^2 + n d): the Gaussian case is written with matrix products, the others with compiled loops.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["CORRELATIONS", "Correlation"]

CORRELATIONS = {"gaussian": 0, "power_exponential": 1, "matern32": 2, "matern52": 3, "matern72": 4}
ROOTS = {"matern32": 3.0**0.5, "matern52": 5.0**0.5, "matern72": 7.0**0.5}  # of twice the smoothness


def _kernels() -> Any:
    from . import _kernels_correlation  # compiled on first use only: the Gaussian case needs no compiler

    return _kernels_correlation


@dataclass(frozen=True, slots=True, kw_only=True)
class Correlation:
    """A product correlation of one of the five kinds, with label inputs named by column.

    >>> import numpy as np
    >>> r = Correlation(kind="matern52").matrix(np.array([[0.0], [0.5]]), np.array([4.0]))
    >>> print(round(r[0, 1], 6))
    0.523994

    Args:
        kind: a key of `CORRELATIONS`.
        eta: exponent of the power-exponential kind; not used by the others.
        labels: columns that hold labels instead of coordinates.
    """

    kind: str = "gaussian"
    eta: float = 2.0
    labels: tuple[int, ...] = ()

    def _coordinates(self, d: int) -> NDArray[np.intp]:
        return np.setdiff1d(np.arange(d), self.labels)

    def _scale(self, theta: NDArray[np.float64]) -> NDArray[np.float64]:
        factor = ROOTS.get(self.kind)
        return theta if factor is None else factor * np.sqrt(theta)

    def matrix(
        self, x: NDArray[np.float64], theta: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """R between all rows of x (n, d); theta (d,). Exactly symmetric with a unit diagonal.

        `out` (n, n) may receive it (numeric Gaussian correlations only).
        """
        if not self.labels:
            return self._numeric_matrix(x, theta, out)
        k = self._coordinates(x.shape[1])
        r = (
            self._numeric_matrix(np.ascontiguousarray(x[:, k]), theta[k])
            if len(k)
            else np.ones((len(x),) * 2)
        )
        for column in self.labels:
            r *= np.where(x[:, column, None] != x[None, :, column], np.exp(-theta[column]), 1.0)
        return r

    def _numeric_matrix(
        self, x: NDArray[np.float64], theta: NDArray[np.float64], out: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        if self.kind != "gaussian":
            return np.asarray(_kernels().gram(x, self._scale(theta), CORRELATIONS[self.kind], self.eta))
        z = x * np.sqrt(theta)
        r = np.matmul(z, z.T, out=out)
        norm = np.diagonal(r).copy()
        r *= 2.0
        r -= norm[:, None]
        r -= norm
        np.minimum(r, 0.0, out=r)
        np.exp(r, out=r)
        np.fill_diagonal(r, 1.0)
        return r

    def cross(
        self, a: NDArray[np.float64], b: NDArray[np.float64], theta: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """R between the rows of a (m, d) and of b (n, d): (m, n)."""
        if not self.labels:
            return self._numeric_cross(a, b, theta)
        k = self._coordinates(a.shape[1])
        r = np.ones((len(a), len(b)))
        if len(k):
            r = self._numeric_cross(np.ascontiguousarray(a[:, k]), np.ascontiguousarray(b[:, k]), theta[k])
        for column in self.labels:
            r *= np.where(a[:, column, None] != b[None, :, column], np.exp(-theta[column]), 1.0)
        return r

    def _numeric_cross(
        self, a: NDArray[np.float64], b: NDArray[np.float64], theta: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        if self.kind != "gaussian":
            return np.asarray(_kernels().cross(a, b, self._scale(theta), CORRELATIONS[self.kind], self.eta))
        root = np.sqrt(theta)
        p, q = a * root, b * root
        r = 2.0 * (p @ q.T)
        r -= np.einsum("ij,ij->i", p, p)[:, None]
        r -= np.einsum("ij,ij->i", q, q)
        np.minimum(r, 0.0, out=r)
        return np.exp(r, out=r)

    def derivatives(
        self,
        x: NDArray[np.float64],
        theta: NDArray[np.float64],
        *,
        r: NDArray[np.float64],
        w: NDArray[np.float64],
        v: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Derivatives of R in phi = (log theta_1 .. log theta_d), and eta last for the power-exponential.

        Returns `sum_ij W_ij dR_ij/dphi_k`, (k,), and `(dR/dphi_k) v`, (n, k). `r` is `matrix(x, theta)`, `w`
        any (n, n), `v` an (n,).
        """
        if not self.labels:
            return self._numeric_derivatives(x, theta, r, w, v)
        n, d = x.shape
        k = self._coordinates(d)
        more = int(self.kind == "power_exponential")
        total, action = np.zeros(d + more), np.zeros((n, d + more))
        if len(k):
            t, a = self._numeric_derivatives(np.ascontiguousarray(x[:, k]), theta[k], r, w, v)
            to = np.concatenate([k, [d]]) if more else k
            total[to], action[:, to] = t, a
        for column in self.labels:
            dr = np.where(x[:, column, None] != x[None, :, column], -theta[column] * r, 0.0)
            total[column], action[:, column] = np.vdot(w, dr), dr @ v
        return total, action

    def _numeric_derivatives(
        self,
        x: NDArray[np.float64],
        theta: NDArray[np.float64],
        r: NDArray[np.float64],
        w: NDArray[np.float64],
        v: NDArray[np.float64],
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        if self.kind != "gaussian":
            kernel = _kernels().derivatives
            total, action = kernel(x, r, w, v, self._scale(theta), CORRELATIONS[self.kind], self.eta)
            return np.asarray(total), np.asarray(action)
        # sum_ij S_ij (x_ik - x_jk)^2 = sum_i s_i x_ik^2 - 2 x_k' S x_k with s the sums of rows and columns:
        # all inputs in one product
        s = w * r
        squares = x * x
        sums = s.sum(axis=0) + s.sum(axis=1)
        total = -theta * (sums @ squares - 2.0 * np.einsum("ik,ik->k", x, s @ x))
        d = x.shape[1]
        rows = r @ np.concatenate([v[:, None], v[:, None] * x, v[:, None] * squares], axis=1)
        action = squares * rows[:, :1] - 2.0 * x * rows[:, 1 : d + 1] + rows[:, d + 1 :]
        action *= -theta
        return total, action

    def slopes(
        self,
        a: NDArray[np.float64],
        b: NDArray[np.float64],
        theta: NDArray[np.float64],
        *,
        weights: NDArray[np.float64],
    ) -> NDArray[np.float64]:
        """`sum_j weights_ij dR(a_i, b_j)/da_ik`, (m, d); `weights` already contains the factor R, (m, n).

        A label has no slope: its column is zero.
        """
        out = np.zeros(a.shape)
        for k in self._coordinates(a.shape[1]):
            h = a[:, k, None] - b[None, :, k]
            out[:, k] = np.einsum("ij,ij->i", weights, self._log_slope(h, float(theta[k])))
        return out

    def _log_slope(self, h: NDArray[np.float64], theta: float) -> NDArray[np.float64]:
        """d log r(|h|) / dh."""
        if self.kind == "gaussian":
            return np.asarray(-2.0 * theta * h)
        if self.kind == "power_exponential":
            return np.asarray(-self.eta * theta * np.sign(h) * np.abs(h) ** (self.eta - 1.0))
        s = ROOTS[self.kind] * theta**0.5
        t = s * np.abs(h)
        if self.kind == "matern32":
            return np.asarray(-s * s * h / (1.0 + t))
        if self.kind == "matern52":
            return np.asarray(-s * s * h * (1.0 + t) / (3.0 + 3.0 * t + t * t))
        return np.asarray(-s * s * h * (3.0 + 3.0 * t + t * t) / (15.0 + 15.0 * t + t * t * (6.0 + t)))

    def along(self, h: NDArray[np.float64], theta: float, *, column: int) -> NDArray[np.float64]:
        """The factor r(|h|; theta) of one input, any shape."""
        if column in self.labels:
            return np.where(h != 0.0, np.exp(-theta), 1.0)
        if self.kind == "gaussian":
            return np.asarray(np.exp(-theta * h * h))
        t = np.abs(h)
        if self.kind == "power_exponential":
            return np.asarray(np.exp(-theta * t**self.eta))
        t = ROOTS[self.kind] * theta**0.5 * t
        if self.kind == "matern32":
            return np.asarray((1.0 + t) * np.exp(-t))
        if self.kind == "matern52":
            return np.asarray((1.0 + t + t * t / 3.0) * np.exp(-t))
        return np.asarray((1.0 + t + t * t * (6.0 + t) / 15.0) * np.exp(-t))
