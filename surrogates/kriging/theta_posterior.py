"""Draws of theta given the runs: the likelihood as a density, by a random walk shaped by its curvature.

    p(log theta | y) ~ exp(l(theta)),   flat in log theta between the bounds of the search

with l restricted and sigma^2 profiled, times the prior of theta where the model has one. Proposals are normal
with the inverse of the average information, scaled in the first quarter of the walk towards three
acceptances in ten (Roberts, Gelman and Gilks, Annals of Applied Probability 7, 1997); the rest is thinned.
A bound reflects.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..likelihood.likelihood import Likelihood, Workspace
from .diagnosis import varying
from .estimation import Estimate
from .fitted import Fitted, finished
from .fitting import bounds
from .runs import Runs

__all__ = ["drawn_fits"]

Array = NDArray[np.float64]

STEPS = 600
ACCEPTED = 0.3
WIDEST = 3.0  # standard deviation of a proposal of a log theta that the runs say nothing about


def drawn_fits(runs: Runs, found: Estimate, count: int, *, rng: np.random.Generator) -> list[Fitted]:
    """`count` models of the same runs, each at a draw of theta (and of eta and the nugget if free).

    Parameters that the search held, such as a given theta, keep their values.
    """
    likelihood = replace(found.likelihood, work=Workspace(len(runs.u)))
    start = np.clip(_vector(found), *bounds(likelihood, None))
    fits: list[Fitted] = []
    for vector in _walk(likelihood, start, count, rng=rng):
        drawn = likelihood.unpack(vector)
        drawn = replace(drawn, theta=np.where(varying(runs.u), drawn.theta, found.parameters.theta))
        estimate = Estimate(parameters=drawn, likelihood=found.likelihood, search=None)
        fits.append(finished(runs, estimate))
    return fits


def _vector(found: Estimate) -> Array:
    """The parameter vector of the estimate; an input without theta stands at the smallest."""
    likelihood, at = found.likelihood, found.parameters
    theta = np.log(np.maximum(at.theta, 1e-300))
    vector = [theta[likelihood.groups == g].mean() for g in range(likelihood.n_groups)]
    if likelihood.eta_free:
        vector.append(at.eta)
    if likelihood.nugget is None:
        vector.append(np.log(at.nugget))
    if at.sigma2 is not None:
        vector.append(np.log(at.sigma2))
    return np.array(vector)


def _walk(likelihood: Likelihood, start: Array, count: int, *, rng: np.random.Generator) -> list[Array]:
    lower, upper = bounds(likelihood, None)
    at = likelihood.evaluate(start)
    assert at is not None
    assert at.information is not None
    root = np.linalg.cholesky(np.linalg.inv(at.information + np.eye(len(start)) / WIDEST**2))
    size, vector, value, accepted = 2.0 / np.sqrt(len(start)), start, _density(likelihood, start), 0
    learning, walked = STEPS // 4, []
    for step in range(STEPS):
        proposed = vector + size * (root @ rng.standard_normal(len(start)))
        proposed = np.where(proposed < lower, 2.0 * lower - proposed, proposed)
        proposed = np.clip(np.where(proposed > upper, 2.0 * upper - proposed, proposed), lower, upper)
        density = _density(likelihood, proposed)
        if np.log(rng.random()) < density - value:
            vector, value, accepted = proposed, density, accepted + 1
        if step < learning:
            if step % 10 == 9:
                size *= np.exp(0.5 * (accepted / (step + 1) - ACCEPTED))
        else:
            walked.append(vector)
    return [walked[i] for i in np.linspace(0, len(walked) - 1, count).astype(int)]


def _density(likelihood: Likelihood, vector: Array) -> float:
    value = likelihood.value(vector)
    if likelihood.prior is not None:
        mean, deviation = likelihood.prior
        value -= 0.5 * float((((vector[: likelihood.n_groups] - mean) / deviation) ** 2).sum())
    return value
