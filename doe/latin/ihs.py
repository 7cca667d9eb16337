"""Improved distributed hypercube sampling (Beachkofski & Grandhi 2002, AIAA 2002-1274).

A Latin hypercube is built point by point: of many candidates that use free levels only, the one whose
distance to the nearest chosen point comes closest to a target spacing is taken. The published target is

    opt = n / n^(1/d)    in grid units, levels 1..n.

It falls below the nearest-neighbour distance of *random* points from about nine factors on, and then pulls
points together; `target="auto"` takes the third quartile of the random law instead.
"""

from decimal import Decimal, localcontext

import numpy as np
from numpy.typing import NDArray

from doe.latin import _kernels_ihs as kernels
from doe.latin.lhs import checked_size, points_in_cells
from doe.latin.swaps import polished
from doe.portable.draws import Draws, level_permutations, splitmix, splitmix_at

__all__ = ["auto_spacing", "ihs", "ihs_cells", "published_spacing"]

Floats = NDArray[np.float64]
TARGETS = ("published", "auto")
PLACEMENTS = ("centred", "random")
# quantile of the random nearest-neighbour law: above its mean for every n and d, and low enough that the last
# points, which have no choice, still keep a larger minimum distance than a random design
QUANTILE = 0.75
SAMPLES = 2048
LARGEST_SAMPLE = 4096


def ihs(
    n: int,
    d: int,
    *,
    duplication: int = 5,
    target: str = "published",
    pool: int | None = None,
    polish: int = 0,
    placement: str = "centred",
    rng: np.random.Generator,
) -> Floats:
    """An improved distributed hypercube sample, (n, d) in (0, 1): a Latin hypercube.

    duplication: candidates per step and free level    target: "published" spacing or "auto"
    pool: at most this many candidates per step (None: all, as published; a cap for n in the thousands)
    polish: swaps that lower phi_p afterwards    placement: "centred" in the cells, or "random" inside them

    >>> points = ihs(8, 3, rng=np.random.default_rng(1))
    >>> np.sort(points * 8 - 0.5, axis=0)[:, 0].tolist()
    [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]

    Raises: ValueError for n, d or duplication < 1, a pool < 1, polish < 0, an unknown target or placement.
    """
    if target not in TARGETS:
        raise ValueError(f"target needs one of {', '.join(TARGETS)}, got {target!r}")
    if placement not in PLACEMENTS:
        raise ValueError(f"placement needs one of {', '.join(PLACEMENTS)}, got {placement!r}")
    if polish < 0:
        raise ValueError(f"polish needs a number of swaps >= 0, got {polish}")
    n, d = checked_size(n, d)
    draws = splitmix(rng)
    spacing = published_spacing(n, d) if target == "published" else auto_spacing(n, d)
    cells = ihs_cells(n, d, duplication=duplication, spacing=spacing, pool=pool, draws=draws) - 1
    if polish:
        cells = polished(cells, polish, draws=draws)
    if placement == "random":
        return points_in_cells(cells, draws)
    return np.ascontiguousarray((cells + 0.5) / n)


def ihs_cells(
    n: int,
    d: int,
    *,
    duplication: int = 5,
    spacing: float | None = None,
    pool: int | None = None,
    draws: Draws,
) -> NDArray[np.int32]:
    """The cells 1..n of an IHS, (n, d), drawn from a generator of `doe.portable.draws`.

    With `park_miller(seed)` these are the published runs, draw by draw.

    >>> from doe.portable.draws import park_miller
    >>> ihs_cells(5, 2, draws=park_miller(17)).T.tolist()
    [[2, 5, 4, 3, 1], [4, 5, 3, 1, 2]]
    """
    n, d = checked_size(n, d)
    if duplication < 1:
        raise ValueError(f"duplication needs a whole number >= 1, got {duplication}")
    if pool is not None and pool < 1:
        raise ValueError(f"pool needs at least one candidate per step, got {pool}; use None for all")
    out = np.empty((n, d), dtype=np.int32)
    target = published_spacing(n, d) if spacing is None else float(spacing)
    kernels.cells(n, d, duplication, target, pool or 0, draws, out)
    return out


def published_spacing(n: int, d: int) -> float:
    """n^(1 - 1/d), correctly rounded on every platform.

    >>> published_spacing(64, 3)
    16.0
    """
    with localcontext() as context:
        context.prec = 40
        return float(Decimal(n) / Decimal(n) ** (Decimal(1) / Decimal(d)))


def auto_spacing(n: int, d: int) -> float:
    """Third quartile of the nearest-neighbour distance in random Latin hypercubes, in grid units.

    A function of n and d alone: its own draws start from the same state every time. Beyond 4096 runs the
    distance to the nearest of n - 1 is taken from a sample of the runs.

    >>> published_spacing(50, 20) < 0.7 * auto_spacing(50, 20)
    True
    """
    if n == 1:
        return 1.0
    draws = splitmix_at(n * 2**32 + d)
    found: list[NDArray[np.float64]] = []
    while sum(map(len, found)) < SAMPLES:
        levels = level_permutations(n, d, draws)
        rows = np.arange(n) if n <= LARGEST_SAMPLE else np.arange(SAMPLES // 8)
        found.append(np.sqrt(kernels.nearest_squares(levels, rows)))
        if n > LARGEST_SAMPLE:
            break
    return float(np.quantile(np.concatenate(found), QUANTILE))
