# mypy: ignore-errors
"""Swap search: exchange two entries of one column, O(n) work per trial, four criteria at once or alone.

Notation: run i has entry e[k, i] in column k, whole coordinate x[k, i] and position u[k, i] in [0, 1].
Swapping runs i and j in column k puts b = x_jk in the place of a = x_ik; every other run l keeps c = x_lk.

    phi_p         S = sum over pairs of (D_ij)^-h, D squared distances (whole numbers), h = p/2
    cd2           J = const - 2/n sum s_i + 1/n^2 sum C_ij, C_ij = prod_k f(u_ik, u_jk)
    maxpro        S = sum over pairs of M_ij = prod_k (|x_ik - x_jk| + shift_k)^-2
    correlation   rho = (mean over column pairs of r_kl^8)^(1/8)

Sums are sums of whole numbers (see `doe.portable._kernels_whole_sums`), so that a seed gives the same design
everywhere.
"""

import numpy as np

from doe._kernel_cache import kernel
from doe.portable._kernels_draws import below, word
from doe.portable._kernels_whole_sums import CLAMP, MAGIC, MAGIC_BITS, inverse_power, whole

NOMINAL_GAP = 4.4816890703380645  # exp(3/2): the whole range, where random gaps have geometric mean one
APART = np.int32(2**30)
S40 = np.uint64(40)
PHI, CD2, MAXPRO, CORRELATION, FRESH, CHANGES = 0, 1, 2, 3, 4, 5
DONE, ACCEPTED, PENDING, COLUMN, FIRST, SECOND, LOGGED = 0, 1, 2, 3, 4, 5, 6


@kernel()
def distance_state(x, nominal, apart, squares, rows, h, scale):
    """Fill the squared distances (n, n) and row sums of their terms; returns the sum over pairs."""
    d, n = x.shape
    total = np.int64(0)
    for i in range(n):
        row = squares[i]
        row[:] = 0
        for k in range(d):
            if nominal[k]:
                for j in range(n):
                    row[j] += apart if x[k, i] != x[k, j] else 0
            else:
                for j in range(n):
                    step = x[k, i] - x[k, j]
                    row[j] += step * step
        row[i] = APART
        r = np.int64(0)
        for j in range(n):
            if j != i:
                r += whole(inverse_power(np.float64(row[j]), h, scale))
        rows[i] = r
        total += r
    return total // 2


@kernel()
def steps(column, is_nominal, apart, a, b, out):
    """Change of the squared distance between run i and every l when i goes from a to b; -it for run j."""
    if is_nominal:
        for l in range(column.size):
            out[l] = (apart if column[l] != b else 0) - (apart if column[l] != a else 0)
    else:
        for l in range(column.size):
            out[l] = (b - a) * (a + b - 2 * column[l])


@kernel()
def distance_trial(first, second, step, i, j, h, scale, buffer, bits):
    """Sum of the terms of runs i and j after the swap, without their own pair."""
    if h == 5:  # the default p = 10: no inner loop
        for l in range(step.size):
            u = 1.0 / np.float64(first[l] + step[l])
            v = 1.0 / np.float64(second[l] - step[l])
            s, t = scale * u, scale * v
            s, t = s * u, t * v
            s, t = s * u, t * v
            s, t = s * u, t * v
            s, t = s * u, t * v
            buffer[l] = (min(s, CLAMP) + min(t, CLAMP)) + MAGIC
    else:
        for l in range(step.size):
            u = 1.0 / np.float64(first[l] + step[l])
            v = 1.0 / np.float64(second[l] - step[l])
            s, t = scale * u, scale * v
            for _ in range(h - 1):
                s, t = s * u, t * v
            buffer[l] = (min(s, CLAMP) + min(t, CLAMP)) + MAGIC
    buffer[i] = MAGIC
    buffer[j] = MAGIC
    total = np.int64(0)
    for l in range(step.size):
        total += bits[l] - MAGIC_BITS
    return total


