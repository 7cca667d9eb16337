"""Bounded maximisation of a log-likelihood by quasi-Newton steps that start from the average information.

The average of observed and expected information is never negative and costs little more than a gradient
(Gilmour, Thompson and Cullis 1995, Biometrics 51, 1440-1450). It gives the first steps their scale; it
differs from the true curvature for responses that no sample path of the process resembles, so from then on
the curvature learns from the gradients (BFGS with Powell's damping). A step is limited to a box of adaptive
size on the parameters that no bound holds, and taken when l rises.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

__all__ = ["Ascent", "Evaluation", "ascend"]

LARGEST_STEP = 2.5  # in log theta: a factor of 12


@dataclass(frozen=True, slots=True)
class Evaluation:
    """Log-likelihood, gradient (g,) and average information (g, g) at one set of parameters.

    sigma2: variances of the process (q,), where there are any
    """

    value: float
    gradient: NDArray[np.float64]
    information: NDArray[np.float64] | None
    sigma2: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Ascent:
    """Where an ascent ended."""

    parameters: NDArray[np.float64]
    value: float
    gradient: NDArray[np.float64]
    sigma2: NDArray[np.float64]
    evaluations: int
    converged: bool


def ascend(
    evaluate: Callable[[NDArray[np.float64], bool], Evaluation | None],
    start: NDArray[np.float64],
    *,
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    tolerance: float = 1e-6,
    max_evaluations: int = 100,
) -> Ascent | None:
    """Climb from `start` inside the bounds; None when the start itself cannot be evaluated.

    `evaluate(parameters, with_information)` returns None where the correlation matrix has no factor. Stops
    when a step promises less than `tolerance` in l, or after `max_evaluations`.

    >>> def paraboloid(p, with_information):
    ...     return Evaluation(-float((p - 3) @ (p - 3)), -2 * (p - 3), 2 * np.eye(2))
    >>> end = ascend(paraboloid, np.zeros(2), lower=np.zeros(2), upper=np.array([9.0, 2.0]))
    >>> print(end.parameters.round(3), end.converged)
    [3. 2.] True
    """
    x = np.clip(start, lower, upper)
    here = evaluate(x, True)
    if here is None:
        return None
    curvature = _first_curvature(here)
    count, box, converged, fresh = 1, LARGEST_STEP, False, True
    while count < max_evaluations:
        g = here.gradient
        free = ~(((x <= lower) & (g <= 0.0)) | ((x >= upper) & (g >= 0.0)))
        if not free.any():
            converged = True
            break
        step = _step(curvature, g, free, box)
        trial = np.clip(x + step, lower, upper)
        step = trial - x
        promise = float(g @ step - 0.5 * step @ curvature @ step)
        if promise < tolerance or box < 1e-6:
            # near the top, unless what has been learned about the curvature misleads: ask once more
            converged = fresh and box >= 1e-6
            again = None if fresh else evaluate(x, True)
            if again is None:
                break
            count, box, fresh = count + 1, 1.0, True
            curvature = _first_curvature(again)
            continue
        there = evaluate(trial, False)
        count += 1
        gain = -np.inf if there is None else there.value - here.value
        if there is not None:
            curvature = _learn(curvature, step, g - there.gradient)
        if there is not None and gain > 1e-4 * promise:
            x, here, fresh = trial, there, False
            if gain > 0.5 * promise:
                box = min(2.0 * box, LARGEST_STEP)
            elif gain < 0.1 * promise:
                box = max(0.5 * box, 1e-3)
        else:
            box = min(box, float(np.abs(step).max())) / 3.0
    return Ascent(
        parameters=x,
        value=here.value,
        gradient=here.gradient,
        sigma2=here.sigma2,
        evaluations=count,
        converged=converged,
    )


def _first_curvature(here: Evaluation) -> NDArray[np.float64]:
    assert here.information is not None
    # a parameter without information (theta near its lower bound) is limited by the box instead
    return here.information + np.diag(1e-3 * np.diagonal(here.information) + 1e-6)


def _step(
    curvature: NDArray[np.float64], g: NDArray[np.float64], free: NDArray[np.bool_], box: float
) -> NDArray[np.float64]:
    """A step uphill on the free parameters, damped until it fits the box of half-width `box`."""
    a = curvature if free.all() else curvature[np.ix_(free, free)]
    step = np.zeros(len(g))
    values, vectors = np.linalg.eigh(a)
    projected = vectors.T @ g[free]
    damping = 0.0
    scale = float(values.max())
    for _ in range(12):
        s = vectors @ (projected / (np.maximum(values, 1e-12 * scale) + damping))
        length = float(np.abs(s).max())
        if length <= 1.05 * box:
            break
        damping = max(2.0 * damping, (damping + 1e-4 * scale) * min(length / box, 100.0))
    step[free] = np.clip(s, -box, box)
    return step


def _learn(
    curvature: NDArray[np.float64], s: NDArray[np.float64], t: NDArray[np.float64]
) -> NDArray[np.float64]:
    """BFGS update of the curvature with the step s and the fall t of the gradient along it."""
    bs = curvature @ s
    sbs = float(s @ bs)
    st = float(s @ t)
    if sbs <= 0.0:
        return curvature
    if st < 0.2 * sbs:  # Powell: keep the curvature positive
        weight = 0.8 * sbs / (sbs - st)
        t = weight * t + (1.0 - weight) * bs
        st = 0.2 * sbs
    return curvature - np.outer(bs, bs) / sbs + np.outer(t, t) / st
