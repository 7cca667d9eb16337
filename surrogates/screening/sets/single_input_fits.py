"""What each unit explains on its own: the share of the response's variance of a cubic in each of its inputs.

An input that acts through an interaction alone shows nothing here, one that acts through a difference of two
inputs shows a parabola. So this names units worth a look, and is no screening.
"""

import numpy as np
from numpy.typing import NDArray

from ..partitions.canonical import CanonicalRuns

__all__ = ["margins"]

Array = NDArray[np.float64]


def margins(runs: CanonicalRuns) -> Array:
    """(u,) R^2 of the response on the cubics, or on the labels, of each unit."""
    return np.array([_explained(runs, columns) for columns in runs.units])


def _explained(runs: CanonicalRuns, columns: tuple[int, ...]) -> float:
    parts = []
    for k in columns:
        x = runs.x[:, k]
        if k in runs.labels:
            parts.append((x[:, None] == np.unique(x)[None, 1:]).astype(float))
        else:
            parts.append(np.polynomial.legendre.legvander(2.0 * x - 1.0, 3)[:, 1:])
    basis = np.column_stack([np.ones(len(runs.y)), *parts])
    fitted = basis @ np.linalg.lstsq(basis, runs.y, rcond=None)[0]
    return float(np.var(fitted) / np.var(runs.y))
