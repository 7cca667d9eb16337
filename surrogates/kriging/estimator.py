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

from ..likelihood.likelihood import Factor, Likelihood
from .calibration import interval_factor
from .diagnosis import (
    Diagnosis,
    advise,
    close_pairs,
    constant_columns,
    repeated_columns,
)
from .estimation import (
    Estimate,
    check_choices,
    estimate,
    likelihood_of,
    theta_units,
)
from .given_runs import (
    LabelCodes,
    check_finite,
    check_response,
    refuse_text,
)
from .posterior import Posterior
from .runs import Runs, not_positive_definite, prepare
from .trend import TRENDS, TrendFunction
from .validation import LeaveOneOut, leave_one_out

__all__ = ["Kriging"]

Array = NDArray[np.float64]


class Kriging(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Kriging regressor (Gaussian process with a trend), by default with the restricted likelihood.

    Args:
        criterion: "reml" (eq. 3.13) or "ml".
        trend: "constant", "linear", "interactions" (linear and all products of two inputs), "quadratic"
            (these and the squares), or a function of X (m, d) that returns F (m, p).
        correlation: "gaussian", "power_exponential", "matern32" or "matern52"; see
            `surrogates.likelihood.correlation`.
        eta: exponent of the power-exponential correlation in [1, 2], or "free".
        nugget: noise variance of every run relative to sigma^2. A number is used as it is (0 interpolates);
            "auto" is 1e-8, or estimated when (nearly) equal inputs have different responses; "estimate"
            maximises the likelihood over it; "ladder" starts that from the best of 1e-2, 1e-4, 1e-6 and 1e-8
            and goes no lower.
        theta: fixed values, (d,) or a number, in the coordinates of X: nothing is searched.
        theta_start: (d,) first start of the search, in the coordinates of X (a warm start).
        theta_bounds: (low, high) or (d, 2), in the coordinates of X; by default wide enough for any input.
        theta_prior: (median, deviation of log theta) of a lognormal prior of every theta, in the coordinates
            of X; theta is then the mode of the posterior density of log theta. With hardly more runs than
            inputs the likelihood alone often ends at inert inputs. None: no prior.
        n_starts: ascents of the likelihood; None is 1.5 per input, at least 5 and at most 30, and 8 above
            250 runs, where the surface is simpler. With `theta_start`, one or two are usually enough.
        groups: (d,) labels of inputs that share one theta in the box of the runs; None gives each its own.
        categorical: columns that hold labels (numbers or, if X is an object array, strings).
        calibration: "none" gives plug-in deviations of the process, which take theta as known;
            "cross_validation" gives those of a new run, nugget included, scaled by a factor from twenty
            refits (see `surrogates.kriging.calibration`), so that mean +- 1.96 std holds what it says.
        seed: of the starts. Same seed, same result.

    Attributes:
        theta_: (d,) in the coordinates of X: exp(-theta_k h^2) for the Gaussian correlation. 0 for an input
            that never changes, unless `theta` is given: the runs say nothing about it.
        eta_: exponent of the power-exponential correlation (2 for the Gaussian one).
        sigma2_: process variance, unit of y squared.   nugget_: relative to sigma2_.
        beta_: (p,) coefficients of `trend_terms_`, in the coordinates of X.
        log_likelihood_: log L of eq. (3.13) without its constant (or of the full likelihood), larger is
            better; inf when the trend reproduces the response exactly.
        diagnosis_: a `Diagnosis`.   n_features_in_: d.
        interval_factor_: what `calibration` multiplies the standard deviations by; 1.0 without. sigma2_ and
            nugget_ are those of the likelihood, not scaled.

    >>> import numpy as np
    >>> x = np.linspace(0, 1, 8)[:, None]
    >>> kriging = Kriging(correlation="matern52").fit(x, np.sin(6 * x[:, 0]))
    >>> mean, std = kriging.predict([[0.4]], return_std=True)
    >>> print(mean.round(2), bool(abs(mean[0] - np.sin(2.4)) < 3 * std[0]))
    [0.68] True
    """

    posterior_: Posterior
    diagnosis_: Diagnosis

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
        theta_prior: tuple[float, float] | None = None,
        n_starts: int | None = None,
        groups: Sequence[Hashable] | None = None,
        categorical: Sequence[int] | None = None,
        calibration: str = "none",
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
        self.theta_prior = theta_prior
        self.n_starts = n_starts
        self.groups = groups
        self.categorical = categorical
        self.calibration = calibration
        self.seed = seed

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
        runs = self._prepared(X, y, run_ids)
        likelihood = self._likelihood(runs, noise)
        self._finish(runs, self._estimated(runs, likelihood))
        if self.calibration == "cross_validation":
            variances = likelihood.noise
            self._scale_intervals(
                interval_factor(self, runs, noise=None if variances is None else variances * runs.scale**2)
            )
        return self

    def _scale_intervals(self, factor: float) -> None:
        self.interval_factor_ = factor
        self.posterior_ = self.posterior_.calibrated(factor, nugget=self.nugget_)
        coverage = self.leave_one_out().coverage95
        self.diagnosis_ = replace(self.diagnosis_, interval_factor=factor, coverage95=coverage)

    def _prepared(self, X: ArrayLike, y: ArrayLike, run_ids: Sequence[Hashable] | None) -> Runs:
        check_choices(
            criterion=self.criterion, correlation=self.correlation, eta=self.eta, nugget=self.nugget
        )
        if not callable(self.trend) and self.trend not in TRENDS:
            raise ValueError(f"trend needs one of {', '.join(TRENDS)} or a function of X, got {self.trend!r}")
        if self.calibration not in ("none", "cross_validation"):
            raise ValueError(f"calibration needs 'none' or 'cross_validation', got {self.calibration!r}")
        self._codes = None if self.categorical is None else LabelCodes(self.categorical, X)
        if self._codes is not None:
            X = self._codes(X)
        else:
            refuse_text(X)
        shape = np.asarray(X).shape
        if len(shape) == 2 and shape[1] == 0:  # scikit-learn's words, and the cure
            raise ValueError(
                f"Found array with 0 feature(s) (shape={shape}) while a minimum of 1 is required. Behind a "
                "screener this means that it selected no input: read its diagnosis_.advice, or set its "
                "n_features"
            )
        check_response(y, None if run_ids is None else _names(run_ids, len(np.asarray(y))))
        x, target = validate_data(
            self,
            X,
            y,
            dtype=np.float64,
            order="C",
            y_numeric=True,
            ensure_all_finite=False,
            ensure_min_samples=0,
        )
        n, d = x.shape
        ids = _names(run_ids, n)
        target = np.asarray(target, dtype=np.float64)
        check_finite(x, target, ids)
        labels = tuple(sorted({int(k) % d for k in self.categorical or ()}))
        return prepare(x, target, trend=self.trend, labels=labels, ids=ids)

    def _likelihood(self, runs: Runs, noise: ArrayLike | None) -> Likelihood:
        equal, nearly = close_pairs(runs.u)
        y, jump = runs.observed, 1e-3 * runs.scale  # between runs 1e-6 apart: no smooth response does that
        replicated = any(y[i] != y[j] for i, j in equal) or any(abs(y[i] - y[j]) > jump for i, j in nearly)
        return likelihood_of(
            runs,
            criterion=self.criterion,
            correlation=self.correlation,
            eta=self.eta,
            nugget=self.nugget,
            noise=noise,
            groups=self.groups,
            replicated=replicated,
        )

    def _estimated(self, runs: Runs, likelihood: Likelihood) -> Estimate:
        return estimate(
            runs,
            likelihood,
            ladder=self.nugget == "ladder",
            theta=self.theta,
            theta_start=self.theta_start,
            theta_bounds=self.theta_bounds,
            theta_prior=self.theta_prior,
            n_starts=self.n_starts,
            seed=self.seed,
        )

    def _finish(self, runs: Runs, found: Estimate, factor: Factor | None = None) -> Self:
        """Set the fitted attributes; `factor` may come from a fit with the same theta."""
        likelihood, parameters = found.likelihood, found.parameters
        if factor is None:
            factor = likelihood.factor(parameters)
        if factor is None:
            raise not_positive_definite(runs, parameters.nugget)
        sigma2 = 0.0 if runs.degenerate else float(likelihood.variances(factor, parameters)[0])
        coefficients = factor.coefficients(runs.z)[:, 0]
        self._runs = runs
        self._diagonal = likelihood.diagonal(parameters)
        self.posterior_ = Posterior(
            scaling=runs.scaling,
            trend=runs.trend,
            u=runs.u,
            f=runs.f,
            correlation=replace(likelihood.correlation, eta=parameters.eta),
            theta=parameters.theta,
            factor=factor,
            coefficients=coefficients,
            weights=factor.weights[:, 0],
            sigma2=sigma2,
            shift=runs.shift,
            scale=runs.scale,
        )
        self.theta_ = parameters.theta / theta_units(runs.scaling, self.posterior_.correlation)
        self.eta_ = parameters.eta
        self.nugget_ = parameters.nugget
        self.sigma2_ = runs.scale**2 * sigma2
        self.trend_terms_ = list(runs.term_names)
        self.beta_ = runs.scale * np.linalg.solve(runs.back, coefficients)
        if runs.trend.function is None:
            self.beta_[0] += runs.shift
        self.log_likelihood_ = float("inf")
        if not runs.degenerate:
            value = likelihood.value_of(factor, np.array([sigma2]))
            value -= likelihood.degrees() * np.log(runs.scale)
            if likelihood.restricted:
                value -= float(np.linalg.slogdet(runs.back)[1])
            self.log_likelihood_ = float(value)
        self.interval_factor_ = 1.0
        self.diagnosis_ = self._diagnosed(found)
        return self

    def _diagnosed(self, found: Estimate) -> Diagnosis:
        runs, likelihood, search = self._runs, found.likelihood, found.search
        equal, nearly = close_pairs(runs.u)
        unequal = [(i, j) for i, j in equal if runs.observed[i] != runs.observed[j]]
        loo = self.leave_one_out()
        diagnosis = Diagnosis(
            n_runs=len(runs.u),
            n_inputs=runs.u.shape[1],
            n_trend_terms=runs.f.shape[1],
            condition_number=_condition(self.posterior_.factor, self._diagonal),
            duplicates=_named(runs, equal),
            unequal_duplicates=_named(runs, unequal),
            near_duplicates=_named(runs, nearly),
            constant_inputs=constant_columns(runs.u),
            repeated_inputs=repeated_columns(runs.u),
            dropped_trend_terms=runs.dropped,
            nugget=self.nugget_,
            nugget_estimated=likelihood.nugget is None or self.nugget == "ladder",
            at_lower_bound=() if search is None else _inputs(likelihood, search.at_lower),
            at_upper_bound=() if search is None else _inputs(likelihood, search.at_upper),
            n_starts=0 if search is None else search.n_starts,
            n_starts_agreeing=0 if search is None else search.n_agree,
            gap_to_second=float("nan") if search is None else search.gap,
            evaluations=0 if search is None else search.evaluations,
            converged=search is None or search.converged,
            q2=loo.q2,
            coverage95=loo.coverage95,
            degenerate=runs.degenerate,
        )
        return replace(diagnosis, advice=advise(diagnosis))

    def _points(self, X: ArrayLike) -> Array:
        check_is_fitted(self)
        if self._codes is not None:
            X = self._codes(X)
        else:
            refuse_text(X)
        return np.asarray(validate_data(self, X, reset=False, dtype=np.float64, order="C"))

    def predict(self, X: ArrayLike, return_std: bool = False) -> Any:
        """Best linear unbiased prediction at X (m, d): mean (m,), with `return_std` also std (m,).

        The deviation is that of the process, including what estimating the trend costs and without the noise
        of a new run. It is zero at the runs when there is no nugget. With calibration="cross_validation" it
        is that of a new run, by the nugget wider; noise that was given run by run is not in it.
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
        factor, scale = self.posterior_.factor, self._runs.scale
        inverse = factor.inverse_diagonal()
        g = factor.trend_in_runs()
        diagonal = inverse - np.einsum("ij,ij->i", g, g)
        # a run that alone carries a trend term has P_ii = 0: the others cannot predict it
        lone = diagonal <= 1e-10 * inverse
        safe = np.where(lone, 1.0, diagonal)
        error = scale * np.where(lone, 0.0, self.posterior_.weights / safe)
        std = scale * np.where(lone, np.inf, np.sqrt(self.posterior_.sigma2 / safe))
        return leave_one_out(self._runs.observed.copy(), error, std, run_ids=self._runs.ids)


def _condition(factor: Factor, diagonal: Array | float) -> float:
    """1-norm condition number of C from its factor (LAPACK's estimate)."""
    size = float((np.abs(factor.r).sum(axis=0) + diagonal).max())
    reciprocal, info = lapack.dpocon(factor.lower, size, uplo="L")
    return float(1.0 / reciprocal) if info == 0 and reciprocal > 0.0 else float("inf")


def _inputs(likelihood: Likelihood, at: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(at[: likelihood.n_groups][likelihood.groups]))


def _names(run_ids: Sequence[Hashable] | None, n: int) -> tuple[Hashable, ...]:
    if run_ids is None:
        return tuple(range(n))
    if len(run_ids) != n:
        raise ValueError(f"run_ids needs one entry per run, got {len(run_ids)} for {n} runs")
    return tuple(run_ids)


def _named(runs: Runs, pairs: list[tuple[int, int]]) -> tuple[tuple[Hashable, Hashable], ...]:
    return tuple((runs.ids[i], runs.ids[j]) for i, j in pairs)
