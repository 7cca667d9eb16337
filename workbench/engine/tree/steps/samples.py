"""What a system keeps of its functions of time: their samples on the nodes of its last runs."""

from collections.abc import Callable
from typing import Any

import numpy as np

__all__ = ["GRIDS", "on_grid"]

Array = np.ndarray[Any, Any]
Samples = dict[str, Array]

GRIDS = 4  # that are kept: steps that are halved alternate with those asked for


def on_grid(kept: dict[bytes, Samples], times: Array, sampled: Callable[[Array], Samples]) -> Samples:
    """The samples on `times` (nodes,) out of `kept`, or those made now, which replace the oldest there.

    >>> kept = {}
    >>> first = on_grid(kept, np.linspace(0.0, 1.0, 3), lambda t: {"load": 2.0 * t})
    >>> on_grid(kept, np.linspace(0.0, 1.0, 3), lambda t: {}) is first
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
