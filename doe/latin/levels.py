"""Designs whose columns hold prescribed levels: integer, discrete, binary and nominal factors together.

The levels of a column are fixed first, each as often as the others as far as n allows; the search then only
rearranges columns, so that balance is never lost and nothing is rounded afterwards.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from doe.criteria.spread import unit_points
from doe.latin.columns import Columns, Feasible
from doe.latin.lhs import checked_size
from doe.latin.swaps import (
    SWAPS,
    SwapResult,
    swap_search,
)
from doe.portable import _kernels_draws as generator
from doe.portable.draws import Draws, level_permutations, splitmix

__all__ = ["balanced_levels", "optimised_levels", "rearrange"]

Floats = NDArray[np.float64]
ATTEMPTS = 60  # batches of proposals per run before a constraint counts as not satisfiable
BATCH = 64


def balanced_levels(levels: int | ArrayLike | None, n: int) -> Floats:
    """n values in [0, 1], sorted: None for n strata, m for levels k/(m - 1), or the levels themselves.

    Each level comes floor(n/m) or ceil(n/m) times, the more frequent ones spread evenly; of more levels than
    runs, n evenly spread ones are taken.

    >>> balanced_levels(3, 7).tolist(), balanced_levels(None, 2).tolist()
    ([0.0, 0.0, 0.5, 0.5, 0.5, 1.0, 1.0], [0.25, 0.75])

    Raises: ValueError for no levels, levels outside [0, 1], not finite or given twice.
    """
    if levels is None:
        return np.asarray((np.arange(n) + 0.5) / n)
    if isinstance(levels, int | np.integer):
        if levels < 1:
            raise ValueError(f"levels of a column needs at least one level, got {levels}")
        values = np.linspace(0.0, 1.0, int(levels)) if levels > 1 else np.array([0.5])
    else:
        values = np.sort(np.asarray(levels, dtype=np.float64).ravel())
    m = len(values)
    if m == 0:
        raise ValueError("levels of a column needs at least one level, got none")
    if not (np.isfinite(values).all() and values[0] >= 0.0 and values[-1] <= 1.0):
        raise ValueError(f"levels of a column needs finite positions in [0, 1], got {values.tolist()}")
    if m > 1 and np.min(np.diff(values)) == 0.0:
        raise ValueError(f"levels of a column needs each level once, got {values.tolist()}")
    counts = np.full(m, n // m)
    extra = n % m
    counts[((np.arange(extra) + 0.5) * m / max(extra, 1)).astype(int)] += 1
    return np.repeat(values, counts)


def optimised_levels(
    levels: Sequence[int | ArrayLike | None],
    n: int,
    *,
    nominal: Sequence[int] = (),
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    feasible: Feasible | None = None,
    rng: np.random.Generator,
) -> SwapResult:
    """A design of n runs whose column k holds `levels[k]` in balance; see `balanced_levels`.

    nominal: columns whose levels have no order: two of them are as far apart as the ends of an ordered column
    feasible: a function from points (m, d) to m truth values; every run of the result satisfies it

    >>> found = optimised_levels([None, 2, 3], 6, swaps=500, rng=np.random.default_rng(1))
    >>> np.sort(found.points, axis=0)[:, 1:].T.tolist()
    [[0.0, 0.0, 0.0, 1.0, 1.0, 1.0], [0.0, 0.0, 0.5, 0.5, 1.0, 1.0]]

    Raises: ValueError for bad levels, and when no arrangement of them satisfies `feasible`.
    """
    if len(levels) == 0:
        raise ValueError("levels needs one entry per column, got none")
    n, d = checked_size(n, len(levels))
    table = np.stack([balanced_levels(column, n) for column in levels])
    draws = splitmix(rng)
    return _search(
        table,
        level_permutations(n, d, draws),
        nominal,
        criterion,
        weights,
        swaps,
        seconds,
        p,
        feasible,
        draws,
    )


def rearrange(
    points: ArrayLike,
    *,
    nominal: Sequence[int] = (),
    criterion: str | Sequence[str] = "phi_p",
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    feasible: Feasible | None = None,
    rng: np.random.Generator,
) -> SwapResult:
    """The same columns in another order: every column keeps its values, with repeats, and swaps places.

    >>> start = np.column_stack([np.linspace(0, 1, 9)] * 2)
    >>> found = rearrange(start, swaps=2000, rng=np.random.default_rng(1))
    >>> bool(np.array_equal(np.sort(found.points, axis=0), start)), round(found.values["phi_p"], 1)
    (True, 3.3)
    """
    array = unit_points(points)
    order = np.argsort(array, axis=0, kind="stable")
    entries = np.empty_like(order)
    np.put_along_axis(entries, order, np.arange(len(array))[:, None], axis=0)
    table = np.ascontiguousarray(np.sort(array, axis=0).T)
    draws = splitmix(rng)
    start = np.ascontiguousarray(entries.T, dtype=np.int32)
    return _search(table, start, nominal, criterion, weights, swaps, seconds, p, feasible, draws)


def _search(
    table: Floats,
    entries: NDArray[np.int32],
    nominal: Sequence[int],
    criterion: str | Sequence[str],
    weights: Sequence[float] | None,
    swaps: int | None,
    seconds: float | None,
    p: int,
    feasible: Feasible | None,
    draws: Draws,
) -> SwapResult:
    d, _ = table.shape
    unordered = np.zeros(d, np.bool_)
    for k in nominal:
        if not 0 <= k < d:
            raise ValueError(f"nominal needs column numbers in 0..{d - 1}, got {k}")
        unordered[k] = True
    columns = Columns(levels=np.ascontiguousarray(table), nominal=unordered)
    if feasible is not None:
        entries = feasible_start(columns, entries, feasible, draws=draws)
    return swap_search(
        columns,
        entries,
        criterion=criterion,
        weights=weights,
        swaps=SWAPS if swaps is None and seconds is None else swaps,
        seconds=seconds,
        p=p,
        feasible=feasible,
        draws=draws,
    )


def feasible_start(
    columns: Columns, entries: NDArray[np.int32], feasible: Feasible, *, draws: Draws
) -> NDArray[np.int32]:
    """Rearranged entries (d, n) whose runs all satisfy `feasible`.

    One infeasible run at a time: of a batch of random swaps with it, the one after which most of the two runs
    concerned are feasible is done, at worst one that changes nothing.

    Raises: ValueError with the largest feasible share seen when the attempts run out.
    """
    d, n = entries.shape
    entries = entries.copy()
    points = columns.points(entries)
    good = checked_feasible(feasible, points)
    most = int(good.sum())
    for _ in range(ATTEMPTS * n):
        bad = np.flatnonzero(~good)
        if bad.size == 0:
            return entries
        i = int(bad[generator.below(draws, bad.size)])
        ks = np.array([generator.below(draws, d) for _ in range(BATCH)])
        js = np.array([generator.below(draws, n) for _ in range(BATCH)])
        first, second = np.repeat(points[[i]], BATCH, axis=0), points[js].copy()
        at = np.arange(BATCH)
        first[at, ks], second[at, ks] = points[js, ks], points[i, ks]
        both = checked_feasible(feasible, np.vstack([first, second]))
        gain = both[:BATCH].astype(int) + both[BATCH:] - good[js]
        gain[(js == i) | (points[js, ks] == points[i, ks])] = -2
        best = int(np.argmax(gain))
        if gain[best] < 0:
            continue
        k, j = int(ks[best]), int(js[best])
        entries[k, [i, j]] = entries[k, [j, i]]
        points[i], points[j] = first[best], second[best]
        good[i], good[j] = both[best], both[BATCH + best]
        most = max(most, int(good.sum()))
    raise ValueError(
        f"feasible is not satisfied by any arrangement found: at best {most} of {n} runs"
        f" ({100.0 * most / n:.0f} %) were feasible with these balanced levels. Loosen the constraint,"
        " or choose runs from a list of feasible candidates with doe.subset"
    )


def checked_feasible(feasible: Feasible, points: Floats) -> NDArray[np.bool_]:
    """The truth values of `feasible`.

    Raises: ValueError when it does not return one per point.
    """
    found = np.asarray(feasible(points))
    if found.shape != (len(points),):
        raise ValueError(
            f"feasible needs to return one truth value per point, shape ({len(points)},), got {found.shape}"
        )
    return np.asarray(found.astype(bool))