@kernel()
def distance_accept(squares, rows, step, i, j, h, scale):
    """Move the squared distances and row sums on; returns the change of the sum over pairs."""
    own = whole(inverse_power(np.float64(squares[i, j]), h, scale))
    ri, rj = own, own
    for l in range(step.size):
        if l != i and l != j:
            old = whole(inverse_power(np.float64(squares[i, l]), h, scale))
            old += whole(inverse_power(np.float64(squares[j, l]), h, scale))
            p, q = squares[i, l] + step[l], squares[j, l] - step[l]
            squares[i, l] = p
            squares[l, i] = p
            squares[j, l] = q
            squares[l, j] = q
            s = whole(inverse_power(np.float64(p), h, scale))
            t = whole(inverse_power(np.float64(q), h, scale))
            rows[l] += s + t - old
            ri += s
            rj += t
    change = ri - rows[i] + rj - rows[j]
    rows[i] = ri
    rows[j] = rj
    return change


@kernel()
def centred_factors(column, is_nominal, a, out):
    """f(a, c) = 1 + |a - 1/2| / 2 + |c - 1/2| / 2 - |a - c| / 2; levels of a nominal column are all at the
    ends.
    """
    if is_nominal:
        for l in range(column.size):
            out[l] = 1.5 if column[l] == a else 1.0
        return
    z = a - 0.5
    if z >= 0.0:
        for l in range(column.size):
            out[l] = 1.0 + min(max(column[l] - 0.5, 0.0), z)
    else:
        for l in range(column.size):
            out[l] = 1.0 + min(max(0.5 - column[l], 0.0), -z)


@kernel()
def single_factor(a, is_nominal):
    z = 0.5 if is_nominal else abs(a - 0.5)
    return 1.0 + 0.5 * z - 0.5 * z * z


@kernel()
def diagonal_factor(a, is_nominal):
    return 1.5 if is_nominal else 1.0 + abs(a - 0.5)


@kernel()
def gap_factors(column, is_nominal, a, shift, unit, out):
    """(unit |a - c| + shift)^2; unlike levels of a nominal column differ by NOMINAL_GAP.

    The unit makes the geometric mean of random gaps one, so that a product over many columns stays in range.
    """
    for l in range(column.size):
        gap = unit * np.float64(abs(column[l] - a))
        if is_nominal:
            gap = NOMINAL_GAP if column[l] != a else 0.0
        out[l] = (gap + shift) * (gap + shift)


@kernel()
def centred_state(u, nominal, products, singles):
    """Fill C (n, n), and singles (2, n) with s_i and C_ii."""
    d, n = u.shape
    factors = np.empty(n)
    singles[:] = 1.0
    for i in range(n):
        products[i] = 1.0
        for k in range(d):
            centred_factors(u[k], nominal[k], u[k, i], factors)
            for j in range(n):
                products[i, j] *= factors[j]
            singles[0, i] *= single_factor(u[k, i], nominal[k])
            singles[1, i] *= diagonal_factor(u[k, i], nominal[k])


@kernel()
def centred_value(products, singles, constant):
    n = products.shape[0]
    total, single = 0.0, 0.0
    for i in range(n):
        row = 0.0
        for j in range(n):
            if j != i:
                row += products[i, j]
        total += row + singles[1, i]
        single += singles[0, i]
    return constant - 2.0 * single / n + total / (np.float64(n) * n)


@kernel()
def gap_state(x, nominal, shifts, unit, products):
    """Fill M (n, n); returns the sum over pairs."""
    d, n = x.shape
    factors = np.empty(n)
    total = 0.0
    for i in range(n):
        products[i] = 1.0
        for k in range(d):
            gap_factors(x[k], nominal[k], x[k, i], shifts[k], unit, factors)
            factors[i] = 1.0
            for j in range(n):
                products[i, j] /= factors[j]
        for j in range(i):
            total += products[i, j]
    return total


@kernel()
def product_trial(first, second, fa, fb, i, j, scale, buffer, bits):
    """Change of the pair sum of runs i and j when row i is multiplied by fb/fa and row j by fa/fb."""
    for l in range(fa.size):
        t = scale * ((fb[l] - fa[l]) * (first[l] * fb[l] - second[l] * fa[l]) / (fa[l] * fb[l]))
        buffer[l] = max(min(t, CLAMP), -CLAMP) + MAGIC
    buffer[i] = MAGIC
    buffer[j] = MAGIC
    total = np.int64(0)
    for l in range(fa.size):
        total += bits[l] - MAGIC_BITS
    return total


@kernel()
def product_accept(products, fa, fb, i, j):
    for l in range(fa.size):
        if l != i and l != j:
            ratio = fb[l] / fa[l]
            s, t = products[i, l] * ratio, products[j, l] / ratio
            products[i, l] = s
            products[l, i] = s
            products[j, l] = t
            products[l, j] = t


