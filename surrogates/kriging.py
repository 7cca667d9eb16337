"""Kriging: a response as a trend plus a stationary process, fitted by restricted or full likelihood.

    y(x) = f(x)' beta + z(x),   cov(z(x), z(x')) = sigma^2 R(x, x'; theta)        eqs. (3.1)-(3.4)

Sacks, Welch, Mitchell and Wynn (1989), Statistical Science 4, 409-435. Patterson and Thompson (1971),
Biometrika 58, 545-554, for the restricted likelihood.
"""

from collections.abc import Hashable, Sequence
from dataclasses import replace
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import lapack
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from .correlation import CORRELATIONS, Correlation
from .diagnosis import Diagnosis, advise, close_pairs, constant_columns, repeated_columns
from .errors import NotPositiveDefinite, TooFewRuns
from .fitting import Search, search
from .likelihood import Factor, Likelihood, Parameters
from .posterior import Posterior, Scaling, TrendBasis
from .trend import TRENDS, TrendFunction, independent, term_name, terms
from .validation import LeaveOneOut, leave_one_out

__all__ = ["Kriging"]

Array = NDArray[np.float64]

AUTOMATIC_NUGGET = 1e-8
NUGGETS = ("auto", "estimate", "ladder")
RUNGS = (1e-2, 1e-4, 1e-6, 1e-8)
DEGENERATE = 1e-11  # residual of the trend relative to the spread of y


