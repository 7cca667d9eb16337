"""Which rows of a history matter: local peaks in time, their neighbours, and peaks that a step would raise.

A maximum over time is not smooth where two peaks are equal, and its gradient at one node says nothing about
the peak next to it: the master therefore carries a row for every local peak of every scenario, and rows for
nodes around each so that a peak may move in time.
"""

import numpy as np
from numpy.typing import NDArray

__all__ = ["count_active", "local_peaks", "neighbours", "rows_with_neighbours"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_ACTIVE = 0.01
_NODES = 130  # of a history from one neighbour to the next, so many at most


def local_peaks(values: Array, *, above: float = -np.inf) -> Rows:
    """Rows (in `values.ravel()`) of the local maxima of each scenario that lie above a level.

    values: (scenarios, nodes). An end of the history counts when it is higher than its only neighbour.

    >>> import numpy as np
    >>> local_peaks(np.array([[0.0, 2.0, 1.0, 3.0]]))
    array([1, 3])
    """
    padded = np.pad(values, ((0, 0), (1, 1)), constant_values=-np.inf)
    inner = padded[:, 1:-1]
    # equal neighbours (a flat history, a rest before the motion) count once, at the later node
    peak = (inner >= padded[:, :-2]) & (inner > padded[:, 2:]) & (inner >= above)
    return np.flatnonzero(peak.ravel())


def rows_with_neighbours(values: Array, peaks: Rows, offsets: tuple[int, ...]) -> Rows:
    """The peaks and the nodes at the offsets around them, inside their own scenario."""
    nodes = values.shape[1]
    scenario, node = np.divmod(peaks, nodes)
    around = node[:, None] + np.array(offsets)[None, :]
    inside = (around >= 0) & (around < nodes)
    return np.unique((scenario[:, None] * nodes + around)[inside])


def neighbours(nodes: int) -> tuple[int, ...]:
    """Offsets of a peak and of the nodes around it that get rows, in a history of so many nodes.

    >>> neighbours(1), neighbours(401)
    ((0,), (-6, -3, 0, 3, 6))
    """
    apart = max(1, round(nodes / _NODES))
    return (0,) if nodes == 1 else (-2 * apart, -apart, 0, apart, 2 * apart)


def count_active(values: Array) -> int:
    """Local peaks within one per cent of the largest."""
    top = float(values.max())
    return len(local_peaks(values, above=top - _ACTIVE * abs(top)))