@kernel()
def eighth_powers(gram, weights):
    """Sum over column pairs of r^8; weights: 1 / (G_kk G_ll), 0 for columns that do not count."""
    total = 0.0
    for k in range(gram.shape[0]):
        for l in range(k):
            r4 = (gram[k, l] * gram[k, l] * weights[k, l]) ** 2
            total += r4 * r4
    return total


@kernel()
def correlation_trial(x, gram, weights, k, i, j):
    """Change of the sum of r^8 when runs i and j are swapped in column k."""
    step = np.float64(x[k, j] - x[k, i])
    change = 0.0
    for l in range(x.shape[0]):
        if l != k:
            old = (gram[k, l] * gram[k, l] * weights[k, l]) ** 2
            moved = gram[k, l] + step * np.float64(x[l, i] - x[l, j])
            new = (moved * moved * weights[k, l]) ** 2
            change += new * new - old * old
    return change


@kernel()
def root8(sum_of_powers, pairs):
    """rho, the eighth root of the mean: three correctly rounded square roots."""
    return np.sqrt(np.sqrt(np.sqrt(max(sum_of_powers, 0.0) / pairs)))


@kernel()
def note(log, at, k, i, j):
    """Write a swap down, if there is room."""
    if at < log.shape[0]:
        log[at, 0] = k
        log[at, 1] = i
        log[at, 2] = j


@kernel()
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


@kernel()
def swap_in(e, holder, x, u, k, i, j):
    e[k, i], e[k, j] = e[k, j], e[k, i]
    holder[k, e[k, i]], holder[k, e[k, j]] = i, j
    x[k, i], x[k, j] = x[k, j], x[k, i]
    if u.shape[1] == e.shape[1]:  # positions are kept only where something asks for them
        u[k, i], u[k, j] = u[k, j], u[k, i]