class Kriging(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Kriging regressor (Gaussian process with a trend), by default with the restricted likelihood.

    Args:
        criterion: "reml" (eq. 3.13) or "ml".
        trend: "constant", "linear", "interactions" (linear and all products of two inputs), "quadratic"
            (these and the squares), or a function of X (m, d) that returns F (m, p).
        correlation: "gaussian", "power_exponential", "matern32" or "matern52"; see `surrogates.correlation`.
        eta: exponent of the power-exponential correlation in [1, 2], or "free".
        nugget: noise variance of every run relative to sigma^2. A number is used as it is (0 interpolates);
            "auto" is 1e-8, or estimated when runs with equal inputs have different responses; "
            ""estimate" maximises
            the likelihood over it; "ladder" takes the best of 1e-2, 1e-4, 1e-6 and 1e-8.
        theta: fixed values, (d,) or a number, in the coordinates of X: nothing is searched.
        theta_start: (d,) first start of the search, in the coordinates of X (a warm start).
        theta_bounds: (low, high) or (d, 2), in the coordinates of X; by default wide enough for any input.
        n_starts: ascents of the likelihood. With `theta_start`, one or two are usually enough.
        groups: (d,) labels of inputs that share one theta in the box of the runs; None gives each its own.
        categorical: columns that hold labels (numbers or, if X is an object array, strings).
        seed: of the starts. Same seed, same result.

    Attributes:
        theta_: (d,) in the coordinates of X: exp(-theta_k h^2) for the Gaussian correlation.
        eta_: exponent of the power-exponential correlation (2 for the Gaussian one).
        sigma2_: process variance, unit of y squared.   nugget_: relative to sigma2_.
        beta_: (p,) coefficients of `trend_terms_`, in the coordinates of X.
        log_likelihood_: log L of eq. (3.13) without its constant (or of the full likelihood), larger is
            better; inf when the trend reproduces the response exactly.
        diagnosis_: a `Diagnosis`.   n_features_in_: d.

    >>> import numpy as np
    >>> x = np.linspace(0, 1, 8)[:, None]
    >>> kriging = Kriging(correlation="matern52").fit(x, np.sin(6 * x[:, 0]))
    >>> mean, std = kriging.predict([[0.4]], return_std=True)
    >>> print(mean.round(2), bool(abs(mean[0] - np.sin(2.4)) < 3 * std[0]))
    [0.68] True
    """

    def __init__(
        self,
        *,
        criterion: str = "reml",
        trend: str | TrendFunction = "constant",
        correlation: str = "gaussian",
        eta: float | str = "free",
        nugget: float | str = "auto",
        theta: ArrayLike | None = None,
        theta_start: ArrayLike | None = None,
        theta_bounds: ArrayLike | None = None,
        n_starts: int = 5,
        groups: Sequence[Hashable] | None = None,
        categorical: Sequence[int] | None = None,
        seed: int = 0,
    ) -> None:
        self.criterion = criterion
        self.trend = trend
        self.correlation = correlation
        self.eta = eta
        self.nugget = nugget
        self.theta = theta
        self.theta_start = theta_start
        self.theta_bounds = theta_bounds
        self.n_starts = n_starts
        self.groups = groups
        self.categorical = categorical
        self.seed = seed

    # fitting ------------------------------------------------------------------------------------------------

    def fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        *,
        noise: ArrayLike | None = None,
        run_ids: Sequence[Hashable] | None = None,
    ) -> Self:
        """Estimate theta, sigma^2, beta (and eta, nugget) from runs X (n, d) and responses y (n,).

        Args:
            noise: known noise variance of each run, unit of y squared, a number or (n,).
            run_ids: (n,) names of the runs for messages and records; 0, 1, ... by default.

        Raises:
            ValueError: X or y is not usable, or a parameter is not one of the documented values.
            TooFewRuns: one run only, or not more runs than the trend has terms.
            NotPositiveDefinite: two runs are too close for the nugget; the message names them.
        """
        self._check_parameters()
        x, target = self._validated(X, y, run_ids)
        n, d = x.shape
        self._ids = tuple(range(n)) if run_ids is None else tuple(run_ids)
        if len(self._ids) != n:
            raise ValueError(f"run_ids needs one entry per run, got {len(self._ids)} for {n} runs")
        if n < 2:
            raise TooFewRuns(f"kriging needs at least 2 runs, got n_samples = {n}: add runs")
        labels = tuple(sorted({int(k) % d for k in self.categorical or ()}))
        self._scaling = _box(x, labels)
        u = self._scaling(x)
        self._trend, f, back = self._trend_basis(u, x, labels)
        if n <= f.shape[1]:
            raise TooFewRuns(
                f"trend {self._trend_name()} has {f.shape[1]} terms and needs at least "
                f"{f.shape[1] + 1} runs, got "
                f"{n}: choose a smaller trend (constant, linear) or add runs"
            )
        self._observed = target
        self._shift, self._scale = self._standardise(target)
        z = ((target - self._shift) / self._scale)[:, None]
        equal, nearly = close_pairs(u)
        unequal = [(i, j) for i, j in equal if target[i] != target[j]]
        likelihood = self._likelihood(u, f, z, labels, noise, bool(unequal))
        residual = z - f @ np.linalg.lstsq(f, z, rcond=None)[0]
        degenerate = bool(np.abs(residual).max() <= DEGENERATE * max(1.0, float(np.abs(z).max())))
        found, parameters, likelihood = self._estimate(likelihood, degenerate, u)
        factor = likelihood.factor(parameters)
        if factor is None:
            raise self._not_positive_definite(u, parameters.nugget)
        self._store(likelihood, parameters, factor, back, degenerate)
        loo = self.leave_one_out()
        pairs = self._named
        self.diagnosis_ = _with_advice(
            Diagnosis(
                n_runs=n,
                n_inputs=d,
                n_trend_terms=f.shape[1],
                condition_number=_condition(factor, likelihood.diagonal(parameters)),
                duplicates=pairs(equal),
                unequal_duplicates=pairs(unequal),
                near_duplicates=pairs(nearly),
                constant_inputs=constant_columns(u),
                repeated_inputs=repeated_columns(u),
                dropped_trend_terms=self._dropped,
                nugget=self.nugget_,
                nugget_estimated=likelihood.nugget is None or self.nugget == "ladder",
                at_lower_bound=() if found is None else _inputs(likelihood, found.at_lower),
                at_upper_bound=() if found is None else _inputs(likelihood, found.at_upper),
                n_starts=0 if found is None else found.n_starts,
                n_starts_agreeing=0 if found is None else found.n_agree,
                gap_to_second=float("nan") if found is None else found.gap,
                evaluations=0 if found is None else found.evaluations,
                converged=found is None or found.converged,
                q2=loo.q2,
                coverage95=loo.coverage95,
                degenerate=degenerate,
            )
        )
        return self

    def _check_parameters(self) -> None:
        if self.criterion not in ("reml", "ml"):
            raise ValueError(f"criterion needs 'reml' or 'ml', got {self.criterion!r}")
        if self.correlation not in CORRELATIONS:
            raise ValueError(f"correlation needs one of {', '.join(CORRELATIONS)}, got {self.correlation!r}")
        if not callable(self.trend) and self.trend not in TRENDS:
            raise ValueError(f"trend needs one of {', '.join(TRENDS)} or a function of X, got {self.trend!r}")
        if isinstance(self.nugget, str):
            if self.nugget not in NUGGETS:
                raise ValueError(f"nugget needs a number or one of {', '.join(NUGGETS)}, got {self.nugget!r}")
        elif not 0.0 <= self.nugget < np.inf:
            raise ValueError(f"nugget needs a number >= 0, got {self.nugget}")
        if isinstance(self.eta, str):
            if self.eta != "free":
                raise ValueError(f"eta needs a number in [1, 2] or 'free', got {self.eta!r}")
        elif not 1.0 <= self.eta <= 2.0:
            raise ValueError(f"eta needs a number in [1, 2] or 'free', got {self.eta}")
        if self.n_starts < 1:
            raise ValueError(f"n_starts needs a whole number >= 1, got {self.n_starts}")

    def _validated(
        self, X: ArrayLike, y: ArrayLike, run_ids: Sequence[Hashable] | None
    ) -> tuple[Array, Array]:
        self._levels: dict[int, dict[Any, float]] = {}
        if self.categorical is not None:
            X = self._encode(X, learn=True)
        x, target = validate_data(
            self, X, y, dtype=np.float64, order="C", y_numeric=True, ensure_all_finite=False
        )
        names = range(len(x)) if run_ids is None else run_ids
        for name, values in (("X", x), ("y", np.asarray(target, dtype=np.float64)[:, None])):
            bad = np.argwhere(~np.isfinite(values))
            if len(bad):
                i, k = bad[0]
                what = "NaN" if np.isnan(values[i, k]) else "infinity"
                where = f" in column {k}" if name == "X" else ""
                rows = len(set(bad[:, 0].tolist()))
                raise ValueError(
                    f"{name} holds {what} in run {list(names)[i]}{where} ({rows} of {len(values)} "
                    f"runs are not "
                    "finite): leave failed runs out"
                )
        return x, np.asarray(target, dtype=np.float64)

    def _encode(self, X: ArrayLike, *, learn: bool) -> NDArray[Any]:
        """Codes in place of the labels of categorical columns; a label never seen gets a code of its own."""
        table: NDArray[Any] = np.array(X, dtype=object, copy=True)
        if table.ndim != 2:
            return np.asarray(X)
        for k in self.categorical or ():
            if not -table.shape[1] <= k < table.shape[1]:
                raise ValueError(f"categorical needs columns below {table.shape[1]}, got {k}")
            if learn:
                found = sorted(set(table[:, k].tolist()), key=lambda label: (str(type(label)), label))
                self._levels[k] = {label: float(code) for code, label in enumerate(found)}
            codes = self._levels[k]
            unseen = {
                label: -1.0 - i for i, label in enumerate(dict.fromkeys(table[:, k])) if label not in codes
            }
            table[:, k] = [codes.get(label, unseen.get(label)) for label in table[:, k]]
        text = [
            (i, k) for k in range(table.shape[1]) for i in range(len(table)) if isinstance(table[i, k], str)
        ]
        if text:
            i, k = text[0]
            raise ValueError(
                f"column {k} holds text ({table[i, k]!r} in row {i}): name it in categorical=[{k}] "
                f"or encode it"
            )
        return table

    def _trend_name(self) -> str:
        return (
            repr(self.trend) if isinstance(self.trend, str) else getattr(self.trend, "__name__", "function")
        )

    def _trend_basis(self, u: Array, x: Array, labels: tuple[int, ...]) -> tuple[TrendBasis, Array, Array]:
        """The basis, F at the runs, and M with F(in the coordinates of X) = F M."""
        if callable(self.trend):
            raw = np.asarray(self.trend(x), dtype=np.float64)
            if raw.ndim != 2 or len(raw) != len(x):
                raise ValueError(
                    f"trend function needs to return an array ({len(x)}, p), got shape {raw.shape}"
                )
            if not np.isfinite(raw).all():
                raise ValueError("trend function returns values that are not finite at the runs")
            kept = independent(raw)
            size = np.linalg.norm(raw[:, kept], axis=0) / np.sqrt(len(raw))
            trend = TrendBasis(function=self.trend, columns=tuple(kept), size=size)
            self._dropped = tuple(f"column {k}" for k in range(raw.shape[1]) if k not in kept)
            self.trend_terms_ = [f"f{k}" for k in kept]
            return trend, trend(u, x), np.diag(size)
        all_terms = terms(self.trend, u.shape[1], labels=labels)
        wide = TrendBasis(terms=tuple(all_terms))
        f = wide(u, x)
        kept = list(range(f.shape[1])) if self.trend == "constant" else independent(f)
        self._dropped = tuple(
            term_name(t) for k, t in enumerate(all_terms) if k not in kept and len(f) > len(kept)
        )
        chosen = tuple(all_terms[k] for k in kept)
        if len(all_terms) >= len(f):
            chosen, kept = tuple(all_terms), list(range(len(all_terms)))  # too few runs: said by the caller
        self.trend_terms_ = [term_name(t) for t in chosen]
        back = np.eye(1)
        if len(chosen) > 1 and len(chosen) < len(f):
            back = _change_of_basis(f[:, kept], TrendBasis(terms=chosen)(x, x))
        return TrendBasis(terms=chosen), f[:, kept], back

    def _standardise(self, y: Array) -> tuple[float, float]:
        shift = 0.0 if callable(self.trend) else float(y.mean())
        scale = float(np.sqrt(np.mean((y - shift) ** 2)))
        if scale <= 1e-14 * float(np.abs(y).max()) or scale == 0.0:
            return shift, max(float(np.abs(y).max()), 1.0) if np.abs(y).max() == 0.0 else float(
                np.abs(y).max()
            )
        return shift, scale

    def _likelihood(
        self, u: Array, f: Array, z: Array, labels: tuple[int, ...], noise: ArrayLike | None, replicated: bool
    ) -> Likelihood:
        n, d = u.shape
        groups = np.arange(d)
        if self.groups is not None:
            if len(self.groups) != d:
                raise ValueError(f"groups needs one label per input, got {len(self.groups)} for {d} inputs")
            first = {label: i for i, label in enumerate(dict.fromkeys(self.groups))}
            groups = np.array([first[label] for label in self.groups])
        variances = None
        if noise is not None:
            variances = np.broadcast_to(np.asarray(noise, dtype=np.float64), (n,)) / self._scale**2
            if not (np.isfinite(variances).all() and (variances >= 0.0).all()):
                raise ValueError("noise needs variances >= 0, one number or one per run")
        nugget: float | None
        if isinstance(self.nugget, str):
            free = self.nugget == "estimate" or (self.nugget == "auto" and replicated and noise is None)
            nugget = None if free else AUTOMATIC_NUGGET
        else:
            nugget = float(self.nugget)
        eta_free = self.correlation == "power_exponential" and self.eta == "free"
        eta = 2.0 if self.correlation != "power_exponential" or isinstance(self.eta, str) else float(self.eta)
        return Likelihood(
            x=u,
            f=f,
            y=z,
            correlation=Correlation(kind=self.correlation, eta=1.9 if eta_free else eta, labels=labels),
            groups=groups,
            restricted=self.criterion == "reml",
            eta_free=eta_free,
            nugget=nugget,
            noise=variances,
        )

    def _estimate(
        self, likelihood: Likelihood, degenerate: bool, u: Array
    ) -> tuple[Search | None, Parameters, Likelihood]:
        d = u.shape[1]
        per_theta = _theta_units(self._scaling, likelihood.correlation)
        if self.theta is not None:
            theta = _per_input("theta", self.theta, d) * per_theta
            nugget = AUTOMATIC_NUGGET if likelihood.nugget is None else likelihood.nugget
            if likelihood.nugget is None or likelihood.noise is not None or likelihood.eta_free:
                return self._with_theta_fixed(likelihood, theta, degenerate)
            eta = likelihood.correlation.eta
            return None, Parameters(theta=theta, eta=eta, nugget=nugget), likelihood
        if degenerate:
            theta = np.full(d, np.exp(-12.0))
            fixed = replace(
                likelihood, nugget=AUTOMATIC_NUGGET if likelihood.nugget is None else likelihood.nugget
            )
            return None, self._plain(fixed, theta), fixed
        warm = None
        if self.theta_start is not None:
            start = np.log(np.maximum(_per_input("theta_start", self.theta_start, d) * per_theta, 1e-300))
            warm = np.array([start[likelihood.groups == g].mean() for g in range(likelihood.n_groups)])
        limits = self._limits(likelihood, per_theta)
        rungs: list[Likelihood] = [likelihood]
        if self.nugget == "ladder":
            rungs = [replace(likelihood, nugget=rung) for rung in RUNGS]
        best: tuple[Search, Likelihood] | None = None
        for rung in rungs:
            rng = np.random.default_rng(self.seed)
            found = search(rung, n_starts=self.n_starts, theta_bounds=limits, warm=warm, rng=rng)
            if found is not None and (best is None or found.value > best[0].value):
                best = found, rung
        if best is None:
            raise self._not_positive_definite(u, likelihood.nugget or 0.0)
        return best[0], best[1].unpack(best[0].vector), best[1]

    def _with_theta_fixed(
        self, likelihood: Likelihood, theta: Array, degenerate: bool
    ) -> tuple[Search | None, Parameters, Likelihood]:
        """Nugget, eta and sigma^2 may still be free when theta is given: bounds of zero width hold it."""
        if degenerate:
            fixed = replace(
                likelihood, nugget=AUTOMATIC_NUGGET if likelihood.nugget is None else likelihood.nugget
            )
            return None, self._plain(fixed, theta), fixed
        own = replace(likelihood, groups=np.arange(len(theta)))
        limits = np.column_stack([theta, theta]).clip(1e-300)
        rng = np.random.default_rng(self.seed)
        found = search(own, n_starts=self.n_starts, theta_bounds=limits, warm=None, rng=rng)
        if found is None:
            raise self._not_positive_definite(own.x, own.nugget or 0.0)
        return found, own.unpack(found.vector), own

    def _plain(self, likelihood: Likelihood, theta: Array) -> Parameters:
        nugget = 0.0 if likelihood.nugget is None else max(likelihood.nugget, AUTOMATIC_NUGGET)
        sigma2 = None if likelihood.noise is None else 1e-6
        return Parameters(theta=theta, eta=likelihood.correlation.eta, nugget=nugget, sigma2=sigma2)

    def _limits(self, likelihood: Likelihood, per_theta: Array) -> Array | None:
        if self.theta_bounds is None:
            return None
        d = len(per_theta)
        given = np.asarray(self.theta_bounds, dtype=np.float64)
        if given.shape not in ((2,), (d, 2)):
            raise ValueError(f"theta_bounds needs (low, high) or shape ({d}, 2), got shape {given.shape}")
        limits = np.broadcast_to(given, (d, 2)) * per_theta[:, None]
        if not (
            np.isfinite(limits).all() and (limits[:, 0] > 0).all() and (limits[:, 0] <= limits[:, 1]).all()
        ):
            raise ValueError(f"theta_bounds needs 0 < low <= high, got {given.tolist()}")
        members = [limits[likelihood.groups == g] for g in range(likelihood.n_groups)]
        return np.array([[m[:, 0].min(), m[:, 1].max()] for m in members])

    def _not_positive_definite(self, u: Array, nugget: float) -> NotPositiveDefinite:
        i, j, distance = _closest(u)
        a, b = self._ids[i], self._ids[j]
        return NotPositiveDefinite(
            f"correlation matrix is not positive definite: runs {a} and {b} are {distance:.1g} "
            f"apart in the box of "
            f"the runs. Remove one, or set nugget={max(100 * nugget, 1e-8):.0e}"
        )

    def _store(
        self, likelihood: Likelihood, parameters: Parameters, factor: Factor, back: Array, degenerate: bool
    ) -> None:
        sigma2 = 0.0 if degenerate else float(likelihood.variances(factor, parameters)[0])
        coefficients = factor.coefficients(likelihood.y)[:, 0]
        self._diagonal = likelihood.diagonal(parameters)
        self.posterior_ = Posterior(
            scaling=self._scaling,
            trend=self._trend,
            u=likelihood.x,
            f=likelihood.f,
            correlation=replace(likelihood.correlation, eta=parameters.eta),
            theta=parameters.theta,
            factor=factor,
            coefficients=coefficients,
            weights=factor.weights[:, 0],
            sigma2=sigma2,
            shift=self._shift,
            scale=self._scale,
        )
        self.theta_ = parameters.theta / _theta_units(self._scaling, self.posterior_.correlation)
        self.eta_ = parameters.eta
        self.nugget_ = parameters.nugget
        self.sigma2_ = self._scale**2 * sigma2
        self.beta_ = self._scale * np.linalg.solve(back, coefficients)
        if not callable(self.trend):
            self.beta_[0] += self._shift
        if degenerate:
            self.log_likelihood_ = float("inf")
        else:
            value = likelihood.value_of(factor, np.array([sigma2]))
            value -= likelihood.degrees() * np.log(self._scale)
            if likelihood.restricted:
                value -= float(np.linalg.slogdet(back)[1])
            self.log_likelihood_ = float(value)

    def _named(self, pairs: list[tuple[int, int]]) -> tuple[tuple[Hashable, Hashable], ...]:
        return tuple((self._ids[i], self._ids[j]) for i, j in pairs)

    # using --------------------------------------------------------------------------------------------------

    def _points(self, X: ArrayLike) -> Array:
        check_is_fitted(self)
        if self._levels:
            X = self._encode(X, learn=False)
        return np.asarray(validate_data(self, X, reset=False, dtype=np.float64, order="C"))

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Best linear unbiased prediction at X (m, d): mean (m,), with `return_std` also std (m,).

        The deviation is that of the process, including what estimating the trend costs and without the noise
        of a new run. It is zero at the runs when there is no nugget.
        """
        points = self._points(X)
        return self.posterior_.mean_and_std(points) if return_std else self.posterior_.mean(points)

    def predict_covariance(self, X: ArrayLike) -> tuple[Array, Array]:
        """Mean (m,) and joint covariance (m, m) of the process at X."""
        return self.posterior_.covariance(self._points(X))

    def predict_gradient(self, X: ArrayLike) -> tuple[Array, Array]:
        """Gradients of the mean and of the variance (std squared) in x at X, each (m, d)."""
        return self.posterior_.slopes(self._points(X))

    def sample_posterior(self, X: ArrayLike, draws: int, *, rng: np.random.Generator) -> Array:
        """Joint draws of the process at X given the runs (conditional simulation), (draws, m)."""
        mean, covariance = self.posterior_.covariance(self._points(X))
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(mean + rng.standard_normal((draws, len(mean))) @ root.T)

    def leave_one_out(self) -> LeaveOneOut:
        """Every run predicted from the others at fixed theta, sigma^2 and nugget, in closed form."""
        check_is_fitted(self, "posterior_")
        factor, scale = self.posterior_.factor, self._scale
        inverse = factor.inverse_diagonal()
        g = factor.trend_in_runs()
        diagonal = inverse - np.einsum("ij,ij->i", g, g)
        # a run that alone carries a trend term has P_ii = 0: the others cannot predict it
        lone = diagonal <= 1e-10 * inverse
        safe = np.where(lone, 1.0, diagonal)
        error = scale * np.where(lone, 0.0, self.posterior_.weights / safe)
        std = scale * np.where(lone, np.inf, np.sqrt(self.posterior_.sigma2 / safe))
        return leave_one_out(self._observed.copy(), error, std, run_ids=self._ids)


def _box(x: Array, labels: tuple[int, ...]) -> Scaling:
    low, width = x.min(axis=0), np.ptp(x, axis=0)
    width = np.where(width > 0.0, width, 1.0)
    low[list(labels)], width[list(labels)] = -0.5, 1.0
    return Scaling(low=low, width=width)


def _theta_units(scaling: Scaling, correlation: Correlation) -> Array:
    """theta in the box of width 1 divided by theta in the coordinates of X."""
    power = correlation.eta if correlation.kind == "power_exponential" else 2.0
    return scaling.width**power


def _per_input(name: str, value: ArrayLike, d: int) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (d,)) or not np.isfinite(array).all() or (array < 0.0).any():
        raise ValueError(f"{name} needs {d} finite numbers >= 0, got {np.asarray(value).tolist()}")
    return np.broadcast_to(array, (d,)).copy()


