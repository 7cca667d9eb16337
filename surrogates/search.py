"""Multi-start search of the ARD likelihood: one theta per unit.

The likelihood of 20 thetas from 50 runs has hundreds of maxima. Starts are *sparse*: a few units drawn at
random begin active, the others almost inert, because that is what a screening expects of the answer;
Gaussian starts find the best maximum half as often. The search ends early when the best maximum has been
reached often enough.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .landscape import Landscape, Optimum

__all__ = ["Search", "multi_start", "sparse_starts"]

Array = NDArray[np.float64]
ACTIVE, INERT = -0.25, -4.0  # log theta on [0, 1] of a start
SAME = 0.1  # two optima closer than this in l are the same one


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """What a multi-start found: distinct maxima, best first, and how many starts reached each."""

    optima: tuple[Optimum, ...]
    reached: tuple[int, ...]
    starts: int
    evaluations: int


def sparse_starts(
    n_units: int, *, number: int, active: int, nuggets: Sequence[float], rng: np.random.Generator
) -> list[Array]:
    """Starts with `active` random units active, the others almost inert; log nugget last, taken in turn."""
    starts = []
    for i in range(number):
        phi = np.full(n_units + 1, INERT)
        phi[rng.choice(n_units, min(active, n_units), replace=False)] = ACTIVE
        phi[-1] = np.log(nuggets[i % len(nuggets)])
        starts.append(phi)
    return starts


def multi_start(
    landscape: Landscape,
    starts: Sequence[Array],
    *,
    nugget: tuple[float, float],
    enough: int,
    fewest: int,
    tolerance: float = 3e-2,
    max_evaluations: int = 60,
) -> Search:
    """Climb from each start with one theta per unit, until `fewest` starts are done and the best
    maximum was reached `enough` times.

    Rough ascents: a maximum is told from the others by SAME in l, the winners are climbed to the end later.
    """
    everyone = tuple((u,) for u in range(landscape.n_units))
    optima: list[Optimum] = []
    reached: list[int] = []
    evaluations = done = 0
    for start in starts:
        end = landscape.climb(
            everyone, start, nugget=nugget, tolerance=tolerance, max_evaluations=max_evaluations
        )
        evaluations += end.evaluations
        done += 1
        for i, other in enumerate(optima):
            if abs(other.value - end.value) < SAME:
                reached[i] += 1
                if end.value > other.value:
                    optima[i] = end
                break
        else:
            optima.append(end)
            reached.append(1)
        best = int(np.argmax([o.value for o in optima]))
        if reached[best] >= enough and done >= fewest:
            break
    order = np.argsort([-o.value for o in optima], kind="stable")
    return Search(
        optima=tuple(optima[i] for i in order),
        reached=tuple(reached[i] for i in order),
        starts=done,
        evaluations=evaluations,
    )
