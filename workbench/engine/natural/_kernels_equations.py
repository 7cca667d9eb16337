# mypy: ignore-errors
"""Systems in natural coordinates, compiled: quadratic constraints, gravity, members between points.

    Phi_r = sum_ij value q_i q_j + sum_i value q_i + constant - drive(t)

so Phi_q is linear in q, (Phi_q)' the same in v and (Phi_q)'' the same in w; the mass matrix is constant.
"""

from numba import njit
from numba.extending import overload
from numpy import sqrt

from ..compiler.options import ENTRY, INNER
from ..elements._kernels_laws import energies, laws
from ..integration._kernels.chart import add_design, applied_forces, constraint_rates
from .tables import NaturalTables


@njit(**INNER)
def quadratic_rates(T, W, R, X, step, q, v, w):
    """Fill W.phi, W.phi_q, X.rate, X.bend, X.t1, X.t2."""
    m, n = W.phi_q.shape
    for a in range(n):
        W.q[a] = q[a]
        W.v[a] = v[a]
        W.a[a] = w[a]
    for a in range(T.held.shape[0]):
        W.q[n + a] = T.held[a]
    for r in range(m):
        W.phi[r] = T.constant[r] - T.drive[step, r]
        X.t1[r] = -R.drive[step, 0, r]
        X.t2[r] = -R.drive[step, 1, r]
        for a in range(n):
            W.phi_q[r, a] = 0.0
            X.rate[r, a] = 0.0
            X.bend[r, a] = 0.0
    for e in range(T.linear.shape[0]):
        r, i, value = T.linear[e, 0], T.linear[e, 1], T.linear_value[e]
        W.phi[r] += value * W.q[i]
        if i < n:
            W.phi_q[r, i] += value
    for e in range(T.product.shape[0]):
        r, i, j, value = T.product[e, 0], T.product[e, 1], T.product[e, 2], T.product_value[e]
        W.phi[r] += value * W.q[i] * W.q[j]
        if i < n:
            W.phi_q[r, i] += value * W.q[j]
            X.rate[r, i] += value * W.v[j]
            X.bend[r, i] += value * W.a[j]
        if j < n:
            W.phi_q[r, j] += value * W.q[i]
            X.rate[r, j] += value * W.v[i]
            X.bend[r, j] += value * W.a[i]


@njit(**INNER)
def stretch(T, W, step, q, v):
    """Elongations, their rates and the forces at unit density of all members; W.q and W.v are filled."""
    n = q.shape[0]
    for a in range(n):
        W.q[a] = q[a]
        W.v[a] = v[a]
    for a in range(T.held.shape[0]):
        W.q[n + a] = T.held[a]
    for i in range(T.ends.shape[0]):
        one, two = T.ends[i, 0], T.ends[i, 1]
        square, along = 0.0 * q[0], 0.0 * q[0]
        for e in range(3):
            d = W.q[one + e] - W.q[two + e]
            square += d * d
            along += d * (W.v[one + e] - W.v[two + e])
        l = sqrt(square)
        W.delta[i] = l - T.length[i]
        W.rate[i] = along / l
    for g in range(T.segment.shape[0]):
        laws(
            T.segment[g, 0], T.law, T.segment[g, 1], T.segment[g, 2], W.delta, W.rate, T.times[step],
            W.f, W.fd, W.fv,
        )  # fmt: skip


@njit(**INNER)
def add_stiffness(W, one, two, n, f, fd, fv):
    """K and C of one member; f, fd, fv with its density."""
    l, along = 0.0 * f, 0.0 * f
    for e in range(3):
        d = W.q[one + e] - W.q[two + e]
        l += d * d
        along += d * (W.v[one + e] - W.v[two + e])
    l = sqrt(l)
    for e in range(3):
        de = (W.q[one + e] - W.q[two + e]) / l
        for g in range(3):
            dg = (W.q[one + g] - W.q[two + g]) / l
            same = 1.0 if e == g else 0.0
            turn = (W.v[one + g] - W.v[two + g]) / l - dg * along / (l * l)
            k = fd * de * dg + f / l * (same - de * dg) + fv * de * turn
            c = fv * de * dg
            if one < n:
                W.k[one + e, one + g] += k
                W.c[one + e, one + g] += c
            if two < n:
                W.k[two + e, two + g] += k
                W.c[two + e, two + g] += c
            if one < n and two < n:
                W.k[one + e, two + g] -= k
                W.k[two + e, one + g] -= k
                W.c[one + e, two + g] -= c
                W.c[two + e, one + g] -= c


