"""What counts as a gain: by how much a run must exceed the worst so far to be progress.

An engineer asks for two accuracies at once, a share of the spread of the response and a share of its value;
a gain that reaches the smaller of the two is worth a run. Where the worst value is nearly zero the second
asks for ever smaller gains, which a floor ends.
"""

import numpy as np

__all__ = ["accuracy_scale", "noticeable_gain", "runs_since_gain"]

SHARE = 3e-3  # of the scale: a smaller gain is no progress
FLOOR = 3e-4  # of the spread: the smallest scale


def accuracy_scale(v: np.ndarray) -> float:
    """What accuracies are shares of, for values v (n,) that are to be maximised.

    The smaller of the size of the largest value and the spread, the distance from the median to the largest
    value, where the search happens.

    >>> accuracy_scale(np.array([0.0, 10.0, 20.0, 30.0, 100.0]))
    80.0
    """
    best = float(v.max())
    spread = best - float(np.median(v))
    return max(min(spread, abs(best)), FLOOR * spread)


def noticeable_gain(v: np.ndarray) -> float:
    """The smallest gain over max(v) that counts as progress."""
    return SHARE * accuracy_scale(v)


def runs_since_gain(v: np.ndarray, gain: float) -> int:
    """Runs since the largest of the values v (n,), in the order made, last rose by more than `gain`.

    >>> runs_since_gain(np.array([0.0, 1.0, 0.5, 1.01]), 0.1)
    2
    """
    best, since = -np.inf, 0
    for value in v:
        since += 1
        if value > best + gain:
            best, since = float(value), 0
    return since
