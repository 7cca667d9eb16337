"""From estimated parameters to what a fit hands out: posterior, coefficients, likelihood, diagnosis."""

from collections.abc import Hashable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ..likelihood.likelihood import Factor, Likelihood
from .diagnosis import (
    Diagnosis,
    advise,
    close_pairs,
    constant_columns,
    repeated_columns,
)
from .estimation import Estimate, theta_units
from .posterior import Posterior
from .runs import Runs, not_positive_definite
from .validation import left_out

__all__ = ["Fitted", "diagnosed", "finished"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """A fitted model; theta (d,), sigma2 and beta (p,) in the coordinates of X and the unit of y.

    `diagonal` is what stands on the diagonal of C beside the ones of R, a number or (n,).
    """

    runs: Runs
    found: Estimate
    posterior: Posterior
    diagonal: Array | float
    theta: Array
    eta: float
    nugget: float
    sigma2: float
    beta: Array
    log_likelihood: float


def finished(runs: Runs, found: Estimate, factor: Factor | None = None) -> Fitted:
    """The model of the estimate; `factor` may come from a fit with the same theta.

    Raises NotPositiveDefinite.
    """
    likelihood, parameters = found.likelihood, found.parameters
    if factor is None:
        factor = likelihood.factor(parameters)
    if factor is None:
        raise not_positive_definite(runs, parameters.nugget)
    sigma2 = 0.0 if runs.degenerate else float(likelihood.variances(factor, parameters)[0])
    coefficients = factor.coefficients(runs.z)[:, 0]
    posterior = Posterior(
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
    beta = np.asarray(runs.scale * np.linalg.solve(runs.back, coefficients), dtype=np.float64)
    if runs.trend.function is None:
        beta[0] += runs.shift
    value = float("inf")
    if not runs.degenerate:
        value = likelihood.value_of(factor, np.array([sigma2]))
        value -= likelihood.degrees() * np.log(runs.scale)
        if likelihood.restricted:
            value -= float(np.linalg.slogdet(runs.back)[1])
    return Fitted(
        runs=runs,
        found=found,
        posterior=posterior,
        diagonal=likelihood.diagonal(parameters),
        theta=parameters.theta / theta_units(runs.scaling, posterior.correlation),
        eta=parameters.eta,
        nugget=parameters.nugget,
        sigma2=runs.scale**2 * sigma2,
        beta=beta,
        log_likelihood=float(value),
    )


def diagnosed(fitted: Fitted, *, ladder: bool) -> Diagnosis:
    """The diagnosis of a fitted model; `ladder`: its nugget came from the ladder."""
    runs, likelihood, search = fitted.runs, fitted.found.likelihood, fitted.found.search
    equal, nearly = close_pairs(runs.u)
    unequal = [(i, j) for i, j in equal if runs.observed[i] != runs.observed[j]]
    loo = left_out(fitted.posterior, runs)
    diagnosis = Diagnosis(
        n_runs=len(runs.u),
        n_inputs=runs.u.shape[1],
        n_trend_terms=runs.f.shape[1],
        condition_number=_condition(fitted.posterior.factor, fitted.diagonal),
        duplicates=_named(runs, equal),
        unequal_duplicates=_named(runs, unequal),
        near_duplicates=_named(runs, nearly),
        constant_inputs=constant_columns(runs.u),
        repeated_inputs=repeated_columns(runs.u),
        dropped_trend_terms=runs.dropped,
        nugget=fitted.nugget,
        nugget_estimated=likelihood.nugget is None or ladder,
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


def _condition(factor: Factor, diagonal: Array | float) -> float:
    """1-norm condition number of C from its factor (LAPACK's estimate)."""
    size = float((np.abs(factor.r).sum(axis=0) + diagonal).max())
    reciprocal, info = lapack.dpocon(factor.lower, size, uplo="L")
    return float(1.0 / reciprocal) if info == 0 and reciprocal > 0.0 else float("inf")


def _inputs(likelihood: Likelihood, at: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(int(k) for k in np.flatnonzero(at[: likelihood.n_groups][likelihood.groups]))


def _named(runs: Runs, pairs: list[tuple[int, int]]) -> tuple[tuple[Hashable, Hashable], ...]:
    return tuple((runs.ids[i], runs.ids[j]) for i, j in pairs)
