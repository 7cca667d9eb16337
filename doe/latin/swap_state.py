"""A design under swaps: its entries, the tables of its criteria, and the loop that moves them."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from doe.latin import _kernels_swap_criteria as tables
from doe.latin import _kernels_swaps as kernels
from doe.latin.columns import CRITERIA, Columns, Feasible
from doe.portable.draws import Draws

__all__ = ["SwapState"]

Floats = NDArray[np.float64]
REFRESH = 2**18  # trials after which rounding errors of the products are swept out; fewer at the start,
FIRST_CHUNK = 2**12  # where sums fall by orders of magnitude and need a finer whole scale
STAGES = 200
SCALE_BITS = 46
FAINT = 2.0**40  # a sum that fell below is measured in a finer unit


class SwapState:
    """What the kernels work on for one set of columns: the records of `_kernels_swaps`, kept in place."""

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
        self.columns, self.draws = columns, draws
        self.grid, reach = columns.grid(tuple(names))
        d, n = self.grid.shape
        counts = 1 + np.count_nonzero(np.diff(self.grid, axis=1), axis=1)  # rows are sorted
        self.swappable = kernels.Swappable(
            nominal=columns.nominal,
            movable=np.flatnonzero(np.ptp(self.grid, axis=1) > 0).astype(np.int64),
            groups=groups,
        )
        on = np.array([c in names for c in CRITERIA])
        sizes = [(n, n) if c in names else (1, 1) for c in CRITERIA]
        self.criteria = kernels.Criteria(
            on=on,
            weights=np.zeros(4),
            scales=np.ones(4),
            values=np.zeros(6),
            pairs=max(d * (d - 1) / 2, 1.0),
            distances=tables.Distances(
                squares=np.empty(sizes[0], np.int32),
                rows=np.empty(n, np.int64),
                half_power=p // 2,
                apart=reach * reach,
            ),
            centred=tables.CentredProducts(products=np.empty(sizes[1]), singles=np.empty((2, n))),
            gaps=tables.GapProducts(
                products=np.empty(sizes[2]),
                shifts=np.where(counts < n, np.exp(1.5) / counts, 0.0),
                unit=float(np.exp(1.5)) / reach,
            ),
            correlations=tables.Correlations(
                gram=np.empty((d, d)),
                weights=_correlation_weights(self.grid, ~columns.nominal & (counts > 1)),
            ),
        )
        self.progress = np.zeros(7, np.int64)
        self.positions = bool(positions or on[kernels.CD2])
        self.design = kernels.Design(
            entries=np.empty((d, n), np.int32),
            holder=np.empty((d, n), np.int32),
            x=np.empty((d, n), np.int32),
            u=np.empty((d, n) if self.positions else (1, 1)),
        )
        self.best = kernels.Best(
            entries=np.empty((d, n), np.int32),
            values=np.full(5, np.inf),
            log=np.empty((max(64, n * d // 8), 3), np.int32),
        )
        self.scratch = _scratch(n)
        self.design.entries[:] = entries
        self.best.entries[:] = entries
        self.refresh(rescale=True)

    @property
    def idle(self) -> bool:
        """Whether there is nothing to swap."""
        return len(self.swappable.movable) == 0 or not (self.swappable.groups[:, 1] > 1).any()

    def refresh(self, *, rescale: bool = False) -> None:
        """All tables and values from the entries, free of accumulated rounding."""
        design, on = self.design, self.criteria.on
        index = design.entries.astype(np.int64)
        runs = np.arange(index.shape[1], dtype=np.int32)
        np.put_along_axis(design.holder, index, np.broadcast_to(runs, index.shape), axis=1)
        design.x[:] = np.take_along_axis(self.grid, index, axis=1)
        if self.positions:
            design.u[:] = np.take_along_axis(self.columns.levels, index, axis=1)
        if on[kernels.PHI]:
            self._refresh_distances(rescale)
        if on[kernels.CD2]:
            self._refresh_centred(rescale)
        if on[kernels.MAXPRO]:
            self._refresh_gaps(rescale)
        if on[kernels.CORRELATION]:
            gram, weights = self.criteria.correlations
            centred = 2.0 * design.x - 2.0 * design.x.mean(axis=1, keepdims=True)
            gram[:] = centred @ centred.T / 4.0  # whole numbers below 2^53 for n < 2e5: exact in any order
            self.criteria.values[kernels.CORRELATION : kernels.CHANGES] = tables.eighth_powers(gram, weights)
            self.criteria.values[kernels.CHANGES] = 0.0

    def _refresh_distances(self, rescale: bool) -> None:
        if rescale:
            size = _typical_sum(self.design.x, self.criteria.distances.half_power)
            self._rescale(kernels.PHI, _scale_for(size))
        total = self._distances()
        if total < FAINT:
            self._rescale(kernels.PHI, self.criteria.scales[kernels.PHI] * _scale_for(float(total)))
            total = self._distances()
        self.criteria.values[kernels.PHI] = float(total)

    def _distances(self) -> int:
        """Fill the table of squared distances; the sum over pairs on the whole scale."""
        x, nominal, scales = self.design.x, self.columns.nominal, self.criteria.scales
        squares, rows, h, apart = self.criteria.distances
        return int(tables.distance_state(x, nominal, apart, squares, rows, h, scales[kernels.PHI]))

    def _refresh_centred(self, rescale: bool) -> None:
        d, n = self.design.u.shape
        products, singles = self.criteria.centred
        tables.centred_state(self.design.u, self.columns.nominal, products, singles)
        value = tables.centred_value(products, singles, float((13 / 12) ** d)) * n * n
        if rescale:
            self._rescale(kernels.CD2, _scale_for(value))
        self.criteria.values[kernels.CD2] = np.rint(value * self.criteria.scales[kernels.CD2])

    def _refresh_gaps(self, rescale: bool) -> None:
        products, shifts, unit = self.criteria.gaps
        scales = self.criteria.scales
        value = tables.gap_state(self.design.x, self.columns.nominal, shifts, unit, products)
        if rescale or value * scales[kernels.MAXPRO] < FAINT:
            self._rescale(kernels.MAXPRO, _scale_for(value))
        self.criteria.values[kernels.MAXPRO] = np.rint(value * scales[kernels.MAXPRO])

    def _rescale(self, c: int, scale: float) -> None:
        """Another unit of the whole scale of criterion c; what the search compares stays the same."""
        factor = scale / self.criteria.scales[c]
        self.criteria.scales[c] = scale
        self.criteria.weights[c] /= factor
        self.best.values[c] *= factor

    def weigh(self, shares: Floats, reference: Floats) -> None:
        """Weights of relative changes about reference values; the best so far is judged anew."""
        on, weights, values = self.criteria.on, self.criteria.weights, self.criteria.values
        slope = np.array([1.0 / (2 * self.criteria.distances.half_power), 1.0, 1.0 / len(self.design.x)])
        weights[:3] = np.where(on[:3], shares[:3] * slope / np.maximum(reference[:3], 1.0), 0.0)
        weights[3] = shares[3] if on[3] else 0.0
        self.best.entries[:] = self.design.entries
        self.progress[kernels.LOGGED] = 0
        self.best.values[:4] = values[:4]
        self.best.values[4] = kernels.merit(on, weights, values, self.criteria.pairs)

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
        """Trials under a bar that falls from `heat` by the factor `cooled`.

        wide, narrow: levels two swapped entries may be apart, as a share of n, at the start and at the end
        """
        progress = self.progress
        if self.idle:
            progress[kernels.DONE] += trials
            return
        stage = max(1, trials // STAGES)
        schedule = kernels.Schedule(
            bar=np.array([heat, self.design.x.shape[1] * wide]),
            cooling=cooled ** (stage / max(trials, 1)),
            narrowing=(narrow / wide) ** (stage / max(trials, 1)),
            stage=stage,
        )
        base = int(progress[kernels.DONE])
        progress[kernels.DONE] = 0
        chunk = FIRST_CHUNK
        stop = min(trials, chunk)
        while progress[kernels.DONE] < trials or progress[kernels.PENDING] > kernels.ASKED:
            kernels.search(
                self.design,
                self.swappable,
                self.criteria,
                self.best,
                schedule,
                self.scratch,
                self.draws,
                progress,
                stop,
                feasible is not None,
            )
            if progress[kernels.PENDING] == kernels.ASKED and feasible is not None:
                progress[kernels.PENDING] = kernels.DO if self._stays(feasible) else kernels.LEAVE
            elif progress[kernels.DONE] < trials:
                if self.criteria.on[:3].any():  # correlations come from whole numbers and need no sweeping
                    self.refresh()
                chunk = min(2 * chunk, REFRESH)
                stop = min(trials, stop + chunk)
        progress[kernels.DONE] += base

    def _stays(self, feasible: Feasible) -> bool:
        """Whether both runs of the swap that is asked for are feasible after it."""
        k, i, j = (int(v) for v in self.progress[kernels.COLUMN : kernels.LOGGED])
        pair = self.design.u[:, [i, j]].T.copy()
        pair[:, k] = pair[::-1, k]
        return bool(np.all(feasible(pair)))

    def back_to_best(self) -> None:
        """Continue from the best design seen."""
        if not np.array_equal(self.design.entries, self.best.entries):
            self.design.entries[:] = self.best.entries
            self.progress[kernels.LOGGED] = 0
            self.refresh()


def _scratch(n: int) -> kernels.Scratch:
    """Room for the trials of a design of n runs."""
    terms = np.empty(n)
    return kernels.Scratch(
        terms=terms,
        bits=terms.view(np.int64),
        step=np.empty(n, np.int32),
        c_old=np.empty(n),
        c_new=np.empty(n),
        m_old=np.empty(n),
        m_new=np.empty(n),
        ratios=np.ones(2),
        changes=np.zeros(4),
    )


def _correlation_weights(grid: NDArray[np.int32], ordered: NDArray[np.bool_]) -> Floats:
    """1 / (G_kk G_ll) of the ordered columns of the grid (d, n), 0 for the others: (d, d)."""
    weights = np.zeros((len(grid), len(grid)))
    variances = ((grid - grid.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    weights[np.ix_(ordered, ordered)] = 1.0 / np.outer(variances[ordered], variances[ordered])
    return weights


def _typical_sum(x: NDArray[np.int32], h: int) -> float:
    """About the sum over pairs of squared distance^-h, duplicates left out: only its size matters."""
    d, n = x.shape
    squares, rows = np.empty((n, n), np.int32), np.empty(n, np.int64)
    tables.distance_state(x, np.zeros(d, np.bool_), 1, squares, rows, h, 1.0)
    total = 0.0
    for i, row in enumerate(squares):
        others = row[:i][row[:i] > 0]
        total += float((others.astype(np.float64) ** -h).sum())
    return total if total > 0.0 else 1.0


def _scale_for(value: float) -> float:
    """The power of two that brings `value` near 2^46."""
    if not np.isfinite(value) or value <= 0.0:
        return 1.0
    return float(2.0 ** (SCALE_BITS - np.frexp(value)[1]))
