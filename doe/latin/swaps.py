"""Swap search over designs whose columns hold prescribed levels, and what it found.

Threshold accepting (Dueck & Scheuer 1990) over exchanges of two entries of one column, as in Morris &
Mitchell (1995): a worse design passes while it costs less than a bar that falls geometrically. The criteria
are compared on one scale, relative changes:

    F = w_phi phi_p/phi_p0 + w_cd2 CD2/CD2_0 + w_maxpro psi/psi_0 + w_r rho,    rho = (mean r^8)^(1/8),

linearised about the reference values with index 0. One per cent of any of the first three and a correlation
of 0.01 then weigh the same when the weights are equal.
"""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from doe.criteria.spread import (
    cd2,
    check_power,
    max_correlation,
    maxpro,
    phi_p,
)
from doe.latin._kernels_swap_criteria import centred_state, centred_value
from doe.latin.columns import CRITERIA, Columns, Feasible
from doe.latin.swap_state import SwapState
from doe.portable.draws import Draws

__all__ = ["SWAPS", "SwapResult", "check_budget", "check_weights", "polished", "swap_search"]

Floats = NDArray[np.float64]
SWAPS = 100_000  # trials unless asked for
LARGEST_RUNS = 8192  # the n x n tables of the criteria: 0.8 GB with all three
# trials that only go down, before the annealing: one per entry of the design, within these shares of all
QUENCH = (0.1, 0.5)
# levels two swapped entries may be apart, as a share of n, at the start and at the end of the annealing: near
# swaps change little and so are accepted still when the bar is low
WIDE, NARROW = 0.3, 0.03
FREEZE = 0.05  # and after it
# first bar, a relative change of the criterion, times n (d/8)^2; found on 20x2 to 500x20, no size is special
START_HEAT = np.array([0.025, 0.15, 0.15, 0.025])
COOLED = 1e-2  # last bar over the first
PROBE = 512
SHORTEST = 0.01  # seconds that a measurement of the speed takes at least
SHARE = 0.8  # of the seconds asked for: the rest covers set-up and a busy machine


@dataclass(frozen=True, slots=True, kw_only=True)
class SwapResult:
    """A design found by swaps.

    points: (n, d)    entries: (n, d) position of each value in the sorted levels of its column
    swaps: trials made; the same number and the same generator give the same design
    accepted: trials that passed    values: the criteria of the design
    alone: what a search of each criterion by itself reached on the way, when there are several
    """

    points: Floats
    entries: NDArray[np.int32]
    swaps: int
    accepted: int
    values: Mapping[str, float]
    alone: Mapping[str, float]


