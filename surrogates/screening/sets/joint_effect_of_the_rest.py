"""Do the inputs that were not selected still act together?

Many weak inputs, each too weak to pay for a theta of its own, may matter together. They get one common
theta, as in the published screening; how far l rises is what the selection leaves unsaid.
"""

import numpy as np

from ..partitions.optimum import Landscape, Optimum
from .forward import split

__all__ = ["rest_gain"]

COMMON = (-7.0, -4.0, -2.0, 0.0)  # log theta of the rest, from nearly inert to wild


def rest_gain(
    landscape: Landscape, selected: tuple[int, ...], phi: np.ndarray, nugget: tuple[float, float]
) -> float:
    """Rise of l when all units beside `selected` share a theta instead of having none; never negative.

    `phi`: log theta of the selected units and log nugget, at the maximum for them alone or near it.
    """

    def climbed(partition: tuple[tuple[int, ...], ...], start: np.ndarray) -> Optimum:
        return landscape.climb(partition, start, nugget=nugget, tolerance=1e-2, max_evaluations=60)

    if len(selected) == landscape.n_units:
        return 0.0
    alone = climbed(tuple((u,) for u in selected), phi)
    start = alone.phi
    ends = [
        climbed(split(landscape.n_units, selected), np.concatenate([start[:-1], [common], start[-1:]])).value
        for common in COMMON
    ]
    return max(0.0, max(ends) - alone.value)
