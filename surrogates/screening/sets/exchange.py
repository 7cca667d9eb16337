"""Exchange polish: does another unit, taken in, lead to a better set?

From the best set of a chain the units outside are ranked by their score, the likelihood gain that one
average-information step in their theta alone promises. The most promising are taken in, one at a time, the
maximum is climbed, and the set is shortened again. Whatever improves the best l - threshold * size is
kept, and the exchange goes on from there.
"""

import numpy as np

from ..partitions.optimum import Landscape, Optimum, standard_scores
from .backward import Chain, alone, shorten

__all__ = ["exchange", "take_in"]

ENTERING = (-4.0, -1.5, 0.5)  # log theta with which a unit is tried


def take_in(
    landscape: Landscape,
    optimum: Optimum,
    selected: tuple[int, ...],
    unit: int,
    *,
    nugget: tuple[float, float],
    tolerance: float,
    entering: tuple[float, ...] = ENTERING,
) -> Optimum:
    """The maximum with `unit` beside `selected`, from the best of the values `entering` of its log theta."""
    partition = alone((*selected, unit))
    starts = [np.concatenate([optimum.phi[:-1], [own], optimum.phi[-1:]]) for own in entering]
    best = max(starts, key=lambda phi: landscape.value(partition, phi))
    return landscape.climb(partition, best, nugget=nugget, tolerance=tolerance, max_evaluations=60)


def exchange(
    landscape: Landscape,
    chain: Chain,
    *,
    threshold: float,
    nugget: tuple[float, float],
    entering: int = 4,
    rounds: int = 4,
) -> Chain:
    """The chain, or one with a better best set that an exchange of units leads to, from as large a set on."""
    largest, given = len(chain.sets[0]), chain
    for _ in range(rounds):
        i = chain.best(threshold)
        selected, here = chain.sets[i], chain.optima[i]
        candidates = _outside(landscape, here, selected)[:entering]
        grown = [
            (take_in(landscape, here, selected, u, nugget=nugget, tolerance=1e-3), (*selected, u))
            for u in candidates
        ]
        better = chain
        for end, larger in sorted(grown, key=lambda g: -g[0].value)[:2]:
            other = shorten(landscape, end, selected=larger, nugget=nugget)
            if other.score(threshold) > better.score(threshold) + 1e-3:
                better = other
        if better is chain:
            break
        chain = better
    if chain is given:
        return given
    # the better set gets a full chain, so that the path shows what comes beyond it
    i = chain.best(threshold)
    selected, here = chain.sets[i], chain.optima[i]
    larger = (*selected, *_outside(landscape, here, selected))[: max(largest, len(selected))]
    full = shorten(landscape, here, selected=larger, nugget=nugget)
    return full if full.score(threshold) > chain.score(threshold) - 1e-3 else chain


def _outside(landscape: Landscape, here: Optimum, selected: tuple[int, ...]) -> list[int]:
    """The units without a theta, the one that promises most first."""
    scores = standard_scores(landscape, here)
    return sorted((u for u in range(landscape.n_units) if u not in selected), key=lambda u: (-scores[u], u))