def swap_search(
    columns: Columns,
    entries: NDArray[np.int32],
    *,
    criterion: str | Sequence[str],
    weights: Sequence[float] | None = None,
    swaps: int | None = None,
    seconds: float | None = None,
    p: int = 10,
    groups: NDArray[np.int64] | None = None,
    feasible: Feasible | None = None,
    heat: float = 1.0,
    reference: Mapping[str, float] | None = None,
    draws: Draws,
) -> SwapResult:
    """Rearrange the columns from `entries` (d, n) on; swaps stay inside each group of runs.

    groups: (g, 2) first run and number of runs; runs in no group stay as they are.
    feasible: points (m, d) -> truth values; a swap passes only when both runs are feasible afterwards.
    heat: first bar as a multiple of the usual one; 0 goes only down
    reference: what several criteria are relative to; short searches of each alone find it where it is None,
    or runs coincide in `entries`
    """
    names, shares = check_weights(criterion, weights)
    check_power(p)
    n = columns.levels.shape[1]
    if n > LARGEST_RUNS and names != ("correlation",):
        raise ValueError(
            f"a swap search holds tables of n x n numbers and takes n <= {LARGEST_RUNS}, got n={n};"
            " use criterion='correlation', or doe.decorrelated_lhs"
        )
    swapped = np.array([[0, n]], dtype=np.int64) if groups is None else groups

    def search(which: Sequence[str], generator: Draws) -> SwapState:
        return SwapState(
            columns,
            entries,
            names=which,
            p=p,
            groups=swapped,
            draws=generator,
            positions=feasible is not None,
        )

    first = search(names, draws)
    total = check_budget(swaps, seconds, lambda: _rate(search(names, draws.copy()), feasible))
    alone = dict(reference or {})
    about = first.criteria.values.copy()
    spent = 0
    accepted = 0
    start = values_of(columns, entries, names, p)
    if len(names) > 1 and reference is not None and all(np.isfinite(v) for v in start.values()):
        for name, power in (("phi_p", p), ("cd2", 1), ("maxpro", len(columns.levels))):
            if name in names:  # the kernels add up powers of phi_p and MaxPro
                # rounded, and no `**`: last bits differ between processors, and must not reach a decision
                share = np.rint(reference[name] / start[name] * 2**20) / 2**20
                about[CRITERIA.index(name)] *= math.prod([share] * power)
        anneal(first, total, shares, heat, feasible, about)
    elif len(names) > 1:
        part = total // (4 * len(names))
        for name in names:
            single = search((name,), draws)
            anneal(single, part, np.where(single.criteria.on, 1.0, 0.0), heat, feasible)
            spent += part
            accepted += int(single.progress[1])
            alone.update(values_of(columns, single.best.entries, (name,), p))
            c = CRITERIA.index(name)
            about[c] = single.best.values[c] * first.criteria.scales[c] / single.criteria.scales[c]
        anneal(first, total - spent, shares, heat, feasible, about)
    else:
        anneal(first, total, shares, heat, feasible)
    points = columns.points(first.best.entries)
    return SwapResult(
        points=points,
        entries=np.ascontiguousarray(first.best.entries.T),
        swaps=total,
        accepted=accepted + int(first.progress[1]),
        values=values_of(columns, first.best.entries, names, p),
        alone=alone,
    )


def anneal(
    search: SwapState,
    trials: int,
    shares: Floats,
    heat: float,
    feasible: Feasible | None,
    reference: Floats | None = None,
) -> None:
    """Go down, anneal about what was reached, go down again."""
    d, n = search.design.x.shape
    least, most = QUENCH
    quench, freeze = int(min(max(n * d, least * trials), most * trials)), int(FREEZE * trials)
    search.weigh(shares, search.criteria.values if reference is None else reference)
    search.run(quench, heat=0.0, cooled=1.0, feasible=feasible)
    search.back_to_best()
    search.weigh(shares, search.criteria.values if reference is None else reference)
    bar = heat * float(START_HEAT @ shares / np.count_nonzero(shares)) * (8.0 / d) ** 2 / n
    slow = trials - quench - freeze
    search.run(slow, heat=bar, cooled=COOLED, wide=WIDE, narrow=NARROW, feasible=feasible)
    search.back_to_best()
    search.run(freeze, heat=0.0, cooled=1.0, wide=NARROW, narrow=NARROW, feasible=feasible)


def _rate(probe: SwapState, feasible: Feasible | None) -> float:
    """Trials per second, measured on a search with a generator of its own."""
    if probe.idle:
        return 1.0  # there is nothing to swap
    probe.weigh(np.where(probe.criteria.on, 1.0, 0.0), probe.criteria.values)
    probe.run(1, heat=0.0, cooled=1.0, feasible=feasible)
    count = PROBE
    while True:
        begin = time.perf_counter()
        probe.run(count, heat=0.0, cooled=1.0, feasible=feasible)
        elapsed = time.perf_counter() - begin
        if elapsed > SHORTEST:
            return count / elapsed
        count *= 4


