# mypy: ignore-errors
"""From the adjoint of the equations of motion to gradients, compiled: sums of (dr/dparameter)^T mu.

By density, the members are the outer loop and the nodes the inner one, a block of members at a time: a block
stays in the cache nearest to the processor while all nodes and all rows pass over it.
"""

from numba import njit
from numpy import cos, sin

from ...compiler.options import ENTRY, INNER
from ...elements._kernels_elements import parameter_slopes
from ...elements._kernels_laws import USER, law_parameters, laws
from ...elements.table import code_of
from .equations import FUSED, set_state, unit_forces
from .members import (
    measure,
    project,
    rows,
    springs_contract_two,
)
from .pairs import pair_covector

SPRING = code_of("Spring")
BLOCK = 512  # members: the eight arrays of a spring fill 32 kB


@njit(**INNER)
def spread_over_rows(b, f, first, last, covector, active, gradient):
    """gradient[r, i] += f (b . w_r) of the members first..last-1 for every active row."""
    for r in range(active):
        w0, w1, w2 = covector[r, 0], covector[r, 1], covector[r, 2]
        g = gradient[r]
        for i in range(first, last):
            g[i] += f[i] * (b[0, i] * w0 + b[1, i] * w1 + b[2, i] * w2)


@njit(**ENTRY)
def contract_history(T, W, starts, q, v, mu, big, covector, b, gradient):
    """gradient (R, N) += sum over the nodes up to starts[r] of (dF/dscale)^T mu[:, r].

    mu (nodes, R, n), starts (R,) descending; big (nodes, P, 8), covector (P, nodes, R, 3) and b (3, N) are
    work space. b is None for one row of a system of undamped springs: all else is compiled away then.
    """
    count, last_node = starts.shape[0], starts[0]
    free = mu.shape[2] // 3
    for step in range(last_node + 1):
        set_state(T.pair, T.motion, step, q[step], v[step], W.q, W.v, W.turn, W.big)
        for p in range(T.pair.shape[0]):
            for a in range(6):
                big[step, p, a] = W.big[p, a]
            big[step, p, 6], big[step, p, 7] = cos(W.big[p, 2]), sin(W.big[p, 2])
            for r in range(count):
                if starts[r] >= step:
                    w = covector[p, step, r]
                    pair_covector(W.turn, T.pair[p, 0], T.pair[p, 1], free, mu[step, r], W.big[p], w)
    for g in range(T.segment.shape[0]):
        p, code, begin, end = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        if code == USER:
            continue
        for first in range(begin, end, BLOCK):
            last = min(first + BLOCK, end)
            active, step = count, -1
            while step < last_node:
                step += 1
                while starts[active - 1] < step:
                    active -= 1
                X = big[step, p]
                if code == FUSED and active == 1:
                    here, after = step, min(step + 1, last_node)
                    step = after
                    springs_contract_two(
                        T.geometry, T.law[0], first, last, X, covector[p, here, 0],
                        big[after, p], covector[p, after, 0], 1.0 * (after - here), gradient[0],
                    )  # fmt: skip
                elif b is not None:
                    rows(T.geometry, first, last, X[0], X[1], X[2], b)
                    measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
                    unit_forces(T, W, step, code, first, last)
                    spread_over_rows(b, W.f, first, last, covector[p, step], active, gradient)


@njit(**ENTRY)
def contract_parameter_history(T, W, last, q, v, w, z, mu, by_law, by_length, by_element, by_mass, dp, dq):
    """Add the sum over the nodes up to `last` of (dr/dparameter)^T mu; see `contract_parameters`."""
    for step in range(last + 1):
        set_state(T.pair, T.motion, step, q[step], v[step], W.q, W.v, W.turn, W.big)
        for e in range(z.shape[1]):
            W.z[e] = z[step, e]
        contract_parameters(T, W, step, mu[step], w[step], by_law, by_length, by_element, by_mass, dp, dq)


