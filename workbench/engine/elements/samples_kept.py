"""Samples of functions of time, which are asked for once on each of the last grids of their owner."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np

__all__ = ["GRIDS", "sampled_once"]

Array = np.ndarray[Any, Any]
Samples = TypeVar("Samples")

GRIDS = 4  # that are kept: of a run and of its start, of longer and shorter steps


def sampled_once(kept: dict[bytes, Samples], times: Array, sampled: Callable[[Array], Samples]) -> Samples:
    """The samples on `times` (nodes,) out of `kept`, or those made now, which replace the oldest there.

    >>> kept = {}
    >>> first = sampled_once(kept, np.linspace(0.0, 1.0, 3), lambda t: 2.0 * t)
    >>> sampled_once(kept, np.linspace(0.0, 1.0, 3), lambda t: -t) is first
    True
    """
    grid = times.tobytes()
    found = kept.get(grid)
    if found is None:
        found = sampled(times)
        for old in list(kept)[: 1 - GRIDS]:
            kept.pop(old, None)  # runs in other threads may have taken it out
        kept[grid] = found
    return found
