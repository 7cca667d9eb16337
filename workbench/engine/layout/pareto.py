"""Sets of values of several objectives, all to be small: which are dominated, how much they cover, the
knee."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["hypervolume", "knee_point", "pareto_filter"]

Array = NDArray[np.float64]


def pareto_filter(values: Any) -> NDArray[np.bool_]:
    """(points,): True where no other point is at least as good in all objectives and better in one.

    Of equal points the first one stays.

    >>> pareto_filter([[1, 3], [2, 2], [3, 3], [2, 2]])
    array([ True,  True, False, False])
    """
    v = np.asarray(values, dtype=float)
    at_least = (v[:, None, :] <= v[None, :, :]).all(axis=2)
    better = (v[:, None, :] < v[None, :, :]).any(axis=2)
    earlier = np.arange(len(v))[:, None] < np.arange(len(v))[None, :]
    return np.asarray(~(at_least & (better | earlier)).any(axis=0))


def hypervolume(values: Any, reference: Any) -> float:
    """Volume dominated by the points up to the reference point; points beyond it count nothing.

    Slicing along the last objective: exact for any number of objectives, meant for small sets.

    >>> hypervolume([[1, 2], [2, 1]], [3, 3])
    3.0
    """
    ref = np.asarray(reference, dtype=float)
    v = np.asarray(values, dtype=float).reshape(-1, len(ref))
    v = v[(v < ref).all(axis=1)]
    if len(v) == 0:
        return 0.0
    v = v[pareto_filter(v)]
    if len(ref) == 1:
        return float(ref[0] - v[:, 0].min())
    order = np.argsort(v[:, -1])
    v = v[order]
    levels = np.r_[v[:, -1], ref[-1]]
    return float(
        sum((levels[i + 1] - levels[i]) * hypervolume(v[: i + 1, :-1], ref[:-1]) for i in range(len(v)))
    )


def knee_point(values: Any) -> int:
    """Index of the point farthest below the plane through the best points of each objective, ranges scaled
    to 1.

    >>> knee_point([[0.0, 1.0], [0.1, 0.2], [1.0, 0.0]])
    1
    """
    v = np.asarray(values, dtype=float)
    low, span = v.min(axis=0), np.ptp(v, axis=0)
    scaled = (v - low) / np.where(span > 0, span, 1.0)
    return int(np.argmin(scaled.sum(axis=1)))  # the normal of that plane is (1, ..., 1) in scaled ranges
