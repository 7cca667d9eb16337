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
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from ..likelihood.likelihood import Factor, Likelihood
from .calibration import MOST_REFITS, conformal_factor_of, interval_factor
from .diagnosis import Diagnosis, close_pairs
from .estimation import Estimate, check_choices, estimate, likelihood_of
from .fitted import Fitted, diagnosed, finished
from .form_choice import AUTO, Form, FormScore, choose_form
from .given_runs import (
    LabelCodes,
    check_finite,
    check_response,
    refuse_text,
    run_names,
)
from .posterior import Posterior
from .runs import Runs, prepare
from .trend import TRENDS, TrendFunction
from .validation import LeaveOneOut, left_out

__all__ = ["Kriging"]

INTERVALS = ("calibrated", "plug-in")

Array = NDArray[np.float64]


class Kriging(RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Kriging regressor (Gaussian process with a trend), by default with the restricted likelihood.

    Args:
        criterion: "reml" (eq. 3.13) or "ml".
        trend: "constant", "linear", "interactions" (linear and all products of two inputs), "quadratic"
            (these and the squares), or a function of X (m, d) that returns F (m, p). "auto": constant or
            linear, by leave-one-out (see `surrogates.kriging.form_choice`); `trend_` says which.
        correlation: "gaussian", "power_exponential", "matern32", "matern52" or "matern72"; see
            `surrogates.likelihood.correlation`. "auto": Gaussian, Matern 5/2 or 7/2, by the likelihood;
            `correlation_` says which. With `theta` given, which belongs to a correlation, "auto" is Gaussian
            and constant.
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
        intervals: "calibrated" deviations are those of a new run, nugget included, scaled by a factor from
            refits without some of the runs (see `surrogates.kriging.calibration`), so that mean +- 1.96 std
            holds what it says; "plug-in" ones are those of the process and take theta as known, mostly too
            narrow, and cost no refits.
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
        correlation_, trend_: the ones used.   forms_: a `FormScore` of each that was tried, () if none was.
        interval_factor_: what the standard deviations are multiplied by; 1.0 for plug-in ones. sigma2_ and
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
    correlation_: str
    trend_: str | TrendFunction
    forms_: tuple[FormScore, ...]

    def __init__(
        self,
        *,
        criterion: str = "reml",
        trend: str | TrendFunction = AUTO,
        correlation: str = AUTO,
        eta: float | str = "free",
        nugget: float | str = "auto",
        theta: ArrayLike | None = None,
        theta_start: ArrayLike | None = None,
        theta_bounds: ArrayLike | None = None,
        theta_prior: tuple[float, float] | None = None,
        n_starts: int | None = None,
        groups: Sequence[Hashable] | None = None,
        categorical: Sequence[int] | None = None,
        intervals: str = "calibrated",
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
        self.intervals = intervals
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
        self._check_parameters()
        x, target, ids = self._given(X, y, run_ids)

        def attempt(form: Form, rows: slice | NDArray[np.intp], **starts: Any) -> Fitted:
            runs = self._box(x[rows], target[rows], tuple(np.array(ids, dtype=object)[rows]), form.trend)
            variances = None if noise is None else np.asarray(noise)
            if variances is not None and variances.shape == (len(x),):
                variances = variances[rows]
            likelihood = self._likelihood(runs, variances, form.correlation)
            return finished(runs, self._estimated(runs, likelihood, **starts))

        form = Form(correlation=self.correlation, trend=self.trend)
        best, self.forms_ = choose_form(form, attempt, x, target, theta_given=self.theta is not None)
        self._set(best.fitted, best.form)
        if self.intervals == "calibrated":
            self._scale_intervals(self._interval_factor(noise))
        return self

    def _interval_factor(self, noise: ArrayLike | None) -> float:
        runs, chosen = self._runs, len(self.forms_) > 1
        if len(runs.u) > MOST_REFITS:  # a twentieth of the runs moves theta no more
            return conformal_factor_of(self.leave_one_out().standardised)
        variances = None if noise is None else np.broadcast_to(np.asarray(noise, float), len(runs.u))
        return interval_factor(self, runs, noise=variances, chosen=chosen)

    def _scale_intervals(self, factor: float) -> None:
        self.interval_factor_ = factor
        self.posterior_ = self.posterior_.calibrated(factor, nugget=self.nugget_)
        coverage = self.leave_one_out().coverage95
        self.diagnosis_ = replace(self.diagnosis_, interval_factor=factor, coverage95=coverage)

    def _check_parameters(self) -> None:
        check_choices(
            criterion=self.criterion, correlation=self.correlation, eta=self.eta, nugget=self.nugget
        )
        if not callable(self.trend) and self.trend not in (AUTO, *TRENDS):
            raise ValueError(
                f"trend needs one of {', '.join((AUTO, *TRENDS))} or a function of X, got {self.trend!r}"
            )
        if self.intervals not in INTERVALS:
            raise ValueError(f"intervals needs 'calibrated' or 'plug-in', got {self.intervals!r}")

    def _given(
        self, X: ArrayLike, y: ArrayLike, run_ids: Sequence[Hashable] | None
    ) -> tuple[Array, Array, tuple[Hashable, ...]]:
        """Runs (n, d), responses (n,) and names (n,), checked."""
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
        check_response(y, None if run_ids is None else run_names(run_ids, len(np.asarray(y))))
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
        ids = run_names(run_ids, len(x))
        target = np.asarray(target, dtype=np.float64)
        check_finite(x, target, ids)
        return x, target, ids

    def _box(self, x: Array, y: Array, ids: tuple[Hashable, ...], trend: str | TrendFunction) -> Runs:
        labels = tuple(sorted({int(k) % x.shape[1] for k in self.categorical or ()}))
        return prepare(x, y, trend=trend, labels=labels, ids=ids)

    def _prepared(self, X: ArrayLike, y: ArrayLike, run_ids: Sequence[Hashable] | None) -> Runs:
        self._check_parameters()
        return self._box(*self._given(X, y, run_ids), self.trend)

    def _likelihood(self, runs: Runs, noise: ArrayLike | None, correlation: str | None = None) -> Likelihood:
        equal, nearly = close_pairs(runs.u)
        y, jump = runs.observed, 1e-3 * runs.scale  # between runs 1e-6 apart: no smooth response does that
        replicated = any(y[i] != y[j] for i, j in equal) or any(abs(y[i] - y[j]) > jump for i, j in nearly)
        return likelihood_of(
            runs,
            criterion=self.criterion,
            correlation=self.correlation if correlation is None else correlation,
            eta=self.eta,
            nugget=self.nugget,
            noise=noise,
            groups=self.groups,
            replicated=replicated,
        )

    def _estimated(
        self,
        runs: Runs,
        likelihood: Likelihood,
        *,
        theta_start: Array | None = None,
        n_starts: int | None = None,
    ) -> Estimate:
        return estimate(
            runs,
            likelihood,
            ladder=self.nugget == "ladder",
            theta=self.theta,
            theta_start=self.theta_start if theta_start is None else theta_start,
            theta_bounds=self.theta_bounds,
            theta_prior=self.theta_prior,
            n_starts=self.n_starts if self.n_starts is not None else n_starts,
            seed=self.seed,
        )

    def _finish(self, runs: Runs, found: Estimate, factor: Factor | None = None) -> Self:
        """Set the fitted attributes; `factor` may come from a fit with the same theta."""
        self.forms_ = ()
        self._set(finished(runs, found, factor), Form(correlation=self.correlation, trend=self.trend))
        return self

    def _set(self, fitted: Fitted, form: Form) -> None:
        self._runs, self._found, self._diagonal = fitted.runs, fitted.found, fitted.diagonal
        self.posterior_ = fitted.posterior
        self.correlation_, self.trend_ = form.correlation, form.trend
        self.theta_, self.eta_, self.nugget_ = fitted.theta, fitted.eta, fitted.nugget
        self.sigma2_, self.beta_ = fitted.sigma2, fitted.beta
        self.trend_terms_ = list(fitted.runs.term_names)
        self.log_likelihood_ = fitted.log_likelihood
        self.interval_factor_ = 1.0
        self.diagnosis_ = diagnosed(fitted, ladder=self.nugget == "ladder")

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
        of a new run. It is zero at the runs when there is no nugget. With intervals="calibrated" it is
        that of a new run, by the nugget wider; noise that was given run by run is not in it.
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
        return left_out(self.posterior_, self._runs)
