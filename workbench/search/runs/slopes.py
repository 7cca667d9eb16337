"""A model's derivatives by parameter, as a slope over the unit cube."""

from collections.abc import Mapping

import numpy as np

from workbench.search.runs.unit_space import SearchSpace

__all__ = ["unit_slope"]

STEP = 1e-5  # of the unit interval


def unit_slope(where: SearchSpace, point: np.ndarray, given: Mapping[str, float]) -> np.ndarray | None:
    """dy/du (d,) at the unit point (d,) from the derivatives dy/dx `given` by name.

    NaN in coordinates with levels; None unless every continuous parameter has a finite derivative. dx/du is
    taken by a difference: it is not constant where the scale of a parameter is logarithmic.
    """
    slope = np.full(where.dimension, np.nan)
    free = [j for j, grid in enumerate(where.levels) if grid is None]
    for j in free:
        name = where.space.names[j]
        if name not in given:
            return None
        low, high = np.repeat(point[None], 2, axis=0)
        low[j], high[j] = max(point[j] - STEP, 0.0), min(point[j] + STEP, 1.0)
        a, b = where.rows(np.array([low, high]))
        slope[j] = given[name] * (b[name] - a[name]) / (high[j] - low[j])
    return slope if free and np.isfinite(slope[free]).all() else None
