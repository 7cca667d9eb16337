"""D-optimal designs in the dissertation's sense, its sentence read in three ways and named apart.

"Select calibration samples from a list of I candidates ... by maximizing det(X'X)" (section 3.2, after
Mitchell 1974). `d_optimal_select` takes it literally: rows of a pool of Latin hypercube points, no longer a
Latin hypercube.
"""

import numpy as np

from doe.exchange import fedorov, padded
from doe.models import Floats, Model, model_matrix

__all__ = ["d_optimal_select"]


def d_optimal_select(
    n: int, d: int, *, model: Model = "linear", pool: int = 1000, starts: int = 10, rng: np.random.Generator
) -> Floats:
    """The n points of a Latin hypercube of `pool` points that maximise det(X'X): (n, d) in [0, 1].

    The points move to the corners of the cube and are no Latin hypercube any more: each column has lost its
    one-point-per-stratum property and the design its even spread. The best of `starts` exchange searches.

    >>> rng = np.random.default_rng(1)
    >>> points = d_optimal_select(12, 3, pool=120, rng=rng)
    >>> points.shape, bool(np.abs(points - 0.5).mean() > 0.3)
    ((12, 3), True)

    Raises: ValueError when n < p terms, pool < n or the model is unknown.
    """
    if n < 1 or d < 1:
        raise ValueError(f"n and d need whole numbers >= 1, got n={n} and d={d}")
    if pool < n:
        raise ValueError(f"pool needs at least n={n} points to choose from, got pool={pool}")
    if starts < 1:
        raise ValueError(f"starts needs a whole number >= 1, got {starts}")
    strata = rng.permuted(np.tile(np.arange(pool), (d, 1)), axis=1).T
    points = np.ascontiguousarray((strata + rng.random((pool, d))) / pool)
    x = model_matrix(points, model=model)
    if n < x.shape[1]:
        raise ValueError(
            f"n={n} runs cannot estimate the {x.shape[1]} terms of the model in {d} factors;"
            f" ask for n >= {x.shape[1]} or a smaller model"
        )
    f = padded(x)
    found = [fedorov(f, x.shape[1], n, rng=child) for child in rng.spawn(starts)]
    design, _ = max(found, key=lambda pair: pair[1])
    return points[np.sort(design)]