@njit(**INNER)
def forces(T, W, step, q, v, lam, tangent):
    """Fill W.force = F + Phi_q^T lambda (with the W.phi_q of `quadratic_rates`) and, if tangent, W.k, W.c."""
    m, n = W.phi_q.shape
    stretch(T, W, step, q, v)
    for a in range(n):
        total = -T.gravity[a]
        for r in range(m):
            total += W.phi_q[r, a] * lam[r]
        W.force[a] = total
    if tangent:
        for a in range(n):
            for b in range(n):
                W.k[a, b] = 0.0
                W.c[a, b] = 0.0
        for e in range(T.product.shape[0]):
            r, i, j = T.product[e, 0], T.product[e, 1], T.product[e, 2]
            if i < n and j < n:
                W.k[i, j] += T.product_value[e] * lam[r]
                W.k[j, i] += T.product_value[e] * lam[r]
    for i in range(T.ends.shape[0]):
        one, two = T.ends[i, 0], T.ends[i, 1]
        pull = T.scale[i] * W.f[i] / (W.delta[i] + T.length[i])
        for e in range(3):
            part = pull * (W.q[one + e] - W.q[two + e])
            if one < n:
                W.force[one + e] += part
            if two < n:
                W.force[two + e] -= part
        if tangent:
            add_stiffness(W, one, two, n, T.scale[i] * W.f[i], T.scale[i] * W.fd[i], T.scale[i] * W.fv[i])


@njit(**INNER)
def contract(T, W, step, q, v, mu, gradient):
    """gradient (N,) += (dF/dscale)^T mu."""
    n = q.shape[0]
    stretch(T, W, step, q, v)
    for i in range(T.ends.shape[0]):
        one, two = T.ends[i, 0], T.ends[i, 1]
        total = 0.0 * q[0]
        for e in range(3):
            d = W.q[one + e] - W.q[two + e]
            if one < n:
                total += d * mu[one + e]
            if two < n:
                total -= d * mu[two + e]
        gradient[i] += W.f[i] * total / (W.delta[i] + T.length[i])


@njit(**ENTRY)
def evaluate_rates(T, W, R, X, step, q, v, w):
    """`quadratic_rates` for Python."""
    quadratic_rates(T, W, R, X, step, q, v, w)


@njit(**ENTRY)
def energy_series(T, W, q, v, out):
    """out (nodes, N): energy stored in every member at unit density."""
    for step in range(q.shape[0]):
        stretch(T, W, step, q[step], v[step])
        for g in range(T.segment.shape[0]):
            energies(
                T.segment[g, 0], T.law, T.segment[g, 1], T.segment[g, 2], W.delta, T.times[step], out[step]
            )


@overload(constraint_rates, jit_options=INNER, strict=False)
def _constraint_rates(T, W, R, X, step, q, v, w):
    if T.instance_class is NaturalTables:
        return lambda T, W, R, X, step, q, v, w: quadratic_rates(T, W, R, X, step, q, v, w)
    return None


@overload(applied_forces, jit_options=INNER, strict=False)
def _applied_forces(T, W, X, step, q, v, lam, tangent):
    if T.instance_class is NaturalTables:
        return lambda T, W, X, step, q, v, lam, tangent: forces(T, W, step, q, v, lam, tangent)
    return None


@overload(add_design, jit_options=INNER, strict=False)
def _add_design(T, W, step, q, v, mu, gradient):
    if T.instance_class is NaturalTables:
        return lambda T, W, step, q, v, mu, gradient: contract(T, W, step, q, v, mu, gradient)
    return None
