# mypy: ignore-errors
"""The loop of a swap search: exchange two entries of one column, and keep what the criteria allow.

Notation and tables of the criteria: see `_kernels_swap_criteria`. Entry e[k, i] of run i in column k is its
position in the sorted levels of the column.
"""

from typing import NamedTuple

import numpy as np

from doe._kernel_cache import kernel
from doe.latin._kernels_swap_criteria import (
    CentredProducts,
    Correlations,
    Distances,
    GapProducts,
    centred_factors,
    correlation_trial,
    diagonal_factor,
    distance_accept,
    distance_trial,
    eighth_powers,
    gap_factors,
    product_accept,
    product_trial,
    root8,
    single_factor,
    steps,
)
from doe.portable._kernels_draws import below, word
from doe.portable._kernels_whole_sums import CLAMP, inverse_power, whole

S40 = np.uint64(40)
PHI, CD2, MAXPRO, CORRELATION, FRESH, CHANGES = 0, 1, 2, 3, 4, 5
DONE, ACCEPTED, PENDING, COLUMN, FIRST, SECOND, LOGGED = 0, 1, 2, 3, 4, 5, 6
NOTHING, ASKED, DO, LEAVE = 0, 1, 2, 3  # values of progress[PENDING]


class Design(NamedTuple):
    """What swaps move, each (d, n).

    entries: positions in the sorted levels    holder: the run that holds each entry
    x: whole coordinates    u: positions in [0, 1], or (1, 1) where nothing asks for them
    """

    entries: np.ndarray
    holder: np.ndarray
    x: np.ndarray
    u: np.ndarray


class Swappable(NamedTuple):
    """What swaps may move.

    nominal: (d,) true for unordered levels    movable: columns with more than one level
    groups: (g, 2) first run and number of runs of each group; swaps stay inside a group
    """

    nominal: np.ndarray
    movable: np.ndarray
    groups: np.ndarray


class Criteria(NamedTuple):
    """What a design is judged by.

    on: (4,) criteria in use    weights: (4,) what a unit of each is worth    scales: (4,) of the whole scales
    values: (6,) current S (whole scale), J, S of MaxPro, sum of r^8; that sum when last computed afresh,
    swaps since    pairs: of columns
    """

    on: np.ndarray
    weights: np.ndarray
    scales: np.ndarray
    values: np.ndarray
    pairs: float
    distances: Distances
    centred: CentredProducts
    gaps: GapProducts
    correlations: Correlations


class Best(NamedTuple):
    """The best design seen: entries (d, n), values (5,) with its merit last, log of the swaps since."""

    entries: np.ndarray
    values: np.ndarray
    log: np.ndarray


class Schedule(NamedTuple):
    """How bold swaps may be: bar (2,) is what one may cost and how many levels it may span.

    cooling, narrowing: factors on the two every `stage` trials
    """

    bar: np.ndarray
    cooling: float
    narrowing: float
    stage: int


class Scratch(NamedTuple):
    """What the trial of a swap leaves for its acceptance.

    terms, bits: (n,) as numbers and as their bits    step: (n,) changes of the squared distances
    c_old, c_new, m_old, m_new: (n,) factors of CD2 and MaxPro    ratios: (2,) of s_i and C_ii of run i
    changes: (4,) of the criteria
    """

    terms: np.ndarray
    bits: np.ndarray
    step: np.ndarray
    c_old: np.ndarray
    c_new: np.ndarray
    m_old: np.ndarray
    m_new: np.ndarray
    ratios: np.ndarray
    changes: np.ndarray


@kernel(allocates=False, inner=True)
def note(log, at, k, i, j):
    """Write a swap down, if there is room."""
    if at < log.shape[0]:
        log[at, 0] = k
        log[at, 1] = i
        log[at, 2] = j


@kernel(allocates=False, inner=True)
def catch_up(e, best, log, count):
    """Do the swaps that were written down to `best` too; copy everything when there were too many."""
    if count <= log.shape[0]:
        for q in range(count):
            row = best[log[q, 0]]
            row[log[q, 1]], row[log[q, 2]] = row[log[q, 2]], row[log[q, 1]]
    else:  # element by element: numba's slice assignment compiles seconds of string handling
        for k in range(e.shape[0]):
            for i in range(e.shape[1]):
                best[k, i] = e[k, i]


@kernel(allocates=False)
def merit(on, weights, values, pairs):
    """What the search lowers: the weighted sum of the criteria."""
    total = 0.0
    for c in range(3):
        if on[c]:
            total += weights[c] * values[c]
    if on[CORRELATION]:
        total += weights[CORRELATION] * root8(values[CORRELATION], pairs)
    return total


