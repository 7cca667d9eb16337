"""From prepared runs to estimated parameters: what is fixed, what is searched, in whose coordinates."""

from collections.abc import Hashable, Sequence
from dataclasses import dataclass, replace
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..likelihood.ascent import ascend
from ..likelihood.correlation import CORRELATIONS, Correlation
from ..likelihood.likelihood import Likelihood, Parameters, Workspace
from .diagnosis import varying
from .fitting import (
    MANY_RUNS,
    Search,
    bounds,
    search,
)
from .posterior import Scaling
from .runs import Runs, not_positive_definite

__all__ = ["NUGGETS", "Estimate", "check_choices", "estimate", "likelihood_of", "theta_units"]

Array = NDArray[np.float64]

AUTOMATIC_NUGGET = 1e-8
NUGGETS = ("auto", "estimate", "ladder")
RUNGS = (1e-2, 1e-4, 1e-6, 1e-8)
BETWEEN = 1e-4  # gain in l at which the climb between the rungs stops
INERT = float(np.exp(-12.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """Parameters, the likelihood they maximise, and the search (None when nothing was searched)."""

    parameters: Parameters
    likelihood: Likelihood
    search: Search | None


def check_choices(*, criterion: str, correlation: str, eta: float | str, nugget: float | str) -> None:
    """Raise a ValueError for a value that is not one of the documented ones."""
    if criterion not in ("reml", "ml"):
        raise ValueError(f"criterion needs 'reml' or 'ml', got {criterion!r}")
    if correlation not in ("auto", *CORRELATIONS):
        raise ValueError(f"correlation needs one of auto, {', '.join(CORRELATIONS)}, got {correlation!r}")
    if isinstance(nugget, str):
        if nugget not in NUGGETS:
            raise ValueError(f"nugget needs a number or one of {', '.join(NUGGETS)}, got {nugget!r}")
    elif not (isinstance(nugget, Real) and 0.0 <= nugget < np.inf):
        raise ValueError(f"nugget needs a number >= 0 or one of {', '.join(NUGGETS)}, got {nugget!r}")
    if isinstance(eta, str):
        if eta != "free":
            raise ValueError(f"eta needs a number in [1, 2] or 'free', got {eta!r}")
    elif not (isinstance(eta, Real) and 1.0 <= eta <= 2.0):
        raise ValueError(f"eta needs a number in [1, 2] or 'free', got {eta!r}")


def theta_units(scaling: Scaling, correlation: Correlation) -> Array:
    """theta in the box of width 1 divided by theta in the coordinates of X, (d,)."""
    power = correlation.eta if correlation.kind == "power_exponential" else 2.0
    return np.asarray(scaling.width**power)


def likelihood_of(
    runs: Runs,
    *,
    criterion: str,
    correlation: str,
    eta: float | str,
    nugget: float | str,
    noise: ArrayLike | None,
    groups: Sequence[Hashable] | None,
    replicated: bool,
) -> Likelihood:
    """The likelihood of the runs; `replicated`: there are equal inputs with different responses."""
    n, d = runs.u.shape
    index = np.arange(d)
    if groups is not None:
        if len(groups) != d:
            raise ValueError(f"groups needs one label per input, got {len(groups)} for {d} inputs")
        first = {label: i for i, label in enumerate(dict.fromkeys(groups))}
        index = np.array([first[label] for label in groups])
    variances = None
    if noise is not None:
        given = np.asarray(noise, dtype=np.float64)
        if given.shape not in ((), (n,)) or not np.isfinite(given).all() or (given < 0.0).any():
            raise ValueError(f"noise needs variances >= 0, one number or one for each of {n} runs")
        variances = np.broadcast_to(given, (n,)) / runs.scale**2
    if isinstance(nugget, str):
        free = nugget == "estimate" or (nugget == "auto" and replicated and noise is None)
        number = None if free else AUTOMATIC_NUGGET
    else:
        number = float(nugget)
    power = correlation == "power_exponential"
    exponent = 2.0 if not power else 1.9 if isinstance(eta, str) else float(eta)
    return Likelihood(
        x=runs.u,
        f=runs.f,
        y=runs.z,
        correlation=Correlation(kind=correlation, eta=exponent, labels=runs.labels),
        groups=index,
        restricted=criterion == "reml",
        eta_free=power and isinstance(eta, str),
        nugget=number,
        noise=variances,
    )


def estimate(
    runs: Runs,
    likelihood: Likelihood,
    *,
    ladder: bool,
    theta: ArrayLike | None,
    theta_start: ArrayLike | None,
    theta_bounds: ArrayLike | None,
    n_starts: int | None,
    seed: int,
    theta_prior: tuple[float, float] | None = None,
) -> Estimate:
    """Maximise the likelihood, times the density of a prior of theta if there is one, over what is free.

    Raises NotPositiveDefinite.
    """
    n, d = runs.u.shape
    if n_starts is None:
        n_starts = int(np.clip(1.5 * d, 5, 30)) if n <= MANY_RUNS else 8
    if n_starts < 1:
        raise ValueError(f"n_starts needs a whole number >= 1, got {n_starts}")
    units = theta_units(runs.scaling, likelihood.correlation)
    fixed = None if theta is None else _per_input("theta", theta, d) * units
    if runs.degenerate:
        return _plain(likelihood, np.where(varying(runs.u), INERT, 0.0) if fixed is None else fixed)
    warm = limits = None
    if fixed is not None:
        if (
            likelihood.nugget is not None
            and likelihood.noise is None
            and not likelihood.eta_free
            and not ladder
        ):
            eta = likelihood.correlation.eta
            parameters = Parameters(theta=fixed, eta=eta, nugget=likelihood.nugget)
            return Estimate(parameters=parameters, likelihood=likelihood, search=None)
        # nugget, eta or sigma^2 are still free: bounds of no width hold theta
        likelihood = replace(likelihood, groups=np.arange(d))
        limits = np.column_stack([fixed, fixed]).clip(1e-300)
    else:
        limits = _limits(likelihood, theta_bounds, units)
        if theta_start is not None:
            start = np.log(np.maximum(_per_input("theta_start", theta_start, d) * units, 1e-300))
            members = [start[likelihood.groups == g] for g in range(likelihood.n_groups)]
            warm = np.array([m.mean() for m in members])
        likelihood = replace(likelihood, prior=_prior(likelihood, theta_prior, units))
    rungs = [replace(likelihood, nugget=rung) for rung in RUNGS] if ladder else [likelihood]
    best: tuple[Search, Likelihood] | None = None
    for rung in rungs:
        rng = np.random.default_rng(seed)
        found = search(rung, n_starts=n_starts, theta_bounds=limits, warm=warm, rng=rng)
        if found is not None and (best is None or found.value > best[0].value):
            best = found, rung
    if best is None:
        raise not_positive_definite(runs, likelihood.nugget or 0.0)
    found, rung = _between_rungs(*best, limits) if ladder else best
    parameters = rung.unpack(found.vector)
    if fixed is None:  # an input that never changes takes no part, wherever its theta was held
        parameters = replace(parameters, theta=np.where(varying(runs.u), parameters.theta, 0.0))
    return Estimate(parameters=parameters, likelihood=rung, search=found)


def _between_rungs(found: Search, rung: Likelihood, limits: Array | None) -> tuple[Search, Likelihood]:
    """The maximum with the nugget free, from the best rung on.

    The likelihood tells nuggets apart that differ by less than two rungs, and on the lower one of two
    intervals are far too narrow.
    """
    assert rung.nugget is not None
    free = replace(rung, nugget=None, work=Workspace(len(rung.x)))
    at = free.n_groups + int(free.eta_free)
    lower, upper = bounds(free, limits)
    lower[at] = np.log(RUNGS[-1])
    start = np.insert(found.vector, at, np.log(rung.nugget))
    end = ascend(free.evaluate, start, lower=lower, upper=upper, tolerance=BETWEEN)
    if end is None or not end.value > found.value:
        return found, rung
    kept = np.arange(len(start)) != at
    better = replace(
        found,
        vector=end.parameters[kept],
        value=end.value,
        at_lower=(end.parameters <= lower + 1e-9)[kept],
        at_upper=((end.parameters >= upper - 1e-9) & (lower < upper))[kept],
        evaluations=found.evaluations + end.evaluations,
        converged=end.converged,
    )
    return better, replace(rung, nugget=float(np.exp(end.parameters[at])))


def _plain(likelihood: Likelihood, theta: Array) -> Estimate:
    """Parameters for a response that the trend reproduces: any theta will do."""
    nugget = max(likelihood.nugget or 0.0, AUTOMATIC_NUGGET)
    sigma2 = None if likelihood.noise is None else 1e-6
    parameters = Parameters(theta=theta, eta=likelihood.correlation.eta, nugget=nugget, sigma2=sigma2)
    return Estimate(parameters=parameters, likelihood=replace(likelihood, nugget=nugget), search=None)


def _per_input(name: str, value: ArrayLike, d: int) -> Array:
    array = np.asarray(value, dtype=np.float64)
    if array.shape not in ((), (d,)) or not np.isfinite(array).all() or (array < 0.0).any():
        raise ValueError(f"{name} needs {d} finite numbers >= 0, got {np.asarray(value).tolist()}")
    return np.broadcast_to(array, (d,)).copy()


def _prior(
    likelihood: Likelihood, theta_prior: tuple[float, float] | None, units: Array
) -> tuple[Array, float] | None:
    """Mean per group and standard deviation of log theta in the box of width 1."""
    if theta_prior is None:
        return None
    given = np.asarray(theta_prior, dtype=np.float64)
    if given.shape != (2,) or not (np.isfinite(given).all() and (given > 0.0).all()):
        raise ValueError(f"theta_prior needs (median, deviation of log theta) > 0, got {theta_prior}")
    mean = np.log(given[0] * units)
    members = [mean[likelihood.groups == g] for g in range(likelihood.n_groups)]
    return np.array([m.mean() for m in members]), float(given[1])


def _limits(likelihood: Likelihood, theta_bounds: ArrayLike | None, units: Array) -> Array | None:
    """Bounds of theta per group in the box of width 1."""
    if theta_bounds is None:
        return None
    d = len(units)
    given = np.asarray(theta_bounds, dtype=np.float64)
    if given.shape not in ((2,), (d, 2)):
        raise ValueError(f"theta_bounds needs (low, high) or shape ({d}, 2), got shape {given.shape}")
    limits = np.broadcast_to(given, (d, 2)) * units[:, None]
    if not (np.isfinite(limits).all() and (limits[:, 0] > 0).all() and (limits[:, 0] <= limits[:, 1]).all()):
        raise ValueError(f"theta_bounds needs 0 < low <= high, got {given.tolist()}")
    members = [limits[likelihood.groups == g] for g in range(likelihood.n_groups)]
    return np.array([[m[:, 0].min(), m[:, 1].max()] for m in members])
