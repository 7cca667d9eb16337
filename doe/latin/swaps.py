"""Swap search over designs whose columns hold prescribed levels, and what it found.

Threshold accepting (Dueck & Scheuer 1990) over exchanges of two entries of one column, as in Morris &
Mitchell (1995): a worse design passes while it costs less than a bar that falls geometrically. The criteria
are compared on one scale, relative changes:

    F = w_phi phi_p/phi_p0 + w_cd2 CD2/CD2_0 + w_maxpro psi/psi_0 + w_r rho,    rho = (mean r^8)^(1/8),

linearised about the reference values with index 0. One per cent of any of the first three and a correlation
of 0.01 then weigh the same when the weights are equal.
"""

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
from doe.latin import _kernels_swaps as kernels
from doe.portable.draws import Draws

__all__ = ["CRITERIA", "Columns", "SwapResult", "check_budget", "check_weights", "polished", "swap_search"]

Floats = NDArray[np.float64]
CRITERIA = ("phi_p", "cd2", "maxpro", "correlation")
LARGEST_RUNS = 8192  # the n x n tables of the criteria: 0.8 GB with all three
GRID_RANGE = 2**30  # squared distances in whole numbers stay below
FINEST = 2**12
REFRESH = 2**18  # trials after which rounding errors of the products are swept out; fewer at the start,
FIRST_CHUNK = 2**12  # where sums fall by orders of magnitude and need a finer whole scale
STAGES = 200
# trials that only go down, before the annealing: one per entry of the design, within these shares of all
QUENCH = (0.1, 0.5)
# levels two swapped entries may be apart, as a share of n, at the start and at the end of the annealing: near
# swaps change little and so are accepted still when the bar is low
WIDE, NARROW = 0.3, 0.03
FREEZE = 0.05  # and after it
# first bar, a relative change of the criterion, times n (d/8)^2; found on 20x2 to 500x20, no size is special
START_HEAT = np.array([0.025, 0.15, 0.15, 0.025])
COOLED = 1e-2  # last bar over the first
SCALE_BITS = 46
FAINT = 2.0**40  # a sum that fell below is measured in a finer unit
PROBE = 512
SHORTEST = 0.01  # seconds that a measurement of the speed takes at least
SHARE = 0.8  # of the seconds asked for: the rest covers set-up and a busy machine