@kernel(allocates=False, inline="always")
def draw_swap(design, swappable, window, total_runs, state):
    """A column and two runs of one group, at most `window` levels apart; runs (-1, -1) when none was hit."""
    n = design.x.shape[1]
    k = np.int64(swappable.movable[below(state, swappable.movable.size)])
    at = below(state, total_runs)
    g = 0
    while at >= swappable.groups[g, 1]:
        at -= swappable.groups[g, 1]
        g += 1
    first, size = swappable.groups[g, 0], swappable.groups[g, 1]
    if size < 2:
        return k, np.int64(-1), np.int64(-1)
    i = first + at
    if size == n and window < n - 1:
        level = design.entries[k, i] - window + below(state, 2 * window)
        level += level >= design.entries[k, i]
        if level < 0 or level >= n:
            return k, np.int64(-1), np.int64(-1)
        return k, i, np.int64(design.holder[k, level])
    other = below(state, size - 1)
    return k, i, first + (other + 1 if other >= at else other)


@kernel(allocates=False, inner=True)
def distance_change(column, is_nominal, table, scale, scratch, i, j):
    """Change of S of phi_p when runs i and j are swapped in a column."""
    steps(column, is_nominal, table.apart, column[i], column[j], scratch.step)
    h, squares, rows = table.half_power, table.squares, table.rows
    own = whole(inverse_power(np.float64(squares[i, j]), h, scale))
    change = distance_trial(squares[i], squares[j], scratch.step, i, j, h, scale, scratch.terms, scratch.bits)
    return change - (rows[i] + rows[j] - 2 * own)


@kernel(allocates=False, inner=True)
def centred_change(column, is_nominal, table, scale, scratch, i, j):
    """Change of n^2 CD2 when runs i and j are swapped in a column of positions."""
    ua, ub, n = column[i], column[j], column.size
    centred_factors(column, is_nominal, ua, scratch.c_old)
    centred_factors(column, is_nominal, ub, scratch.c_new)
    products, singles = table.products, table.singles
    change = 2 * product_trial(
        products[i], products[j], scratch.c_old, scratch.c_new, i, j, scale, scratch.terms, scratch.bits
    )
    s = single_factor(ub, is_nominal) / single_factor(ua, is_nominal)
    t = diagonal_factor(ub, is_nominal) / diagonal_factor(ua, is_nominal)
    part = singles[1, i] * (t - 1.0) + singles[1, j] * (1.0 / t - 1.0)
    part -= 2.0 * n * (singles[0, i] * (s - 1.0) + singles[0, j] * (1.0 / s - 1.0))
    scratch.ratios[0], scratch.ratios[1] = s, t
    return change + whole(max(min(scale * part, CLAMP), -CLAMP))


@kernel(allocates=False, inner=True)
def gap_change(column, is_nominal, shift, table, scale, scratch, i, j):
    """Change of S of MaxPro when runs i and j are swapped in a column."""
    old, new = scratch.m_old, scratch.m_new
    gap_factors(column, is_nominal, column[j], shift, table.unit, old)
    gap_factors(column, is_nominal, column[i], shift, table.unit, new)
    old[i], old[j], new[i], new[j] = 1.0, 1.0, 1.0, 1.0
    products = table.products
    return product_trial(products[i], products[j], old, new, i, j, scale, scratch.terms, scratch.bits)


@kernel(allocates=False, inline="always")
def swap_cost(design, swappable, criteria, scratch, k, i, j):
    """What the merit would rise by; the change of each criterion stays in `scratch`."""
    x, is_nominal, scales, changes = design.x[k], swappable.nominal[k], criteria.scales, scratch.changes
    cost = 0.0
    if criteria.on[PHI]:
        changes[PHI] = distance_change(x, is_nominal, criteria.distances, scales[PHI], scratch, i, j)
        cost += criteria.weights[PHI] * changes[PHI]
    if criteria.on[CD2]:
        changes[CD2] = centred_change(design.u[k], is_nominal, criteria.centred, scales[CD2], scratch, i, j)
        cost += criteria.weights[CD2] * changes[CD2]
    if criteria.on[MAXPRO]:
        shift = criteria.gaps.shifts[k]
        changes[MAXPRO] = gap_change(x, is_nominal, shift, criteria.gaps, scales[MAXPRO], scratch, i, j)
        cost += criteria.weights[MAXPRO] * changes[MAXPRO]
    if criteria.on[CORRELATION]:
        table = criteria.correlations
        change = correlation_trial(design.x, table.gram, table.weights, k, i, j)
        changes[CORRELATION] = change
        now = criteria.values[CORRELATION]
        rise = root8(now + change, criteria.pairs) - root8(now, criteria.pairs)
        cost += criteria.weights[CORRELATION] * rise
    return cost


