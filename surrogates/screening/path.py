"""The path of a screening: one line per input that enters, as in Table 3.1."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .partitions.canonical import CanonicalRuns
from .sets.methods import Found

__all__ = ["ScreeningStep", "ranked_inputs", "screening_path", "told"]

Array = NDArray[np.float64]

NOTHING = 0.01  # gain in l of a step that is not worth a line


@dataclass(frozen=True, slots=True, kw_only=True)
class ScreeningStep:
    """One line of a screening path, as in Table 3.1.

    Attributes:
        step: 1 for the first selected input.
        selected: inputs with a theta of their own so far, in the order in which they entered.
        added: the inputs that this step added (several if they were grouped).
        theta_common: of the inputs that share one, in "forward" and "welch"; 0 in the default method, and
            when no input is left.
        theta: (d,) in the coordinates of X; 0 for constant inputs.
        sigma2: process variance, unit of y squared.   nugget: relative to it.
        log_likelihood: l.   gain: l minus that of the step before.
        accepted: whether the step belongs to the selection.
        eta: (d,) exponents of the correlation.
    """

    step: int
    selected: tuple[int, ...]
    added: tuple[int, ...]
    theta_common: float
    theta: Array
    sigma2: float
    nugget: float
    log_likelihood: float
    gain: float
    accepted: bool
    eta: Array


def screening_path(
    runs: CanonicalRuns, found: Found, *, n_features: int, eta: float, restricted: bool
) -> tuple[list[ScreeningStep], float]:
    """The steps in the coordinates of X and the unit of y, and l of the empty set.

    `eta` is the exponent of inputs that belong to no unit. `restricted` says which likelihood l is: its
    value shifts with the unit of y.
    """
    n, d = len(runs.y), n_features
    shift = (n - 1 if restricted else n) * np.log(runs.scale)
    steps: list[ScreeningStep] = []
    order: list[int] = []
    for i, (chosen, optimum) in enumerate(zip(found.sets, found.optima, strict=True)):
        if i == 0:
            continue
        new = [u for u in chosen if u not in found.sets[i - 1]]
        added = tuple(k for u in new for k in runs.given(u))
        order += added
        unit_theta, unit_eta = optimum.theta(len(runs.units)), found.etas[i]
        theta, etas = np.zeros(d), np.full(d, eta)
        for u, columns in enumerate(runs.units):
            for k in columns:
                theta[runs.columns[k]] = unit_theta[u] / runs.span[k] ** unit_eta[u]
                etas[runs.columns[k]] = unit_eta[u]
        pooled = len(optimum.partition) > len(chosen)
        steps.append(
            ScreeningStep(
                step=i,
                selected=tuple(order),
                added=added,
                theta_common=float(unit_theta[optimum.partition[-1][0]]) if pooled else 0.0,
                theta=theta,
                sigma2=optimum.sigma2 * runs.scale**2,
                nugget=float(np.exp(optimum.phi[-1])),
                log_likelihood=float(optimum.value - shift),
                gain=float(optimum.value - found.optima[i - 1].value),
                accepted=i <= found.accepted,
                eta=etas,
            )
        )
    return steps, float(found.optima[0].value - shift)


def told(steps: list[ScreeningStep]) -> list[ScreeningStep]:
    """The accepted steps, the first rejected one, and what is more as long as it brings anything."""
    last = max((s.step for s in steps if s.accepted or s.gain > NOTHING), default=0)
    return steps[: max(last, sum(s.accepted for s in steps) + 1)]


def ranked_inputs(
    runs: CanonicalRuns, ranked: Sequence[int], steps: Sequence[ScreeningStep], scores: Array, d: int
) -> NDArray[np.intp]:
    """All d inputs: of the ranked units, of the path, by the scores (u,) of units, then what never varies.

    A score is how much l would rise with a theta of the unit's own.
    """
    order = [k for u in ranked for k in runs.given(u)]
    order += [k for step in steps for k in step.added]
    order += [k for u in np.argsort(-scores, kind="stable") for k in runs.given(int(u))]
    return np.array(list(dict.fromkeys([*order, *range(d)])), dtype=np.intp)
