# mypy: ignore-errors
"""The tables of four criteria of a design, and what one swap changes in each: O(n) work.

Notation: run i has whole coordinate x[k, i] and position u[k, i] in [0, 1] in column k. Swapping runs i and j
in column k puts b = x_jk in the place of a = x_ik; every other run l keeps c = x_lk.

    phi_p         S = sum over pairs of (D_ij)^-h, D squared distances (whole numbers), h = p/2
    cd2           J = const - 2/n sum s_i + 1/n^2 sum C_ij, C_ij = prod_k f(u_ik, u_jk)
    maxpro        S = sum over pairs of M_ij = prod_k (|x_ik - x_jk| + shift_k)^-2
    correlation   rho = (mean over column pairs of r_kl^8)^(1/8)

Sums are sums of whole numbers (see `doe.portable._kernels_whole_sums`), so that a seed gives the same design
everywhere.
"""

from typing import NamedTuple

import numpy as np

from doe._kernel_cache import kernel
from doe.portable._kernels_whole_sums import CLAMP, MAGIC, MAGIC_BITS, inverse_power, whole

NOMINAL_GAP = 4.4816890703380645  # exp(3/2): the whole range, where random gaps have geometric mean one
APART = np.int32(2**30)


class Distances(NamedTuple):
    """Table of phi_p.

    squares: (n, n) D    rows: (n,) sums of the terms of each run, whole scale
    half_power: h    apart: squared distance of two unlike levels of a nominal column
    """

    squares: np.ndarray
    rows: np.ndarray
    half_power: int
    apart: int


class CentredProducts(NamedTuple):
    """Table of CD2.

    products: (n, n) C    singles: (2, n) s_i and C_ii
    """

    products: np.ndarray
    singles: np.ndarray


class GapProducts(NamedTuple):
    """Table of MaxPro.

    products: (n, n) M    shifts: (d,) 0 for columns whose values all differ
    unit: makes the geometric mean of random gaps one, so that a product over many columns stays in range
    """

    products: np.ndarray
    shifts: np.ndarray
    unit: float


class Correlations(NamedTuple):
    """Table of the correlation.

    gram: (d, d) G of the centred coordinates    weights: (d, d) 1 / (G_kk G_ll), 0 where it does not count
    """

    gram: np.ndarray
    weights: np.ndarray


@kernel(allocates=False)
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


@kernel(allocates=False, inner=True)
def steps(column, is_nominal, apart, a, b, out):
    """Change of the squared distance between run i and every l when i goes from a to b; -it for run j."""
    if is_nominal:
        for l in range(column.size):
            out[l] = (apart if column[l] != b else 0) - (apart if column[l] != a else 0)
    else:
        for l in range(column.size):
            out[l] = (b - a) * (a + b - 2 * column[l])


@kernel(allocates=False, inner=True)
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


@kernel(allocates=False, inner=True)
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


@kernel(allocates=False, inner=True)
def centred_factors(column, is_nominal, a, out):
    """f(a, c) = 1 + |a - 1/2| / 2 + |c - 1/2| / 2 - |a - c| / 2; levels without order all lie at the ends."""
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


@kernel(allocates=False, inner=True)
def single_factor(a, is_nominal):
    z = 0.5 if is_nominal else abs(a - 0.5)
    return 1.0 + 0.5 * z - 0.5 * z * z


@kernel(allocates=False, inner=True)
def diagonal_factor(a, is_nominal):
    return 1.5 if is_nominal else 1.0 + abs(a - 0.5)


@kernel(allocates=False, inner=True)
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


@kernel(allocates=False)
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


@kernel(allocates=False, inner=True)
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


@kernel(allocates=False, inner=True)
def product_accept(products, fa, fb, i, j):
    for l in range(fa.size):
        if l != i and l != j:
            ratio = fb[l] / fa[l]
            s, t = products[i, l] * ratio, products[j, l] / ratio
            products[i, l] = s
            products[l, i] = s
            products[j, l] = t
            products[l, j] = t


@kernel(allocates=False)
def eighth_powers(gram, weights):
    """Sum over column pairs of r^8; weights: 1 / (G_kk G_ll), 0 for columns that do not count."""
    total = 0.0
    for k in range(gram.shape[0]):
        for l in range(k):
            r4 = (gram[k, l] * gram[k, l] * weights[k, l]) ** 2
            total += r4 * r4
    return total


@kernel(allocates=False, inner=True)
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


@kernel(allocates=False, inner=True)
def root8(sum_of_powers, pairs):
    """rho, the eighth root of the mean: three correctly rounded square roots."""
    return np.sqrt(np.sqrt(np.sqrt(max(sum_of_powers, 0.0) / pairs)))
