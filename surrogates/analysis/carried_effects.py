"""Main effects of a response that was modelled on another scale: E[y | x_k] with y = T^-1(path).

No average of T^-1 is a product of one-dimensional sums, so points of the other inputs are drawn, the same
for every value of x_k. The mean path is looked at on many more points, and what few points make of it is
taken off all paths.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from .paths import Paths, Sampled, product_of, without_each

__all__ = ["carried_curves"]

Array = NDArray[np.float64]

POINTS, POINTS_OF_MEAN = 128, 2048


def carried_curves(
    paths: Paths, places: Sequence[Array | None], back: Callable[[Array], Array]
) -> list[Array | None]:
    """Of each input with `places` (g,) of scaled values: mean of `back` over the others, (g, 1 + draws)."""
    few = _curves(paths, places, back, POINTS, mean_only=False)
    many = _curves(paths, places, back, POINTS_OF_MEAN, mean_only=True)
    return [None if f is None or m is None else f + (m - f[:, :1]) for f, m in zip(few, many, strict=True)]


def _curves(
    paths: Paths,
    places: Sequence[Array | None],
    back: Callable[[Array], Array],
    points: int,
    *,
    mean_only: bool,
) -> list[Array | None]:
    found: list[Array | None] = [None] * len(places)
    factors = Sampled(paths, points, mean_only=mean_only)
    for k, others in without_each(factors, range(len(factors))):
        u = places[k]
        if u is not None:
            smooth, wave = paths.parts(k, u)
            parts = smooth, wave[:, : 0 if mean_only else None]
            found[k] = back(paths.grid(product_of(others, parts), parts)).mean(axis=0).T
    return found
