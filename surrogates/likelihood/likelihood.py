"""Restricted and full log-likelihood of a Kriging model with any trend, correlation, nugget and noise.

    y = F beta + z,   Z = sigma^2 C,   C = R(theta) + nugget I + diag(noise) / sigma^2

    restricted  2 l = -log|Z| - log|F' Z^-1 F| - (y - F b)' Z^-1 (y - F b)     eq. (3.13) without constant
    full        2 l = -log|Z| - (y - F b)' Z^-1 (y - F b)
    b = (F' Z^-1 F)^-1 F' Z^-1 y                                                 eq. (3.9)

Without per-run noise sigma^2 is profiled: sigma^2 = Q / m with Q = (y - F b)' C^-1 (y - F b) and m = n - p
(restricted) or n (full). log|F' Z^-1 F| holds -p log sigma^2, which is what turns n into n - p.

With P = C^-1 - C^-1 F (F' C^-1 F)^-1 F' C^-1 and v = P y, the derivative of l in a parameter phi of C is
-1/2 tr(P C_phi) + 1/2 v' C_phi v / sigma^2; the full likelihood has C^-1 in place of P in the trace. The
average information is 1/2 u_k' P u_l / sigma^2 with u_k = C_phi v, and with sigma^2 profiled its Schur
complement.

Parameters, in this order: log theta (one per group of inputs), eta if free, log nugget if free, log sigma^2
if there is noise. Several responses y (n, q) share all of them but sigma^2, and their l are added.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import blas, lapack

from .ascent import Evaluation
from .correlation import Correlation

__all__ = ["Factor", "Likelihood", "Parameters", "Workspace", "factorise"]

Array = NDArray[np.float64]


class Workspace:
    """Matrices of n runs that one evaluation after the other is computed in.

    At 500 runs a third of an evaluation goes into fresh pages for its matrices. Results that refer to the
    workspace, such as a `Factor`, hold until the next evaluation.
    """

    __slots__ = ("inverse", "lower", "r")

    def __init__(self, n: int) -> None:
        self.r = np.empty((n, n))
        self.lower, self.inverse = np.empty((n, n), order="F"), np.empty((n, n), order="F")


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameters:
    """Parameters of the process in the coordinates of the likelihood; sigma2 is None where it is profiled."""

    theta: Array
    eta: float
    nugget: float
    sigma2: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Factor:
    """C = L L' and everything that generalised least squares needs from it.

    `q`, `rf`: L^-1 F = q rf, (n, p) and (p, p); `residual`: L^-1 (y - F b), (n, q); `quadratic`: Q, (q,);
    `weights`: v = C^-1 (y - F b), (n, q); `log_det`: log|C|; `log_det_trend`: log|F' C^-1 F|.
    """

    r: Array
    lower: Array
    q: Array
    rf: Array
    residual: Array
    weights: Array
    quadratic: Array
    log_det: float
    log_det_trend: float

    def coefficients(self, y: Array) -> Array:
        """b of eq. (3.9), (p, q)."""
        return _solve(self.rf, self.q.T @ _solve(self.lower, y, lower=True))

    def half_inverse(self, out: Array | None = None) -> Array:
        """Lower triangle of C^-1, 0 above it, (n, n) by columns; in `out` if that is given."""
        half = np.empty_like(self.lower, order="F") if out is None else out
        np.copyto(half, self.lower)
        half, info = lapack.dpotri(half, lower=1, overwrite_c=1)  # the upper triangle stays 0
        assert info == 0
        return np.asarray(half)

    def inverse_diagonal(self) -> Array:
        """Diagonal of C^-1, (n,)."""
        return np.diagonal(self.half_inverse()).copy()

    def trend_in_runs(self) -> Array:
        """G with P = C^-1 - G G', (n, p)."""
        return _solve(self.lower, self.q, lower=True, transposed=True)

    def projected(self, u: Array) -> Array:
        """h with P = C^-1 - G G' and u' P u = h' h, (n, m) for u (n, m)."""
        h = _solve(self.lower, u, lower=True)
        return np.asarray(h - self.q @ (self.q.T @ h))


def _solve(a: Array, b: Array, *, lower: bool = False, transposed: bool = False) -> Array:
    """Triangular solve by LAPACK directly: scipy's wrapper costs more than the work at 30 runs."""
    if not a.size or not b.size:
        return np.zeros(b.shape)
    x, info = lapack.dtrtrs(a, b, lower=int(lower), trans=int(transposed))
    assert info == 0
    return np.asarray(x)


def _orthonormal(z: Array) -> tuple[Array, Array] | None:
    """Thin QR with a positive diagonal, by two Cholesky passes; Householder where those fail."""
    if z.shape[1] == 0:
        return z, np.zeros((0, 0))
    if z.shape[1] == 1:
        size = float(np.linalg.norm(z))
        return (z / size, np.full((1, 1), size)) if size > 0.0 else None
    first, info = lapack.dpotrf(z.T @ z, lower=0, clean=1)
    if info == 0:
        q = _solve(first, z.T, transposed=True).T
        second, info = lapack.dpotrf(q.T @ q, lower=0, clean=1)
        # the first pass must have left q nearly orthonormal for the second to finish the job
        if info == 0 and np.abs(np.diagonal(second) - 1.0).max() < 0.1:
            return _solve(second, q.T, transposed=True).T, np.asarray(second @ first)
    q, rf = np.linalg.qr(z)
    size = np.abs(np.diagonal(rf))
    return (q, rf) if size.min() > 1e-14 * size.max() else None


