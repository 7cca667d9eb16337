# mypy: ignore-errors
"""Kernel of coordinate exchange (Meyer & Nachtsheim 1995): one coordinate of one run at a time.

Moving coordinate c of run i changes the model row only in the terms that hold x_c: f' = f + e on these. With
g = M^-1 f the quantities of an exchange (see `_kernels_exchange`) follow from e alone,

    v' = v + 2 e'g + e' M^-1 e,    t = v + e'g,    and the same with C = M^-1 B M^-1 for c' and s.
"""

import numpy as np

from doe._kernel_cache import kernel
from doe.optimal._kernels_exchange import TIE, update_inverse, update_middle
from doe.portable._kernels_linear import dot, times


@kernel()
def climb_coordinates(
    coded, x, inverse, middle, trace, starts, columns, held_starts, held, levels, counts, by_trace, passes
):
    """Give every coordinate its best level in turn until a pass gains nothing; the moves made.

    coded (n, d) and x (n, p) are updated in place with inverse and, for a trace criterion, middle = C.
    held[held_starts[c]:held_starts[c + 1]] lists the terms with x_c; levels[c, :counts[c]] are its values.
    """
    n, d = coded.shape
    p = x.shape[1]
    g, h, gc, hc = np.empty(p), np.empty(p), np.empty(p), np.empty(p)
    e, best_e, new = np.zeros(p), np.zeros(p), np.empty(p)
    moves = 0
    for _ in range(passes):
        before = moves
        for i in range(n):
            times(inverse, x[i], g)
            if by_trace:
                times(middle, x[i], gc)
            for c in range(d):
                first, last = held_starts[c], held_starts[c + 1]
                v = dot(g, x[i])
                ci = dot(gc, x[i]) if by_trace else 0.0
                old = coded[i, c]
                best, gain, ratio_best = old, (TIE * trace if by_trace else TIE), 1.0
                vn, tn, cn, sn = 0.0, 0.0, 0.0, 0.0
                for k in range(counts[c]):
                    coded[i, c] = levels[c, k]
                    if levels[c, k] == old:
                        continue
                    eg, ee, egc, eec = 0.0, 0.0, 0.0, 0.0
                    for q in range(first, last):
                        term = held[q]
                        value = 1.0
                        for m in range(starts[term], starts[term + 1]):
                            value *= coded[i, columns[m]]
                        e[q - first] = value - x[i, term]
                        eg += e[q - first] * g[term]
                    for q in range(first, last):
                        s = 0.0
                        for m in range(first, last):
                            s += inverse[held[q], held[m]] * e[m - first]
                        ee += s * e[q - first]
                    vj, t = v + 2.0 * eg + ee, v + eg
                    ratio = 1.0 + vj - v - (v * vj - t * t)
                    if by_trace:
                        if ratio <= TIE:
                            continue
                        for q in range(first, last):
                            egc += e[q - first] * gc[held[q]]
                            s = 0.0
                            for m in range(first, last):
                                s += middle[held[q], held[m]] * e[m - first]
                            eec += s * e[q - first]
                        cj, sij = ci + 2.0 * egc + eec, ci + egc
                        better = ((1.0 - v) * cj + 2.0 * t * sij - (1.0 + vj) * ci) / ratio
                    else:
                        cj, sij = 0.0, 0.0
                        better = ratio - 1.0
                    if better > gain + TIE * (trace if by_trace else 1.0):
                        best, gain, ratio_best = levels[c, k], better, ratio
                        vn, tn, cn, sn = vj, t, cj, sij
                        best_e[: last - first] = e[: last - first]
                coded[i, c] = best
                if best == old:
                    continue
                moves += 1
                new[:] = x[i]
                for q in range(first, last):
                    new[held[q]] += best_e[q - first]
                times(inverse, new, h)
                a, b, z = (1.0 - v) / ratio_best, tn / ratio_best, -(1.0 + vn) / ratio_best
                if by_trace:
                    times(middle, new, hc)
                    k11, k12 = a * cn + b * sn, a * sn + b * ci
                    k21, k22 = b * cn + z * sn, b * sn + z * ci
                    update_middle(
                        middle,
                        g,
                        h,
                        gc,
                        hc,
                        a,
                        b,
                        z,
                        k11 * a + k12 * b,
                        k11 * b + k12 * z,
                        k21 * b + k22 * z,
                    )
                    trace -= gain
                update_inverse(inverse, g, h, a, b, z)
                x[i] = new
                times(inverse, new, g)
                if by_trace:
                    times(middle, new, gc)
        if moves == before:
            break
    return moves
