"""Which cases are tops among those that were run: peaks of their own as far as the runs can tell.

    case i is a top  <=>  none of the d + 1 runs nearest to it, by the largest difference of a coordinate,
                          is worse

The worst cases of a draw may all stand on one broad peak while a narrow one, a little lower at the case that
met it, is the higher of the two. A climb from each case of the first finds its top again; the second is told
by its neighbours, none of which is worse. In many inputs every neighbour is far, and little depends on it
(`docs/decisions/0319-climbs-begin-at-tops.md`).

Rinnooy Kan and Timmer 1987 (multi level single linkage) start local searches by the same thought, within a
distance that shrinks with the number of cases.
"""

import numpy as np

__all__ = ["is_top"]


def is_top(i: int, points: np.ndarray, values: np.ndarray) -> bool:
    """Whether none of the d + 1 runs next to run i is worse: unit `points` (n, d), signed `values` (n,).

    >>> u = np.array([[0.1], [0.2], [0.3], [0.7], [0.8], [0.9]])
    >>> [is_top(i, u, np.array([1.0, 5.0, 4.5, 1.0, 4.0, 2.0])) for i in range(6)]
    [False, True, False, False, True, False]
    """
    away = np.abs(points - points[i]).max(axis=1)
    beside = min(points.shape[1] + 2, len(points))  # with itself
    nearest = np.argpartition(away, beside - 1)[:beside]
    return bool(values[nearest].max() <= values[i])
