"""Which runs of a design to make first: a part of it that fills the space nearly as well as its size allows.

A part S of k runs is judged by the criteria that designs are drawn for, each a sum over its pairs:

    f = (sum of d_ij^-10 / that of k runs at random)^(1/8) + CD2 / (CD2 of the whole * n / k) + 2 rms r

Runs are exchanged for those left out, the best exchange of each run in turn, while f falls; of several parts
begun at random the best is taken.
"""

from dataclasses import replace

import numpy as np

from doe.portable.linear import product
from workbench.sampling.plan import Design, run_ids
from workbench.space.streams import stream

__all__ = ["first_part", "leading_rows", "next_part"]

STARTS, FEW = 12, 200  # parts begun with; one beyond so many runs, whose parts differ little
MOST_PASSES = 20
GAIN = 1e-9  # what an exchange gains at least: below, rounding decides
BITS = 2.0**30  # of the tables' entries: sums of 4e6 of them are exact, in any order and on any processor


def first_part(whole: Design, runs: int) -> tuple[Design, list[list[float]]]:
    """The `runs` runs of a design to make first, under ids of their own; the unit points of the others."""
    rng = stream(whole.seed, "part of a design", replicate=runs)
    chosen = leading_rows(_even(whole), runs, rng=rng)
    part = replace(whole.subset(chosen.tolist()), run_ids=run_ids(runs))
    return part, np.delete(whole.unit, chosen, axis=0).tolist()


def next_part(
    made: Design, later: list[list[float]], runs: int, *, seed: int
) -> tuple[Design, list[list[float]]]:
    """The design with `runs` more from those that were drawn with it, and what is left of these."""
    n, whole = len(made), made.appended(np.array(later))
    rng = stream(seed, "part of a design", replicate=n + runs)
    chosen = leading_rows(_even(whole), n + runs, kept=n, rng=rng)[n:] - n
    return made.appended(np.array(later)[chosen]), np.delete(later, chosen, axis=0).tolist()


def _even(whole: Design) -> np.ndarray:
    """The unit points; by rank where a parameter has a distribution, which a part shall follow."""
    unit = np.array(whole.unit)
    for j, parameter in enumerate(whole.space.parameters):
        if parameter.distribution is not None:
            rank = np.argsort(np.argsort(unit[:, j], kind="stable"), kind="stable")
            unit[:, j] = (rank + 0.5) / len(unit)
    return unit


def leading_rows(unit: np.ndarray, k: int, *, kept: int = 0, rng: np.random.Generator) -> np.ndarray:
    """Row numbers of the `k` runs of `unit` (n, d) to make first, rising; the first `kept` are among them.

    >>> points = (np.arange(9)[:, None] + 0.5) / 9
    >>> leading_rows(points, 3, rng=np.random.default_rng(1)).tolist()
    [1, 4, 7]
    """
    n = len(unit)
    if not 0 <= kept <= k <= n:
        raise ValueError(f"a part needs kept <= k <= {n} runs, got kept = {kept} and k = {k}")
    if k in (kept, n):
        return np.arange(k)
    tables = _Tables(unit, k)
    parts = []
    for _ in range(STARTS if n <= FEW else 1):
        inside = np.zeros(n, bool)
        inside[:kept] = True
        inside[kept + rng.permutation(n - kept)[: k - kept]] = True
        parts.append((_exchanged(tables, inside, kept), inside))
    return np.flatnonzero(min(parts, key=lambda part: part[0])[1])


class _Tables:
    """Pair sums of the criteria on whole numbers: (3, n, n) of distances, CD2 and correlations."""

    def __init__(self, unit: np.ndarray, k: int) -> None:
        n, d = unit.shape
        z = unit - 0.5
        squares, products, singles = np.zeros((n, n)), np.ones((n, n)), np.ones(n)
        same = np.zeros((n, n))
        for u in z.T:  # a column at a time: sums over them in an order of our own
            a = np.abs(u)
            gap = np.abs(u[:, None] - u)
            squares += gap * gap
            products *= 1.0 + 0.5 * (a[:, None] + a - gap)
            singles *= 1.0 + 0.5 * a - 0.5 * a * a
            same += (u * u)[:, None] * (u * u)
        inner = product(np.ascontiguousarray(z), np.ascontiguousarray(z.T))
        np.fill_diagonal(squares, np.inf)
        near = squares[squares > 0.0].min() / np.maximum(squares, squares[squares > 0.0].min())
        tables = [near * near * near * near * near, products, inner * inner - same]
        scales = [BITS / max(np.abs(table).max(), 1e-300) for table in tables]
        self.pairs = np.stack([np.rint(table * s) for table, s in zip(tables, scales, strict=True)])
        self.singles = np.rint(singles * BITS / singles.max())
        self._unit = np.array([1.0 / s for s in scales])
        self._single = singles.max() / BITS
        self._constant = 1.0
        for _ in range(d):
            self._constant *= 13.0 / 12.0
        self._k, self._pairs_of_columns = k, max(d * (d - 1), 1)
        everything = self.pairs[1].sum() * self._unit[1] / (n * n)
        whole = self._constant - 2.0 / n * self.singles.sum() * self._single + everything
        self._cd2 = max(whole, 1e-12) * n / k

    def merit(self, sums: np.ndarray, singles: np.ndarray, first: float) -> np.ndarray:
        """f of parts with those sums of ordered pairs (3, m) and runs (m,); first: of d^-10 at random."""
        k = self._k
        centred = self._constant - 2.0 / k * singles * self._single + sums[1] * self._unit[1] / (k * k)
        variance = k / 12.0
        square = np.maximum(sums[2], 0.0) * self._unit[2] / (self._pairs_of_columns * variance * variance)
        spread = np.sqrt(np.sqrt(np.sqrt(np.maximum(sums[0], 0.0) / first)))
        merit: np.ndarray = spread + centred / self._cd2 + 2.0 * np.sqrt(square)
        return merit


def _exchanged(tables: _Tables, inside: np.ndarray, kept: int) -> float:
    """Exchange runs of the part `inside` (n,), in place, while it gains; its merit."""
    pairs, own = tables.pairs, np.diagonal(tables.pairs, axis1=1, axis2=2)
    rows = pairs[:, :, inside].sum(axis=2)  # (3, n): of every run with those inside
    sums, singles = rows[:, inside].sum(axis=1), tables.singles[inside].sum()
    first = _first_sum(tables)
    now = float(tables.merit(sums[:, None], np.array([singles]), first)[0])
    for _ in range(MOST_PASSES):
        moved = False
        for i in np.flatnonzero(inside):
            if i < kept:
                continue
            out = np.flatnonzero(~inside)
            change = 2.0 * (rows[:, out] - rows[:, [i]]) + own[:, out] + own[:, [i]] - 2.0 * pairs[:, i, out]
            change_of_singles = tables.singles[out] - tables.singles[i]
            merits = tables.merit(sums[:, None] + change, singles + change_of_singles, first)
            j = int(np.argmin(merits))
            if merits[j] >= now - GAIN:
                continue
            o = out[j]
            sums, singles, now = sums + change[:, j], singles + change_of_singles[j], float(merits[j])
            rows += pairs[:, :, o] - pairs[:, :, i]
            inside[i], inside[o], moved = False, True, True
        if not moved:
            break
    return now


def _first_sum(tables: _Tables) -> float:
    """What the pair sum of distances of a part is measured by: that of as many runs of the whole."""
    n, k = tables.pairs.shape[1], tables._k
    return max(float(tables.pairs[0].sum()) * (k * k) / (n * n), 1.0)