@kernel(allocates=False, inner=True)
def move_tables(x, criteria, scratch, k, i, j):
    """Take the tables and values of the criteria from before the swap to after it; x: coordinates before."""
    values, changes = criteria.values, scratch.changes
    if criteria.on[PHI]:
        table = criteria.distances
        values[PHI] += np.float64(
            distance_accept(
                table.squares, table.rows, scratch.step, i, j, table.half_power, criteria.scales[PHI]
            )
        )
    if criteria.on[CD2]:
        product_accept(criteria.centred.products, scratch.c_old, scratch.c_new, i, j)
        singles, s, t = criteria.centred.singles, scratch.ratios[0], scratch.ratios[1]
        singles[0, i] *= s
        singles[0, j] /= s
        singles[1, i] *= t
        singles[1, j] /= t
        values[CD2] += changes[CD2]
    if criteria.on[MAXPRO]:
        product_accept(criteria.gaps.products, scratch.m_old, scratch.m_new, i, j)
        values[MAXPRO] += changes[MAXPRO]
    if criteria.on[CORRELATION]:
        gram = criteria.correlations.gram
        jump = np.float64(x[k, j] - x[k, i])
        for l in range(x.shape[0]):
            if l != k:
                gram[k, l] += jump * np.float64(x[l, i] - x[l, j])
                gram[l, k] = gram[k, l]
        values[CORRELATION] += changes[CORRELATION]
        values[CHANGES] += 1.0
        if values[CORRELATION] < 0.5 * values[FRESH] or values[CHANGES] >= 256.0:
            # sums of r^8 fall by many orders of magnitude: old rounding must not outlive them
            values[CORRELATION] = eighth_powers(gram, criteria.correlations.weights)
            values[FRESH] = values[CORRELATION]
            values[CHANGES] = 0.0


@kernel(allocates=False, inner=True)
def swap_in(design, k, i, j):
    """Exchange what runs i and j hold in column k."""
    e, holder, x, u = design.entries, design.holder, design.x, design.u
    e[k, i], e[k, j] = e[k, j], e[k, i]
    holder[k, e[k, i]], holder[k, e[k, j]] = i, j
    x[k, i], x[k, j] = x[k, j], x[k, i]
    if u.shape[1] == e.shape[1]:  # positions are kept only where something asks for them
        u[k, i], u[k, j] = u[k, j], u[k, i]


@kernel(allocates=False)
def search(design, swappable, criteria, best, schedule, scratch, state, progress, stop, ask):
    """Try swaps until progress[DONE] reaches `stop`; worse ones pass while they cost less than a falling bar.

    A swap passes below the bar times a uniform number.
    ask: stop at each swap that would pass, with progress[PENDING] = ASKED; the caller sets PENDING to DO or
    LEAVE and calls again.
    """
    bar = schedule.bar
    total_runs = np.int64(0)
    for g in range(swappable.groups.shape[0]):
        total_runs += swappable.groups[g, 1]
    while progress[DONE] < stop or progress[PENDING] > ASKED:
        answer = progress[PENDING]
        progress[PENDING] = NOTHING
        if answer == LEAVE:
            continue
        if answer == DO:
            k, i, j = progress[COLUMN], progress[FIRST], progress[SECOND]
        else:
            if progress[DONE] > 0 and progress[DONE] % schedule.stage == 0:
                bar[0] *= schedule.cooling
                bar[1] = max(bar[1] * schedule.narrowing, 1.0)
            progress[DONE] += 1
            k, i, j = draw_swap(design, swappable, np.int64(bar[1]), total_runs, state)
        if i < 0 or design.x[k, i] == design.x[k, j]:
            continue
        cost = swap_cost(design, swappable, criteria, scratch, k, i, j)
        if answer != DO:
            uniform = np.float64(np.int64(word(state) >> S40)) / 16777216.0
            if cost > bar[0] * uniform:
                continue
            if ask:
                progress[COLUMN], progress[FIRST], progress[SECOND] = k, i, j
                progress[PENDING] = ASKED
                return
        progress[ACCEPTED] += 1
        move_tables(design.x, criteria, scratch, k, i, j)
        swap_in(design, k, i, j)
        note(best.log, progress[LOGGED], k, i, j)
        progress[LOGGED] += 1
        now = merit(criteria.on, criteria.weights, criteria.values, criteria.pairs)
        if now < best.values[4]:
            for c in range(4):
                best.values[c] = criteria.values[c]
            best.values[4] = now
            catch_up(design.entries, best.entries, best.log, progress[LOGGED])
            progress[LOGGED] = 0