def factorise(
    r: Array, diagonal: Array | float, f: Array, y: Array, out: Array | None = None
) -> Factor | None:
    """Factor of C = R + diag(diagonal); None when C or F' C^-1 F is not positive definite to rounding.

    L is computed in `out` (n, n), by columns, if that is given.
    """
    c = np.empty(r.shape, order="F") if out is None else out
    np.copyto(c, r.T)  # symmetric
    np.einsum("ii->i", c)[:] += diagonal
    lower, info = lapack.dpotrf(c, lower=1, clean=1, overwrite_a=1)
    if info != 0:
        return None
    pivots = np.diagonal(lower)
    if not pivots.min() > 0.0:
        return None
    p = f.shape[1]
    z = _solve(lower, np.concatenate([f, y], axis=1), lower=True)
    orthonormal = _orthonormal(z[:, :p])
    if orthonormal is None:
        return None
    q, rf = orthonormal
    rest = z[:, p:]
    rest = rest - q @ (q.T @ rest)
    rest -= q @ (q.T @ rest)  # once more: the trend may hold almost all of y
    weights = _solve(lower, rest, lower=True, transposed=True)
    return Factor(
        r=r,
        lower=lower,
        q=q,
        rf=rf,
        residual=rest,
        weights=weights,
        quadratic=np.einsum("ij,ij->j", rest, rest),
        log_det=2.0 * float(np.log(pivots).sum()),
        log_det_trend=2.0 * float(np.log(np.abs(np.diagonal(rf))).sum()),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Likelihood:
    """The likelihood of given runs as a function of a parameter vector.

    Attributes:
        x: (n, d) inputs.   f: (n, p) trend.   y: (n, q) responses.
        correlation: kind and label inputs; its `eta` is used when `eta_free` is False.
        groups: (d,) group of each input; inputs of one group have one theta.
        restricted: eq. (3.13), else the full likelihood.
        nugget: value when it is not free, None when it is.
        noise: (n,) variances in the unit of y squared, or None. Needs a single response.
        work: what `evaluate` and `value` compute in, or None for fresh arrays each time.
        prior: means (g,) of a normal prior of log theta and its standard deviation, or None. `evaluate`, by
            which a search climbs, adds its log density without the constant; `value` is the likelihood alone.
    """

    x: Array
    f: Array
    y: Array
    correlation: Correlation
    groups: NDArray[np.intp]
    restricted: bool = True
    eta_free: bool = False
    nugget: float | None = 0.0
    noise: Array | None = None
    work: Workspace | None = None
    prior: tuple[Array, float] | None = None

    @property
    def n_groups(self) -> int:
        """Number of thetas."""
        return int(self.groups.max()) + 1 if len(self.groups) else 0

    @property
    def names(self) -> list[str]:
        """What each entry of the parameter vector is."""
        more = [
            *(["eta"] if self.eta_free else []),
            *(["nugget"] if self.nugget is None else []),
            *(["sigma2"] if self.noise is not None else []),
        ]
        return [*(f"theta{k}" for k in range(self.n_groups)), *more]

    def subset(self, rows: NDArray[np.intp]) -> "Likelihood":
        """The likelihood of some of the runs."""
        noise = None if self.noise is None else self.noise[rows]
        return replace(self, x=self.x[rows], f=self.f[rows], y=self.y[rows], noise=noise, work=None)

    def unpack(self, vector: Array) -> Parameters:
        """Parameter vector -> theta, eta, nugget, sigma2."""
        at = self.n_groups
        theta = np.exp(vector[:at])[self.groups]
        eta, nugget, sigma2 = self.correlation.eta, self.nugget, None
        if self.eta_free:
            eta, at = float(vector[at]), at + 1
        if nugget is None:
            nugget, at = float(np.exp(vector[at])), at + 1
        if self.noise is not None:
            sigma2 = float(np.exp(vector[at]))
        return Parameters(theta=theta, eta=eta, nugget=nugget, sigma2=sigma2)

    def diagonal(self, parameters: Parameters) -> Array | float:
        """What is added to the diagonal of R."""
        if self.noise is None or parameters.sigma2 is None:
            return parameters.nugget
        return parameters.nugget + self.noise / parameters.sigma2

    def factor(self, parameters: Parameters, work: Workspace | None = None) -> Factor | None:
        """Factor of C at the parameters, in `work` if that is given."""
        correlation = replace(self.correlation, eta=parameters.eta)
        r = correlation.matrix(self.x, parameters.theta, out=None if work is None else work.r)
        lower = None if work is None else work.lower
        return factorise(r, self.diagonal(parameters), self.f, self.y, out=lower)

    def degrees(self) -> int:
        """m: n - p for the restricted likelihood, n for the full one."""
        n, p = self.f.shape
        return int(n - p if self.restricted else n)

    def variances(self, factor: Factor, parameters: Parameters) -> Array:
        """sigma^2 of each response, profiled or given, (q,)."""
        if parameters.sigma2 is not None:
            return np.full(self.y.shape[1], parameters.sigma2)
        return factor.quadratic / self.degrees()

    def value_of(self, factor: Factor, sigma2: Array) -> float:
        """l, summed over the responses."""
        m = self.degrees()
        twice = -m * np.log(sigma2) - factor.log_det - factor.quadratic / sigma2
        if self.restricted:
            twice = twice - factor.log_det_trend
        return float(0.5 * twice.sum())

    def value(self, vector: Array) -> float:
        """l alone; -inf where C has no factor."""
        parameters = self.unpack(vector)
        factor = self.factor(parameters, self.work)
        return -np.inf if factor is None else self.value_of(factor, self.variances(factor, parameters))

    def evaluate(self, vector: Array, with_information: bool = True) -> Evaluation | None:
        """l, its gradient and, if wanted, the average information at a parameter vector."""
        at = self.unpack(vector)
        factor = self.factor(at, self.work)
        if factor is None:
            return None
        sigma2 = self.variances(factor, at)
        if not (np.all(sigma2 > 0.0) and np.all(np.isfinite(sigma2))):
            return None
        w = self._trace_weights(factor, sigma2)
        gradient = np.zeros(len(vector))
        information = np.zeros((len(vector),) * 2)
        for j in range(self.y.shape[1]):
            total, u = self._parameter_derivatives(at, factor, w, factor.weights[:, j], float(sigma2[j]))
            if j == 0:  # W already holds all responses
                gradient = -0.5 * total
            if not with_information:
                break
            h = factor.projected(u)
            a = 0.5 * (h.T @ h) / sigma2[j]
            if self.noise is None:
                # u_0 = C v for log sigma^2: u_0' P u_k = v' u_k and u_0' P u_0 = Q
                b = 0.5 * (factor.weights[:, j] @ u) / sigma2[j]
                a -= np.outer(b, b) / (0.5 * factor.quadratic[j] / sigma2[j])
            information += a
        if self.noise is not None:
            # the explicit part of log sigma^2
            gradient[-1] += -0.5 * (self.degrees() - float(factor.quadratic[0] / sigma2[0]))
        value = self.value_of(factor, sigma2)
        if self.prior is not None:
            mean, deviation = self.prior
            g = self.n_groups
            z = (vector[:g] - mean) / deviation
            value -= 0.5 * float(z @ z)
            gradient[:g] -= z / deviation
            information[np.arange(g), np.arange(g)] += deviation**-2
        return Evaluation(value, gradient, information if with_information else None, sigma2)

    def _trace_weights(self, factor: Factor, sigma2: Array) -> Array:
        """W (n, n) with -2 dl = sum_ij W_ij dC_ij for every symmetric dC.

        W is not symmetric: of C^-1 only a triangle is computed and counted twice, which saves the other.
        """
        n, q = self.y.shape
        half = factor.half_inverse(None if self.work is None else self.work.inverse)
        diagonal = np.diagonal(half).copy()
        taken = factor.weights / np.sqrt(sigma2)
        if self.restricted:
            taken = np.concatenate([taken, np.sqrt(q) * factor.trend_in_runs()], axis=1)
        w = blas.dgemm(-1.0, taken, taken, trans_b=1, beta=2.0 * q, c=half, overwrite_c=1)
        by_rows = np.asarray(w.T)
        by_rows.flat[:: n + 1] -= q * diagonal
        return by_rows

    def _parameter_derivatives(
        self, at: Parameters, factor: Factor, w: Array, v: Array, sigma2: float
    ) -> tuple[Array, Array]:
        """sum W_ij dC_ij/dphi and (dC/dphi) v, the latter dZ/dphi v / sigma^2 for log sigma^2."""
        d = self.x.shape[1]
        correlation = replace(self.correlation, eta=at.eta)
        total, action = correlation.derivatives(self.x, at.theta, r=factor.r, w=w, v=v)
        g = self.n_groups
        if np.array_equal(self.groups, np.arange(d)):
            totals, actions = [total[:d]], [action[:, :d]]
        else:
            tie = np.zeros((d, g))
            tie[np.arange(d), self.groups] = 1.0
            totals, actions = [total[:d] @ tie], [action[:, :d] @ tie]
        if self.eta_free:
            totals.append(total[d:])
            actions.append(action[:, d:])
        if self.nugget is None:
            totals.append(np.array([at.nugget * float(np.trace(w))]))
            actions.append((at.nugget * v)[:, None])
        if self.noise is not None:
            ratio = self.noise / sigma2
            totals.append(np.array([-float(np.diagonal(w) @ ratio)]))
            actions.append((factor.r @ v + at.nugget * v)[:, None])
        return np.concatenate(totals), np.concatenate(actions, axis=1)
