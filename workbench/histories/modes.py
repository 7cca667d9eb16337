"""Principal components of histories: the shapes by which runs differ from their mean, with their shares.

    y_i(t) = mean(t) + sum_k s_ik phi_k(t),    (1/T) int phi_k phi_l dt = 1 if k = l, else 0

The shapes are those that leave the least mean square difference for every number of them; the share of phi_k
is the variance of its scores over the variance of all, both in the mean over time. A score has the unit of
the response. The integral is the trapezoidal rule over the samples, so steps of different lengths count as
long as they are. Ramsay and Silverman, Functional Data Analysis, 2nd edition 2005, chapter 8.

A shape has no sign of its own: here its value of largest size is positive.
"""

from dataclasses import dataclass

import numpy as np

from workbench.errors import NotEnoughRuns

__all__ = ["Modes", "modes_of", "time_weights"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Modes:
    """The first modes of histories.

    times, weights, mean: (m,)    shapes: (k, m)    shares: (k,), of all variance    deviations: (k,), the
    standard deviation of the scores, in the unit of the response    runs: how many they were found from
    """

    times: np.ndarray
    weights: np.ndarray
    mean: np.ndarray
    shapes: np.ndarray
    shares: np.ndarray
    deviations: np.ndarray
    runs: int

    def scores(self, values: np.ndarray) -> np.ndarray:
        """Scores (n, k) of histories (n, m) over the same times, also of runs the modes were not made of."""
        found: np.ndarray = ((values - self.mean) * self.weights) @ self.shapes.T
        return found


def time_weights(times: np.ndarray) -> np.ndarray:
    """Weights (m,) of the trapezoidal rule over `times`, whose sum is one.

    >>> time_weights(np.array([0.0, 1.0, 4.0])).tolist()
    [0.125, 0.5, 0.375]
    """
    if len(times) < 2 or times[-1] <= times[0]:
        return np.full(len(times), 1 / max(1, len(times)))
    steps = np.diff(times)
    weights = np.zeros(len(times))
    weights[:-1] += steps / 2
    weights[1:] += steps / 2
    total: float = times[-1] - times[0]
    return weights / total


def modes_of(values: np.ndarray, times: np.ndarray, *, count: int) -> Modes:
    """The first `count` modes, fewer where the runs have fewer.

    Args:    values: (n, m), finite    times: (m,), rising

    Raises:
        NotEnoughRuns: fewer than two runs, or runs that do not differ.
    """
    n = len(values)
    if n < 2:
        raise NotEnoughRuns(f"modes need two histories or more, got {n}")
    weights = time_weights(times)
    mean = values.mean(axis=0)
    scaled = (values - mean) * np.sqrt(weights)
    _, sizes, rows = np.linalg.svd(scaled, full_matrices=False)
    total = float((sizes**2).sum())
    alike = n * float(np.sqrt(weights @ mean**2)) * 1e-14
    if sizes[0] <= alike:
        raise NotEnoughRuns(f"the {n} histories are the same: they have no modes")
    kept = min(count, int((sizes > max(alike, 1e-14 * sizes[0])).sum()))
    with np.errstate(divide="ignore", invalid="ignore"):
        shapes = np.where(weights > 0, rows[:kept] / np.sqrt(weights), 0.0)
    largest = shapes[np.arange(kept), np.abs(shapes).argmax(axis=1)]
    shapes *= np.sign(largest)[:, None]
    return Modes(
        times=times,
        weights=weights,
        mean=mean,
        shapes=shapes,
        shares=sizes[:kept] ** 2 / total,
        deviations=sizes[:kept] / np.sqrt(n - 1),
        runs=n,
    )
