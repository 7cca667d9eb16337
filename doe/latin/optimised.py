"""Optimised Latin hypercubes: swaps inside columns that improve one criterion or several at once."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from doe.latin.columns import Columns, Feasible
from doe.latin.lhs import checked_size
from doe.latin.swaps import (
    SWAPS,
    SwapResult,
    swap_search,
)
from doe.portable.draws import level_permutations, splitmix

__all__ = ["optimised_lhs", "search_lhs"]

Floats = NDArray[np.float64]


def optimised_lhs(
    n: int,
    d: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    rng: np.random.Generator,
) -> Floats:
    """A Latin hypercube with points in the middle of their strata, optimised by swaps: (n, d).

    criterion: phi_p | cd2 | maxpro | correlation, or several, traded off by `weights`: with equal weights
    one per cent of phi_p, of CD2, of MaxPro and a correlation of 0.01 weigh the same.
    swaps: trials (default 100 000)
    seconds: instead of swaps; `search_lhs` tells how many trials they bought
    p: power of phi_p, even; 20 or 40 chase the minimum distance alone

    >>> rng = np.random.default_rng(1)
    >>> points = optimised_lhs(16, 3, criterion=("phi_p", "correlation"), swaps=20_000, rng=rng)
    >>> bool(np.abs(np.corrcoef(points.T) - np.eye(3)).max() < 0.02)
    True

    Raises: ValueError for n or d < 1, an unknown criterion, weights that do not fit, both swaps and seconds.
    """
    found = search_lhs(n, d, criterion=criterion, weights=weights, swaps=swaps, seconds=seconds, p=p, rng=rng)
    return found.points


def search_lhs(
    n: int,
    d: int,
    *,
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    feasible: Feasible | None = None,
    rng: np.random.Generator,
) -> SwapResult:
    """As `optimised_lhs`, with the record of the search: trials made, criteria reached.

    A run with a budget in seconds is replayed by the number of swaps it reports.

    >>> found = search_lhs(20, 4, seconds=0.05, rng=np.random.default_rng(3))
    >>> again = search_lhs(20, 4, swaps=found.swaps, rng=np.random.default_rng(3))
    >>> bool(np.array_equal(found.points, again.points))
    True
    """
    n, d = checked_size(n, d)
    draws = splitmix(rng)
    columns = Columns(levels=np.tile((np.arange(n) + 0.5) / n, (d, 1)), nominal=np.zeros(d, np.bool_))
    return swap_search(
        columns,
        level_permutations(n, d, draws),
        criterion=criterion,
        weights=weights,
        swaps=SWAPS if swaps is None and seconds is None else swaps,
        seconds=seconds,
        p=p,
        feasible=feasible,
        draws=draws,
    )