def _change_of_basis(scaled: Array, raw: Array) -> Array:
    """M with raw = scaled M, columns of raw brought to one size first."""
    size = np.linalg.norm(raw, axis=0)
    return np.asarray(np.linalg.lstsq(scaled, raw / size, rcond=None)[0] * size)


def _closest(u: Array) -> tuple[int, int, float]:
    best = (0, 1, np.inf)
    for i in range(len(u) - 1):
        distance = np.sqrt(((u[i + 1 :] - u[i]) ** 2).sum(axis=1))
        j = int(distance.argmin())
        if distance[j] < best[2]:
            best = (i, i + 1 + j, float(distance[j]))
    return best


def _condition(factor: Factor, diagonal: Array | float) -> float:
    """1-norm condition number of C from its factor (LAPACK's estimate)."""
    size = float((np.abs(factor.r).sum(axis=0) + diagonal).max())
    reciprocal, info = lapack.dpocon(factor.lower, size, uplo="L")
    return float(1.0 / reciprocal) if info == 0 and reciprocal > 0.0 else float("inf")


def _inputs(likelihood: Likelihood, at: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(at[: likelihood.n_groups][likelihood.groups]))


def _with_advice(diagnosis: Diagnosis) -> Diagnosis:
    return replace(diagnosis, advice=advise(diagnosis))