@kernel()
def search(
    e, holder, x, u, nominal, groups, movable, state, on, weights, scales, values,
    h, apart, squares, rows, products, singles, shifts, unit, gaps, gram, gram_weights,
    heat, cooling, narrowing, stage, stop, ask, progress, log, best, best_values,
):  # fmt: skip
    """Try swaps until progress[DONE] reaches `stop`; worse ones pass while they cost less than a falling bar.

    on: the criteria in use. values: current S (whole scale), J, S of MaxPro, sum of r^8. weights: what a
    unit of each is worth. groups: (g, 2) first run and number of runs of each group, swaps stay inside a
    group; movable: columns with more than one level. heat (1,): the bar, times `cooling` every `stage`
    trials; a swap passes below the bar times a uniform number. ask: stop at each swap that would pass, with
    progress[PENDING] = 1; the caller sets PENDING to 2 (do it) or 3 (leave it) and calls again. log:
    swaps since the best design was seen. best: its entries.
    """
    d, n = x.shape
    buffer = np.empty(n)
    bits = buffer.view(np.int64)
    step = np.empty(n, np.int32)
    fa, fb, ga, gb = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    pairs = max(d * (d - 1) / 2, 1.0)
    total_runs = np.int64(0)
    for g in range(groups.shape[0]):
        total_runs += groups[g, 1]
    while progress[DONE] < stop or progress[PENDING] > 1:
        resumed = progress[PENDING]
        progress[PENDING] = 0
        if resumed > 1:
            k, i, j = progress[COLUMN], progress[FIRST], progress[SECOND]
            if resumed == 3:
                continue
        else:
            if progress[DONE] > 0 and progress[DONE] % stage == 0:
                heat[0] *= cooling
                heat[1] = max(heat[1] * narrowing, 1.0)
            progress[DONE] += 1
            k = np.int64(movable[below(state, movable.size)])
            at = below(state, total_runs)
            g = 0
            while at >= groups[g, 1]:
                at -= groups[g, 1]
                g += 1
            size = groups[g, 1]
            if size < 2:
                continue
            i = groups[g, 0] + at
            window = np.int64(heat[1])
            if size == n and window < n - 1:
                level = e[k, i] - window + below(state, 2 * window)
                level += level >= e[k, i]
                if level < 0 or level >= n:
                    continue
                j = np.int64(holder[k, level])
            else:
                other = below(state, size - 1)
                j = groups[g, 0] + (other + 1 if other >= at else other)
        a, b = x[k, i], x[k, j]
        if a == b:
            continue
        cost = 0.0
        c_change, m_change, r_change = np.int64(0), np.int64(0), 0.0
        if on[PHI]:
            steps(x[k], nominal[k], apart, a, b, step)
            own = whole(inverse_power(np.float64(squares[i, j]), h, scales[PHI]))
            s_change = distance_trial(squares[i], squares[j], step, i, j, h, scales[PHI], buffer, bits)
            s_change -= rows[i] + rows[j] - 2 * own
            cost += weights[PHI] * np.float64(s_change)
        if on[CD2]:
            ua, ub = u[k, i], u[k, j]
            centred_factors(u[k], nominal[k], ua, fa)
            centred_factors(u[k], nominal[k], ub, fb)
            c_change = 2 * product_trial(products[i], products[j], fa, fb, i, j, scales[CD2], buffer, bits)
            s = single_factor(ub, nominal[k]) / single_factor(ua, nominal[k])
            t = diagonal_factor(ub, nominal[k]) / diagonal_factor(ua, nominal[k])
            part = singles[1, i] * (t - 1.0) + singles[1, j] * (1.0 / t - 1.0)
            part -= 2.0 * n * (singles[0, i] * (s - 1.0) + singles[0, j] * (1.0 / s - 1.0))
            c_change += whole(max(min(scales[CD2] * part, CLAMP), -CLAMP))
            cost += weights[CD2] * np.float64(c_change)
        if on[MAXPRO]:
            gap_factors(x[k], nominal[k], b, shifts[k], unit, ga)
            gap_factors(x[k], nominal[k], a, shifts[k], unit, gb)
            ga[i], ga[j], gb[i], gb[j] = 1.0, 1.0, 1.0, 1.0
            m_change = product_trial(gaps[i], gaps[j], ga, gb, i, j, scales[MAXPRO], buffer, bits)
            cost += weights[MAXPRO] * np.float64(m_change)
        if on[CORRELATION]:
            r_change = correlation_trial(x, gram, gram_weights, k, i, j)
            now = values[CORRELATION]
            cost += weights[CORRELATION] * (root8(now + r_change, pairs) - root8(now, pairs))
        if resumed != 2:
            uniform = np.float64(np.int64(word(state) >> S40)) / 16777216.0
            if cost > heat[0] * uniform:
                continue
            if ask:
                progress[COLUMN], progress[FIRST], progress[SECOND] = k, i, j
                progress[PENDING] = 1
                return
        progress[ACCEPTED] += 1
        if on[PHI]:
            values[PHI] += np.float64(distance_accept(squares, rows, step, i, j, h, scales[PHI]))
        if on[CD2]:
            product_accept(products, fa, fb, i, j)
            singles[0, i] *= s
            singles[0, j] /= s
            singles[1, i] *= t
            singles[1, j] /= t
            values[CD2] += np.float64(c_change)
        if on[MAXPRO]:
            product_accept(gaps, ga, gb, i, j)
            values[MAXPRO] += np.float64(m_change)
        if on[CORRELATION]:
            jump = np.float64(b - a)
            for l in range(d):
                if l != k:
                    gram[k, l] += jump * np.float64(x[l, i] - x[l, j])
                    gram[l, k] = gram[k, l]
            values[CORRELATION] += r_change
            values[CHANGES] += 1.0
            if values[CORRELATION] < 0.5 * values[FRESH] or values[CHANGES] >= 256.0:
                # sums of r^8 fall by many orders of magnitude: old rounding must not outlive them
                values[CORRELATION] = eighth_powers(gram, gram_weights)
                values[FRESH] = values[CORRELATION]
                values[CHANGES] = 0.0
        swap_in(e, holder, x, u, k, i, j)
        note(log, progress[LOGGED], k, i, j)
        progress[LOGGED] += 1
        now = merit(on, weights, values, pairs)
        if now < best_values[4]:
            for c in range(4):
                best_values[c] = values[c]
            best_values[4] = now
            catch_up(e, best, log, progress[LOGGED])
            progress[LOGGED] = 0


@kernel()
def merit(on, weights, values, pairs):
    """What the search lowers: the weighted sum of the criteria."""
    total = 0.0
    for c in range(3):
        if on[c]:
            total += weights[c] * values[c]
    if on[CORRELATION]:
        total += weights[CORRELATION] * root8(values[CORRELATION], pairs)
    return total