Feasible = Callable[[Floats], NDArray[np.bool_]]
"""From points (m, d) in [0, 1] to m truth values."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Columns:
    """What a swap may rearrange: the levels of every column, with repeats, and which columns have no order.

    levels: (d, n) positions in [0, 1], sorted along each row    nominal: (d,) true for unordered levels
    """

    levels: Floats
    nominal: NDArray[np.bool_]

    def grid(self, names: Sequence[str]) -> tuple[NDArray[np.int32], int]:
        """Whole coordinates (d, n) for the criteria, and the coordinate that stands for 1.

        The levels of a Latin hypercube are whole numbers already; others are rounded so finely that squared
        distances stay below 2^30, or to 2^24 parts when only correlations are wanted.
        """
        d, n = self.levels.shape
        exact = names == ("correlation",) or d * n * n < GRID_RANGE
        if exact and np.array_equal(self.levels, np.broadcast_to((np.arange(n) + 0.5) / n, (d, n))):
            return np.tile(np.arange(n, dtype=np.int32), (d, 1)), n
        fine = min(int((GRID_RANGE / (2 * d)) ** 0.5), FINEST)
        if names == ("correlation",):
            fine = FINEST**2
        return np.rint(self.levels * fine).astype(np.int32), fine

    def points(self, entries: NDArray[np.integer]) -> Floats:
        """Points (n, d) of the entries (d, n)."""
        return np.ascontiguousarray(np.take_along_axis(self.levels, entries.astype(np.int64), axis=1).T)


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


class _Search:
    """The kernel's arrays for one set of columns; only `swap_search` builds one."""

    def __init__(
        self,
        columns: Columns,
        entries: NDArray[np.int32],
        *,
        names: Sequence[str],
        p: int,
        groups: NDArray[np.int64],
        draws: Draws,
        positions: bool,
    ) -> None:
        self.columns, self.names, self.h, self.draws, self.groups = columns, names, p // 2, draws, groups
        self.grid, reach = columns.grid(tuple(names))
        d, n = self.grid.shape
        self.apart, self.unit = reach * reach, float(np.exp(1.5)) / reach
        self.movable = np.flatnonzero(np.ptp(self.grid, axis=1) > 0).astype(np.int64)
        counts = 1 + np.count_nonzero(np.diff(self.grid, axis=1), axis=1)  # rows are sorted
        self.shifts = np.where(counts < n, np.exp(1.5) / counts, 0.0)
        ordered = ~columns.nominal & (counts > 1)
        self.on = np.array([c in names for c in CRITERIA])
        sizes = [(n, n) if c in names else (1, 1) for c in CRITERIA]
        self.squares = np.empty(sizes[0], np.int32)
        self.rows = np.empty(n, np.int64)
        self.products, self.singles = np.empty(sizes[1]), np.empty((2, n))
        self.gaps = np.empty(sizes[2])
        self.gram = np.empty((d, d))
        self.gram_weights = np.zeros((d, d))
        variances = ((self.grid - self.grid.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
        self.gram_weights[np.ix_(ordered, ordered)] = 1.0 / np.outer(variances[ordered], variances[ordered])
        self.pairs = max(d * (d - 1) / 2, 1.0)
        self.constant = float((13 / 12) ** d)
        self.scales, self.weights = np.ones(4), np.zeros(4)
        # S of phi_p, n^2 CD2, S of MaxPro, sum of r^8; that sum when last computed afresh, swaps since
        self.values = np.zeros(6)
        self.progress = np.zeros(7, np.int64)
        self.log = np.empty((max(64, n * d // 8), 3), np.int32)
        self.positions = positions or self.on[1]
        self.u = np.empty((1, 1))
        self.place(entries)

    def place(self, entries: NDArray[np.int32]) -> None:
        """Start from these entries (d, n)."""
        self.entries = np.ascontiguousarray(entries, dtype=np.int32).copy()
        self.best = self.entries.copy()
        self.best_values = np.full(5, np.inf)
        self.refresh(rescale=True)

    def refresh(self, *, rescale: bool = False) -> None:
        """All tables and values from the entries, free of accumulated rounding."""
        index = self.entries.astype(np.int64)
        self.holder = np.empty_like(self.entries)
        runs = np.arange(index.shape[1], dtype=np.int32)
        np.put_along_axis(self.holder, index, np.broadcast_to(runs, index.shape), axis=1)
        self.x = np.take_along_axis(self.grid, index, axis=1)
        if self.positions:
            self.u = np.take_along_axis(self.columns.levels, index, axis=1)
        nominal = self.columns.nominal
        n = self.x.shape[1]
        if self.on[0]:
            if rescale:
                self.rescale(0, scale_for(typical_sum(self.x, self.h)))
            total = self.distances()
            if total < FAINT:
                self.rescale(0, self.scales[0] * scale_for(float(total)))
                total = self.distances()
            self.values[0] = float(total)
        if self.on[1]:
            kernels.centred_state(self.u, nominal, self.products, self.singles)
            value = kernels.centred_value(self.products, self.singles, self.constant) * n * n
            if rescale:
                self.rescale(1, scale_for(value))
            self.values[1] = np.rint(value * self.scales[1])
        if self.on[2]:
            value = kernels.gap_state(self.x, nominal, self.shifts, self.unit, self.gaps)
            if rescale or value * self.scales[2] < FAINT:
                self.rescale(2, scale_for(value))
            self.values[2] = np.rint(value * self.scales[2])
        if self.on[3]:
            centred = 2.0 * self.x - 2.0 * self.x.mean(axis=1, keepdims=True)
            self.gram = centred @ centred.T / 4.0  # whole numbers below 2^53 for n < 2e5: exact in any order
            self.values[3:5] = kernels.eighth_powers(self.gram, self.gram_weights)
            self.values[5] = 0.0

    def distances(self) -> int:
        """Fill the table of squared distances; the sum over pairs on the whole scale."""
        nominal = self.columns.nominal
        return int(
            kernels.distance_state(
                self.x, nominal, self.apart, self.squares, self.rows, self.h, self.scales[0]
            )
        )

    def rescale(self, c: int, scale: float) -> None:
        """Another unit of the whole scale of criterion c; what the search compares stays the same."""
        factor = scale / self.scales[c]
        self.scales[c] = scale
        self.weights[c] /= factor
        self.best_values[c] *= factor

    def weigh(self, shares: Floats, reference: Floats) -> None:
        """Weights of relative changes about reference values; the best so far is judged anew."""
        slope = np.array([1.0 / (2 * self.h), 1.0, 1.0 / len(self.x)])
        self.weights[:3] = np.where(self.on[:3], shares[:3] * slope / np.maximum(reference[:3], 1.0), 0.0)
        self.weights[3] = shares[3] if self.on[3] else 0.0
        self.best[:] = self.entries
        self.progress[6] = 0
        self.best_values[:4] = self.values[:4]
        self.best_values[4] = kernels.merit(self.on, self.weights, self.values, self.pairs)

    def run(
        self,
        trials: int,
        *,
        heat: float,
        cooled: float,
        wide: float = 1.0,
        narrow: float = 1.0,
        feasible: Feasible | None,
    ) -> None:
        """Trials under a bar that falls from `heat` by the factor `cooled`."""
        if len(self.movable) == 0 or not (self.groups[:, 1] > 1).any():
            self.progress[0] += trials
            return
        n = self.x.shape[1]
        stage = max(1, trials // STAGES)
        cooling = cooled ** (stage / max(trials, 1))
        bar = np.array([heat, n * wide])
        narrowing = (narrow / wide) ** (stage / max(trials, 1))
        base = int(self.progress[0])
        self.progress[0] = 0
        chunk = FIRST_CHUNK
        stop = min(trials, chunk)
        while self.progress[0] < trials or self.progress[2] > 1:
            kernels.search(
                self.entries, self.holder, self.x, self.u, self.columns.nominal, self.groups, self.movable,
                self.draws, self.on, self.weights, self.scales, self.values,
                self.h, self.apart, self.squares, self.rows, self.products, self.singles,
                self.shifts, self.unit, self.gaps, self.gram, self.gram_weights,
                bar, cooling, narrowing, stage, stop, feasible is not None, self.progress, self.log,
                self.best, self.best_values,
            )  # fmt: skip
            if self.progress[2] == 1 and feasible is not None:
                k, i, j = (int(v) for v in self.progress[3:6])
                pair = self.u[:, [i, j]].T.copy()
                pair[:, k] = pair[::-1, k]
                self.progress[2] = 2 if bool(np.all(feasible(pair))) else 3
            elif self.progress[0] < trials:
                if self.on[:3].any():  # correlations come from whole numbers and need no sweeping
                    self.refresh()
                chunk = min(2 * chunk, REFRESH)
                stop = min(trials, stop + chunk)
        self.progress[0] += base

    def back_to_best(self) -> None:
        """Continue from the best design seen."""
        if not np.array_equal(self.entries, self.best):
            self.entries[:] = self.best
            self.progress[6] = 0
            self.refresh()


def typical_sum(x: NDArray[np.int32], h: int) -> float:
    """About the sum over pairs of squared distance^-h, duplicates left out: only its size matters."""
    d, n = x.shape
    squares, rows = np.empty((n, n), np.int32), np.empty(n, np.int64)
    kernels.distance_state(x, np.zeros(d, np.bool_), 1, squares, rows, h, 1.0)
    total = 0.0
    for i, row in enumerate(squares):
        others = row[:i][row[:i] > 0]
        total += float((others.astype(np.float64) ** -h).sum())
    return total if total > 0.0 else 1.0


def scale_for(value: float) -> float:
    """The power of two that brings `value` near 2^46."""
    if not np.isfinite(value) or value <= 0.0:
        return 1.0
    return float(2.0 ** (SCALE_BITS - np.frexp(value)[1]))


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
    heat: float | None = None,
    draws: Draws,
) -> SwapResult:
    """Rearrange the columns from `entries` (d, n) on; swaps stay inside each group of runs.

    groups: (g, 2) first run and number of runs; runs in no group stay as they are.
    feasible: points (m, d) -> truth values; a swap passes only when both runs are feasible afterwards.
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

    def search(which: Sequence[str], generator: Draws) -> _Search:
        return _Search(
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
    alone: dict[str, float] = {}
    reference = first.values.copy()
    spent = 0
    accepted = 0
    if len(names) > 1:
        part = total // (4 * len(names))
        for name in names:
            single = search((name,), draws)
            anneal(single, part, np.where(single.on, 1.0, 0.0), heat, feasible)
            spent += part
            accepted += int(single.progress[1])
            alone.update(values_of(columns.points(single.best), (name,), p))
            c = CRITERIA.index(name)
            reference[c] = single.best_values[c] * first.scales[c] / single.scales[c]
        anneal(first, total - spent, shares, heat, feasible, reference)
    else:
        anneal(first, total, shares, heat, feasible)
    points = columns.points(first.best)
    return SwapResult(
        points=points,
        entries=np.ascontiguousarray(first.best.T),
        swaps=total,
        accepted=accepted + int(first.progress[1]),
        values=values_of(points, names, p),
        alone=alone,
    )


def anneal(
    search: _Search,
    trials: int,
    shares: Floats,
    heat: float | None,
    feasible: Feasible | None,
    reference: Floats | None = None,
) -> None:
    """Go down, anneal about what was reached, go down again."""
    d, n = search.x.shape
    least, most = QUENCH
    quench, freeze = int(min(max(n * d, least * trials), most * trials)), int(FREEZE * trials)
    search.weigh(shares, search.values if reference is None else reference)
    search.run(quench, heat=0.0, cooled=1.0, feasible=feasible)
    search.back_to_best()
    search.weigh(shares, search.values if reference is None else reference)
    if heat is None:
        heat = float(START_HEAT @ shares / np.count_nonzero(shares)) * (8.0 / d) ** 2 / n
    slow = trials - quench - freeze
    search.run(slow, heat=heat, cooled=COOLED, wide=WIDE, narrow=NARROW, feasible=feasible)
    search.back_to_best()
    search.run(freeze, heat=0.0, cooled=1.0, wide=NARROW, narrow=NARROW, feasible=feasible)


def _rate(probe: _Search, feasible: Feasible | None) -> float:
    """Trials per second, measured on a search with a generator of its own."""
    if len(probe.movable) == 0 or not (probe.groups[:, 1] > 1).any():
        return 1.0  # there is nothing to swap
    probe.weigh(np.where(probe.on, 1.0, 0.0), probe.values)
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


def values_of(points: Floats, names: Sequence[str], p: int) -> dict[str, float]:
    """The named criteria of points, as `doe.criteria.spread` has them."""
    known = {
        "phi_p": lambda: phi_p(points, p=p),
        "cd2": lambda: cd2(points),
        "maxpro": lambda: maxpro(points),
        "correlation": lambda: max_correlation(points),
    }
    return {name: known[name]() for name in names}


def polished(cells: NDArray[np.integer], swaps: int, *, draws: Draws) -> NDArray[np.int32]:
    """The cells 0..n-1 (n, d) of a Latin hypercube after swaps that only lower phi_p."""
    n, d = cells.shape
    levels = np.tile((np.arange(n) + 0.5) / n, (d, 1))
    columns = Columns(levels=levels, nominal=np.zeros(d, np.bool_))
    entries = np.ascontiguousarray(cells.T, dtype=np.int32)
    found = swap_search(columns, entries, criterion="phi_p", swaps=swaps, heat=0.0, draws=draws)
    return found.entries
