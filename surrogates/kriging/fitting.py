"""The search for the largest likelihood: starts, ascents, subsamples, agreement of the starts."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..likelihood.ascent import Ascent, ascend
from ..likelihood.likelihood import Likelihood, Workspace
from ..likelihood.starts import (
    LADDER,
    canonical_columns,
    canonical_rows,
    draw,
)
from .diagnosis import varying

__all__ = ["Search", "bounds", "search"]

Array = NDArray[np.float64]

COARSE, FINE = 1e-3, 1e-9  # gain in l at which an ascent stops
AGREE = 0.05  # two optima closer than this in l count as one
MANY_RUNS = 250  # above, the starts climb on a subsample
SUBSAMPLE = 150
SURVIVORS, TRIAL = 3, 12  # ascents on all runs; evaluations before the best of them is chosen
NUGGET_BOUNDS = (1e-10, 10.0)
ETA_BOUNDS = (1.0, 2.0)
SIGMA2_BOUNDS = (1e-6, 1e6)  # for responses of unit variance


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """Result of `search`.

    Attributes:
        vector: parameters at the best optimum; `value` the log-likelihood there.
        n_starts: starts tried, `n_agree` of which ended within 0.05 of the best.
        gap: fall of l to the second optimum, nan if all starts agree.
        at_lower, at_upper: which parameters sit on a bound.
        evaluations: of the likelihood, on all runs or a subsample.
        converged: whether the best ascent stopped by itself.
    """

    vector: Array
    value: float
    n_starts: int
    n_agree: int
    gap: float
    at_lower: NDArray[np.bool_]
    at_upper: NDArray[np.bool_]
    evaluations: int
    converged: bool


def bounds(likelihood: Likelihood, theta: Array | None) -> tuple[Array, Array]:
    """Bounds of the parameter vector; `theta` (g, 2) replaces the default ones of theta.

    By default an input of width 1 may lose between 6e-6 and all of its correlation over the distance of
    neighbours: exp(-theta h^2) with theta up to 400, or n^2 when there are one or two inputs. The likelihood
    says nothing about a theta whose inputs never change: it is held at its lower bound.
    """
    n, d = likelihood.x.shape
    g = likelihood.n_groups
    lower, upper = np.full(g, -12.0), np.full(g, np.log(max(400.0, n**2 if d < 3 else 0.0)))
    if theta is not None:
        lower, upper = np.log(theta[:, 0]), np.log(theta[:, 1])
    known = np.isin(np.arange(g), likelihood.groups[varying(likelihood.x)])
    upper = np.where(known, upper, lower)
    more = []
    if likelihood.eta_free:
        more.append(ETA_BOUNDS)
    if likelihood.nugget is None:
        more.append((float(np.log(NUGGET_BOUNDS[0])), float(np.log(NUGGET_BOUNDS[1]))))
    if likelihood.noise is not None:
        more.append((float(np.log(SIGMA2_BOUNDS[0])), float(np.log(SIGMA2_BOUNDS[1]))))
    return np.append(lower, [m[0] for m in more]), np.append(upper, [m[1] for m in more])


def _starts(likelihood: Likelihood, warm: Array | None, count: int, rng: np.random.Generator) -> Array:
    d = likelihood.x.shape[1]
    theta = np.empty((count, d))
    theta[:, canonical_columns(likelihood.x, likelihood.y)] = draw(d, count, rng=rng)
    g = likelihood.n_groups
    log_theta = np.empty((count, g))
    for group in range(g):
        log_theta[:, group] = theta[:, likelihood.groups == group].mean(axis=1)
    if warm is not None:
        log_theta[1:] = log_theta[:-1].copy()
        log_theta[0] = warm
    more = []
    if likelihood.eta_free:
        more.append(np.where(np.arange(count) % 2 == 0, 1.9, 1.5))
    if likelihood.nugget is None:
        more.append(np.log(np.resize(LADDER, count)))
    if likelihood.noise is not None:
        more.append(np.zeros(count))
    return np.column_stack([log_theta, *more]) if more else log_theta


def search(
    likelihood: Likelihood,
    *,
    n_starts: int,
    theta_bounds: Array | None = None,
    warm: Array | None = None,
    rng: np.random.Generator,
) -> Search | None:
    """Largest likelihood over `n_starts` ascents; None when no start has a positive definite matrix.

    `warm` (g,) replaces the first start of log theta. Above 250 runs the starts climb on 150 of them (more if
    the trend needs it), and the best three go on with all runs.
    """
    lower, upper = bounds(likelihood, theta_bounds)
    starts = np.clip(_starts(likelihood, warm, n_starts, rng), lower, upper)
    n, p = likelihood.f.shape
    likelihood = replace(likelihood, work=Workspace(n))
    climber, evaluations = likelihood, 0
    sampled = n > MANY_RUNS
    if sampled:
        size = min(n, max(SUBSAMPLE, 2 * p + 50))
        rows = canonical_rows(likelihood.x, likelihood.y)[np.sort(rng.permutation(n)[:size])]
        climber = replace(likelihood.subset(rows), work=Workspace(size))
    ends: list[Ascent] = []
    for start in starts:
        end = _climb(climber, start, lower, upper)
        if end is not None:
            evaluations += end.evaluations
            ends.append(end)
    ends.sort(key=lambda end: -end.value)
    if not ends:
        return None
    values = np.array([end.value for end in ends])
    finals: list[Ascent] = []
    for end in _distinct(ends)[: SURVIVORS if sampled else 1]:
        final = ascend(
            likelihood.evaluate,
            end.parameters,
            lower=lower,
            upper=upper,
            tolerance=COARSE if sampled else FINE,
            max_evaluations=TRIAL if sampled else 100,
        )
        if final is not None:
            evaluations += final.evaluations
            finals.append(final)
    if not finals:
        return None
    best = max(finals, key=lambda end: end.value)
    if sampled and not best.converged:
        further = ascend(
            likelihood.evaluate,
            best.parameters,
            lower=lower,
            upper=upper,
            tolerance=COARSE,
            max_evaluations=60,
        )
        if further is not None:
            evaluations += further.evaluations
            best = further
    # starts that stopped short of a shared flat top still agree with it
    agree = values > max(float(values[0]), best.value if not sampled else -np.inf) - AGREE
    agree[0] = True
    others = values[~agree]
    if sampled and len(finals) > 1:
        others = np.array(sorted(f.value for f in finals)[:-1])
        others = others[others < best.value - AGREE]
    reference = best.value
    return Search(
        vector=best.parameters,
        value=best.value,
        n_starts=n_starts,
        n_agree=int(agree.sum()),
        gap=float(reference - others.max()) if len(others) else float("nan"),
        at_lower=best.parameters <= lower + 1e-9,
        at_upper=(best.parameters >= upper - 1e-9) & (lower < upper),
        evaluations=evaluations,
        converged=best.converged,
    )


def _climb(likelihood: Likelihood, start: Array, lower: Array, upper: Array) -> Ascent | None:
    """Ascend from the start, or from a rougher one where the matrix is singular."""
    g = likelihood.n_groups
    while True:
        end = ascend(likelihood.evaluate, start, lower=lower, upper=upper, tolerance=COARSE)
        if end is not None or (start[:g] >= upper[:g]).all():
            return end
        start = start.copy()
        start[:g] = np.minimum(start[:g] + 3.0, upper[:g])


def _distinct(ends: list[Ascent]) -> list[Ascent]:
    """One ascent per optimum, best first."""
    kept: list[Ascent] = []
    for end in ends:
        if all(abs(end.value - other.value) > AGREE for other in kept):
            kept.append(end)
    return kept