def check_budget(swaps: int | None, seconds: float | None, rate: Callable[[], float]) -> int:
    """Number of trials: `swaps`, or as many as fit into `seconds` at the measured rate.

    Raises: ValueError when both or neither are given, or either is negative.
    """
    if (swaps is None) == (seconds is None):
        raise ValueError(f"a search needs either swaps or seconds, got swaps={swaps} and seconds={seconds}")
    if swaps is not None:
        if swaps < 0:
            raise ValueError(f"swaps needs a whole number >= 0, got {swaps}")
        return int(swaps)
    assert seconds is not None
    if not seconds > 0.0:
        raise ValueError(f"seconds needs a positive number, got {seconds}")
    return max(1, int(SHARE * seconds * rate()))


def check_weights(
    criterion: str | Sequence[str], weights: Sequence[float] | None
) -> tuple[tuple[str, ...], Floats]:
    """Names of the criteria and their weights in the order of CRITERIA.

    Raises: ValueError for an unknown or repeated name, or weights that do not fit.
    """
    names = (criterion,) if isinstance(criterion, str) else tuple(criterion)
    for name in names:
        if name not in CRITERIA:
            raise ValueError(f"criterion needs {', '.join(CRITERIA)}, or several of them, got {name!r}")
    if not names or len(set(names)) < len(names):
        raise ValueError(f"criterion needs at least one name and each once, got {names}")
    given = [1.0] * len(names) if weights is None else [float(w) for w in weights]
    if len(given) != len(names) or not all(w > 0.0 and np.isfinite(w) for w in given):
        raise ValueError(f"weights needs one positive number per criterion {names}, got {weights}")
    shares = np.zeros(4)
    for name, weight in zip(names, given, strict=True):
        shares[CRITERIA.index(name)] = weight
    return names, shares


def values_of(
    columns: Columns, entries: NDArray[np.integer], names: Sequence[str], p: int
) -> dict[str, float]:
    """The named criteria of a design, entries (d, n), as `doe.criteria.spread` has them.

    Levels without an order are what they are to the search: unlike ones a whole range apart, each at an end
    for CD2, and not correlated. MaxPro of levels that repeat is infinite.
    """
    points = columns.points(entries)
    known = {
        "phi_p": lambda: phi_p(_apart(columns, points), p=p),
        "cd2": lambda: _centred(columns, points) if columns.nominal.any() else cd2(points),
        "maxpro": lambda: maxpro(points),
        "correlation": lambda: max_correlation(points[:, ~columns.nominal]),
    }
    return {name: known[name]() for name in names}


def _apart(columns: Columns, points: Floats) -> Floats:
    """Points with a column per level of a nominal one, in which unlike levels are at the distance 1."""
    if not columns.nominal.any():
        return points
    parts = [points[:, ~columns.nominal]]
    for k in np.flatnonzero(columns.nominal):
        parts.append((points[:, [k]] == np.unique(columns.levels[k])) / np.sqrt(2.0))
    return np.hstack(parts)


def _centred(columns: Columns, points: Floats) -> float:
    """CD2 where nominal levels lie at the ends, any two of them on opposite sides."""
    n, d = points.shape
    products, singles = np.empty((n, n)), np.empty((2, n))
    centred_state(np.ascontiguousarray(points.T), columns.nominal, products, singles)
    return float(centred_value(products, singles, float((13 / 12) ** d)))


def polished(cells: NDArray[np.integer], swaps: int, *, draws: Draws) -> NDArray[np.int32]:
    """The cells 0..n-1 (n, d) of a Latin hypercube after swaps that only lower phi_p."""
    n, d = cells.shape
    levels = np.tile((np.arange(n) + 0.5) / n, (d, 1))
    columns = Columns(levels=levels, nominal=np.zeros(d, np.bool_))
    entries = np.ascontiguousarray(cells.T, dtype=np.int32)
    found = swap_search(columns, entries, criterion="phi_p", swaps=swaps, heat=0.0, draws=draws)
    return found.entries
