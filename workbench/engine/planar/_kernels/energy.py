# mypy: ignore-errors
"""Energy stored in the members and its time derivative, compiled, with their slopes by state and density.

    g = sum s u(delta),   dg/dt = sum s f(delta) b.U = F.v over all bodies, driven ones and the ground too

f is the elastic force u': no dampers, no impulses, no laws of the user's own.
"""

from numba import njit
from numba.extending import overload

from ...compiler.options import ENTRY, INNER
from ...elements._kernels_elements import energy as element_energy
from ...elements._kernels_laws import (
    USER,
    elastic,
    energies,
    laws,
)
from .equations import FUSED, set_state
from .members import (
    gather_tangent,
    measure,
    springs_energy,
    springs_tangent,
)
from .pairs import spread
from .tables import SpringTables


@njit(**INNER)
def _law_energy(T, W, step, p, code, first, last, energy):
    """Fill energy (N,) of a segment at unit density."""
    X = W.big[p]
    measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
    energies(code, T.law, first, last, W.delta, T.times[step], energy)


@njit(**INNER)
def _law_power(T, W, step, p, code, first, last, explicit):
    """Fill explicit (2, N), energy and power of a segment at unit density; add F and dF/dX to the pair."""
    X = W.big[p]
    measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, explicit[1])
    energies(code, T.law, first, last, W.delta, T.times[step], explicit[0])
    for i in range(first, last):
        W.rate[i] = 0.0
    laws(code, T.law, first, last, W.delta, W.rate, T.times[step], W.f, W.fd, W.fv)
    for i in range(first, last):
        if not elastic(code):
            W.f[i] = 0.0
            W.fd[i] = 0.0
        W.fv[i] = 0.0
        explicit[1, i] *= W.f[i]
    zero = 0.0 * X[0]
    gather_tangent(
        T.geometry, T.scale, W.f, W.fd, W.fv, first, last,
        X[0], X[1], X[2], zero, zero, zero, W.fr[p], W.kr[p], W.cr[p],
    )  # fmt: skip


def law_energy(T, W, step, p, code, first, last, energy):
    """Energies of a segment that is not of undamped springs; compiled away for `SpringTables`."""


@overload(law_energy, jit_options=INNER, strict=False)
def _choose_energy(T, W, step, p, code, first, last, energy):
    if T.instance_class is SpringTables:
        return lambda T, W, step, p, code, first, last, energy: None
    return lambda T, W, step, p, code, first, last, energy: _law_energy(
        T, W, step, p, code, first, last, energy
    )


def law_power(T, W, step, p, code, first, last, explicit):
    """Power of a segment that is not of undamped springs; compiled away for `SpringTables`."""


@overload(law_power, jit_options=INNER, strict=False)
def _choose_power(T, W, step, p, code, first, last, explicit):
    if T.instance_class is SpringTables:
        return lambda T, W, step, p, code, first, last, explicit: None
    return lambda T, W, step, p, code, first, last, explicit: _law_power(
        T, W, step, p, code, first, last, explicit
    )


@njit(**ENTRY)
def member_energy_series(T, W, nodes, q, v, energy):
    """energy[a] = stored energy of the members at the a-th of the given nodes of the grid."""
    for a in range(nodes.shape[0]):
        step = nodes[a]
        set_state(T.pair, T.motion, step, q[step], v[step], W.q, W.v, W.turn, W.big)
        total = 0.0 * q[0, 0]
        for g in range(T.segment.shape[0]):
            p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
            if code == USER:
                continue
            X = W.big[p]
            if code == FUSED:
                total += springs_energy(T.geometry, T.law[0], T.scale, first, last, X[0], X[1], X[2])
            else:
                law_energy(T, W, step, p, code, first, last, W.f)
                for i in range(first, last):
                    total += T.scale[i] * W.f[i]
        energy[a] = total


@njit(**ENTRY)
def member_power(T, W, nodes, q, v, rate, slopes, k, explicit):
    """rate (nodes,) = dg/dt at the given nodes of the grid, and the slopes of g and dg/dt there.

    slopes (nodes, 2, full): dg/dq = F = d(dg/dt)/dv, and d(dg/dt)/dq = K v, over the full coordinates of all
        bodies.
    explicit (nodes, 2, N), zeros: slopes of g and dg/dt by the scales.
    k (full, full): dF/dq of the last node.
    """
    for at in range(nodes.shape[0]):
        step, by_position, by_velocity = nodes[at], slopes[at, 0], slopes[at, 1]
        set_state(T.pair, T.motion, step, q[step], v[step], W.q, W.v, W.turn, W.big)
        full = by_position.shape[0]
        for a in range(full):
            by_position[a] = 0.0
            by_velocity[a] = 0.0
            for b in range(full):
                k[a, b] = 0.0
        for p in range(T.pair.shape[0]):
            for a in range(3):
                W.fr[p, a] = 0.0
                for b in range(3):
                    W.kr[p, a, b] = 0.0
                    W.cr[p, a, b] = 0.0
        for g in range(T.segment.shape[0]):
            p, code, first, last = T.segment[g, 0], T.segment[g, 1], T.segment[g, 2], T.segment[g, 3]
            if code == USER:
                continue
            X = W.big[p]
            if code == FUSED:
                springs_tangent(
                    T.geometry, T.law[0], T.scale, first, last, X[0], X[1], X[2], W.fr[p], W.kr[p]
                )
                measure(T.geometry, first, last, X[0], X[1], X[2], X[3], X[4], X[5], W.delta, W.rate)
                for i in range(first, last):
                    force = T.law[0, i] * W.delta[i]
                    explicit[at, 0, i] = 0.5 * force * W.delta[i]
                    explicit[at, 1, i] = force * W.rate[i]
            else:
                law_power(T, W, step, p, code, first, last, explicit[at])
        power = 0.0 * q[0, 0]
        for p in range(T.pair.shape[0]):
            spread(
                W.turn, W.v, T.pair[p, 0], T.pair[p, 1], full // 3, W.big[p], W.fr[p], W.kr[p], W.cr[p],
                step >= 0, by_position, k, k, W.half,
            )  # fmt: skip
            power += W.fr[p, 0] * W.big[p, 3] + W.fr[p, 1] * W.big[p, 4] + W.fr[p, 2] * W.big[p, 5]
        for a in range(full):
            for b in range(full):
                by_velocity[b] += W.v[a] * k[a, b]
        rate[at] = power


@njit(**ENTRY)
def element_energies(T, W):
    """Energy stored in the elastic force elements at the state that `place` left in W."""
    W.out[0] = 0.0
    for e in range(T.element.shape[0]):
        element_energy(T.element[e, 1], T.element_data, e, W.big[T.element[e, 0]], W.out)
    return W.out[0]