@njit(**ENTRY)
def contract_points(T, W, last, q, v, mu, by_point):
    """by_point (4, N) += sum over the points up to `last` of (dF/ds)^T mu: s1x, s1y, s2x, s2y of the members.

    With d = A s1 + x - s2, d' its rate and d_w its change along the covector w, the member's part of mu^T F
    is scale f(delta, rate) d . d_w/l.
    """
    free = mu.shape[1] // 3
    w = W.row_g
    for step in range(last + 1):
        set_state(T.pair, T.motion, step, q[step], v[step], W.q, W.v, W.turn, W.big)
        for g in range(T.segment.shape[0]):
            p, code, first, end = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
            if code == USER:
                continue
            X = W.big[p]
            pair_covector(W.turn, T.pair[p, 0], T.pair[p, 1], free, mu[step], X, w)
            measure(T.geometry, first, end, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
            law_code = SPRING if code == FUSED else code
            laws(law_code, T.law, first, end, W.delta, W.rate, T.times[step], W.f, W.fd, W.fv)
            c, s = cos(X[2]), sin(X[2])
            for i in range(first, end):
                sx, sy = T.geometry[0, i], T.geometry[1, i]
                ax, ay = c * sx - s * sy, s * sx + c * sy
                dx, dy = ax + X[0] - T.geometry[2, i], ay + X[1] - T.geometry[3, i]
                vx, vy = X[3] - X[5] * ay, X[4] + X[5] * ax
                wx, wy = w[0] - w[2] * ay, w[1] + w[2] * ax
                square = dx * dx + dy * dy + T.geometry[4, i]
                l = square**0.5
                along = (dx * wx + dy * wy) / l
                speed = (dx * vx + dy * vy) / l
                # slopes by d, d' and d_w; the last two turn with the arm
                by_d = along * (W.fd[i] - W.fv[i] * speed / l - W.f[i] / l) / l
                gx = by_d * dx + (W.fv[i] * along * vx + W.f[i] * wx) / l
                gy = by_d * dy + (W.fv[i] * along * vy + W.f[i] * wy) / l
                turn = (W.fv[i] * along * X[5] + W.f[i] * w[2]) / l
                hx, hy = gx + turn * dy, gy - turn * dx
                k = T.scale[i]
                by_point[0, i] += k * (c * hx + s * hy)
                by_point[1, i] += k * (c * hy - s * hx)
                by_point[2, i] -= k * gx
                by_point[3, i] -= k * gy


@njit(**INNER)
def contract_parameters(T, W, step, mu, w_acc, by_law, by_length, by_element, by_mass, dp, dq):
    """Add (dr/dparameter)^T mu: laws (PARAMETERS, N), natural lengths (N,), elements (., E), masses (n,).

    dp (PARAMETERS,), dq (., 3): work space, dq with as many rows as by_element.
    """
    n = mu.shape[0]
    free = n // 3
    t = T.times[step]
    w = W.row_g
    for g in range(T.segment.shape[0]):
        p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
        if code == USER:
            continue
        X = W.big[p]
        pair_covector(W.turn, T.pair[p, 0], T.pair[p, 1], free, mu, X, w)
        law_code = SPRING if code == FUSED else code
        measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
        laws(law_code, T.law, first, last, W.delta, W.rate, t, W.f, W.fd, W.fv)
        project(T.geometry, first, last, X[0], X[1], X[2], w[0], w[1], w[2], W.f)
        for i in range(first, last):
            law_parameters(law_code, T.law, i, W.delta[i], W.rate[i], t, dp)
            along = T.scale[i] * W.f[i]
            by_length[i] -= along * W.fd[i]
            for k in range(dp.shape[0]):
                by_law[k, i] += along * dp[k]
    for e in range(T.element.shape[0]):
        p, code, s = T.element[e, 0], T.element[e, 1], T.element[e, 2]
        pair_covector(W.turn, T.pair[p, 0], T.pair[p, 1], free, mu, W.big[p], w)
        for k in range(dq.shape[0]):
            for a in range(3):
                dq[k, a] = 0.0
        parameter_slopes(code, T.element_data, e, W.big[p], W.z[s] if s >= 0 else 0.0, dq)
        for k in range(dq.shape[0]):
            by_element[k, e] += dq[k, 0] * w[0] + dq[k, 1] * w[1] + dq[k, 2] * w[2]
    for a in range(n):
        weight = T.gravity[a] / T.mass[a]
        by_mass[a] += mu[a] * (w_acc[a] - weight)
