"""Time loops over any `Equations`, and their discrete adjoints: the alpha family and BDF2, written in Python.

The compiled loop of `planar/_kernels/alpha` does the same for planar systems without user laws, some thirty
times faster.

BDF2: v_n = D q_n, M D v_n + F(q_n, v_n) + Phi_q^T lambda_n = 0, Phi(q_n) = 0 with
D x_n = (3/2 x_n - 2 x_{n-1} + 1/2 x_{n-2})/h, and (x_1 - x_0)/h in the first step.
"""

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import NotConverged
from .equations import Equations
from .grids import one_step_length, step_changes
from .run_state import RunState
from .schemes import BDF2, GeneralisedAlpha, VelocityVerlet

__all__ = ["Nodes", "Pulled", "alpha_adjoint_loop", "alpha_loop", "bdf2_adjoint_loop", "bdf2_loop"]

Array = np.ndarray[Any, Any]

Start = tuple[Array, Array, Array, Array] | RunState

FLOOR = 1e-9  # updates this small relative to the accelerations, and no longer shrinking, are rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Nodes:
    """States at all nodes, the Newton steps they took, and what the next step would look at: a, and the
    largest acceleration."""

    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    newton: int
    left: tuple[Array, ...]


def saddle(block: Array, jacobian: Array, shift: float) -> Array:
    """[[block, J^T], [J, -shift]]."""
    n, m = len(block), len(jacobian)
    out = np.zeros((n + m, n + m), block.dtype)
    out[:n, :n] = block
    out[:n, n:] = jacobian.T
    out[n:, :n] = jacobian
    out[n:, n:] = -shift * np.eye(m)
    return out


def _empty(start: Start, times: Array) -> tuple[tuple[Array, ...], int, tuple[Array, Array]]:
    """Series of q, v, w and lambda, how many of their nodes are known, a and the largest acceleration."""
    if isinstance(start, RunState):
        first = [start.earlier[name] for name in ("position", "velocity", "acceleration", "multiplier")]
        left = start.auxiliary.copy(), start.solver[0].copy()
    else:
        first = [x[None] for x in start]
        left = start[2].copy(), np.abs(start[2]).max(initial=0.0, keepdims=True)

    def series(rows: Array) -> Array:
        out = np.zeros((len(times), rows.shape[1]), np.result_type(*first))  # complex in complex step
        out[: len(rows)] = rows
        return out

    return tuple(series(x) for x in first), len(first[0]), left


def _nodes(series: tuple[Array, ...], known: int, newton: int, left: tuple[Array, Array]) -> Nodes:
    q, v, w, lam = (x[known - 1 :] for x in series)
    a, largest = left
    largest = np.maximum(largest, np.abs(w).max(initial=0.0))
    return Nodes(position=q, velocity=v, acceleration=w, multiplier=lam, newton=newton, left=(a, largest))


def _newton(
    equations: Equations,
    node: int,
    time: float,
    series: tuple[Array, ...],
    largest: Array,
    known: tuple[Array, Array, Array],
    factors: tuple[float, float, float],
    scheme: Any,
    shift: float,
) -> int:
    """Solve one step for dw: q, v, w move by factors times dw; returns the Newton steps taken.

    largest: (1,) acceleration of earlier runs.
    """
    q, v, w, lam = (x[node] for x in series)
    q[:], v[:], w[:] = known
    by_q, by_v, by_w = factors
    n = equations.size
    old = np.inf
    for count in range(1, scheme.iterations + 1):
        equations.look(node, q, v, lam)
        block = by_w * equations.mass + by_v * equations.damping + by_q * equations.stiffness
        right = np.concatenate(
            [-(equations.mass @ w + equations.force), -equations.constraint / (by_q or 1.0)]
        )
        move = np.linalg.solve(saddle(block, equations.jacobian, shift), right)
        q += by_q * move[:n]
        v += by_v * move[:n]
        w += by_w * move[:n]
        lam += move[n:]
        size = float(np.abs(by_w * move[:n]).max())
        level = max(float(np.abs(series[2][: node + 1]).max()), float(largest[0]), 1e-300)
        floor = FLOOR * level
        if equations.rows:
            floor = max(floor, 1e-12 * max(1.0, float(np.abs(q).max())) * by_w / by_q)
        # full Newton: the error left is quadratic in the update
        if size <= np.sqrt(scheme.tolerance) * 1e-2 * level or (size <= floor and size > 0.3 * old):
            return count
        if not np.isfinite(size):
            break
        old = size
    raise NotConverged(
        f"{type(scheme).__name__} stopped at t = {time:.6g} s: {scheme.iterations} Newton steps left an "
        f"acceleration update of {size:.2g}. Take more steps, or look at the forces near that time",
        time,
    )


def alpha_loop(
    equations: Equations,
    scheme: GeneralisedAlpha | VelocityVerlet,
    times: Array,
    start: Start,
    shift: float,
) -> Nodes:
    """Integrate from consistent q, v, w, lambda at node 0, or from where an earlier run ended.

    times: of the nodes of that run, too, as `earlier_times` has them.
    """
    series, known, (a, largest) = _empty(start, times)
    position, velocity, acceleration, multiplier = series
    am, af, gamma, beta = scheme.numbers
    grid = step_changes(
        times[known - 1 :],
        joints=equations.rows > 0,
        before=start.step if isinstance(start, RunState) else None,
    )
    c = (1.0 - af) / (1.0 - am)
    total = 0
    for node in range(known, len(times)):
        w = acceleration[node - 1]
        h, along = grid[:, node - known + 1]
        a = along * a + (1.0 - along) * w  # as in the compiled loop
        base = (af * w - am * a) / (1.0 - am)
        a1 = base + c * w
        q = position[node - 1] + h * velocity[node - 1] + h * h * ((0.5 - beta) * a + beta * a1)
        v = velocity[node - 1] + h * ((1.0 - gamma) * a + gamma * a1)
        multiplier[node] = multiplier[node - 1]
        factors = (h * h * beta * c, h * gamma * c, 1.0)
        total += _newton(
            equations, node, float(times[node]), series, largest, (q, v, w), factors, scheme, shift
        )  # fmt: skip
        a = base + c * acceleration[node]
    return _nodes(series, known, total, (a, largest))


class Pulled(NamedTuple):
    """What a backward loop found, over the nodes up to the last with a seed."""

    gradient: Array  # (N,) sum of (dF/dscale)^T mu
    mu: Array  # (nodes, n)
    nu: Array  # (nodes, m) adjoint of Phi, of Phi'' at the start
    by_q: Array  # (n,) slopes by the place at the start, its own equations left out
    by_v: Array


def alpha_adjoint_loop(
    equations: Equations, scheme: GeneralisedAlpha | VelocityVerlet, grid: Array, nodes: Any, seeds: Any,
    *, given: bool = False,
) -> Pulled:  # fmt: skip
    """Back over a run; `nodes` and `seeds` hold position, velocity, acceleration, multiplier.

    grid: (2, nodes) as from `step_changes`.  given: whether node 0 comes from an earlier run, so that no
    equations were solved there.
    """
    am, af, gamma, beta = scheme.numbers
    c = (1.0 - af) / (1.0 - am)
    n = equations.size
    gradient = np.zeros(equations.members)
    mus, nus = np.zeros((seeds.last + 1, n)), np.zeros((seeds.last + 1, equations.rows))
    lq, lv, la, lw = (np.zeros(n) for _ in range(4))
    for node in range(seeds.last, -1, -1):
        q, v = nodes.position[node], nodes.velocity[node]
        equations.look(node, q, v, nodes.multiplier[node])
        lq = lq + seeds.position[node]
        lv = lv + seeds.velocity[node]
        lw = lw + seeds.acceleration[node]
        if given and node == 0:
            break
        h, along = grid[:, node]
        hb, hg, share = (h * h * beta, h * gamma, c) if node else (0.0, 0.0, 1.0)
        block = equations.mass + share * (hg * equations.damping + hb * equations.stiffness)
        right = np.concatenate([-(lw + share * (la + hg * lv + hb * lq)), -seeds.multiplier[node]])
        jacobian = equations.jacobian.copy()
        found = np.linalg.lstsq(saddle(block, jacobian, 0.0).T, right, rcond=1e-13)[0]
        mu = mus[node] = found[:n]
        nus[node] = found[n:] / (share * hb if node else 1.0)
        if node:
            tq = lq + equations.stiffness.T @ mu
            if equations.rows:
                tq += jacobian.T @ nus[node]
            tv = lv + equations.damping.T @ mu
            ta = la + hg * tv + hb * tq
            lq, lv = tq, tv + h * tq
            la = h * h * (0.5 - beta) * tq + h * (1.0 - gamma) * tv - am / (1.0 - am) * ta
            lw = af / (1.0 - am) * ta + (1.0 - along) * la
            la = along * la
        equations.contract(node, q, v, mu.copy(), gradient)
    return Pulled(gradient, mus, nus, lq, lv)


def _bdf(node: int) -> tuple[float, float, float]:
    return (1.5, -2.0, 0.5) if node > 1 else (1.0, -1.0, 0.0)


def bdf2_loop(equations: Equations, scheme: BDF2, times: Array, start: Start, shift: float) -> Nodes:
    """Integrate from consistent q, v (w and lambda of node 0 are kept for the record only), or from where an
    earlier run ended.

    times: as in `alpha_loop`.
    """
    series, known, left = _empty(start, times)
    position, velocity, acceleration, multiplier = series
    before = start.step if isinstance(start, RunState) else None
    h, total = one_step_length(times[known - 1 :], "BDF2", before), 0
    for node in range(known, len(times)):
        b0, b1, b2 = _bdf(node)
        q1, v1 = position[node - 1], velocity[node - 1]
        q2, v2 = position[max(node - 2, 0)], velocity[max(node - 2, 0)]
        multiplier[node] = multiplier[node - 1]
        guess = q1 + h * v1 + 0.5 * h * h * acceleration[node - 1]
        v = (b0 * guess + b1 * q1 + b2 * q2) / h
        w = (b0 * v + b1 * v1 + b2 * v2) / h
        factors = ((h / b0) ** 2, h / b0, 1.0)
        total += _newton(
            equations, node, float(times[node]), series, left[1], (guess, v, w), factors, scheme, shift
        )  # fmt: skip
    return _nodes(series, known, total, left)


def bdf2_adjoint_loop(equations: Equations, h: float, nodes: Any, seeds: Any, before: int = 0) -> Pulled:
    """Back over a run of BDF2; acceleration seeds act through w_n = D v_n.

    before: nodes of an earlier run that were known beside its last one.
    """
    n, last = equations.size, seeds.last
    gradient = np.zeros(equations.members)
    mus, etas = np.zeros((last + 3, n)), np.zeros((last + 3, n))
    nus = np.zeros((last + 1, equations.rows))
    mass = equations.mass
    for node in range(last, -1, -1):
        q, v = nodes.position[node], nodes.velocity[node]
        b0 = _bdf(node + before)[0] / h if node else 0.0
        later_v, later_q = seeds.velocity[node].copy(), seeds.position[node].copy()
        later_v += b0 * seeds.acceleration[node]
        for ahead in (1, 2):
            if node + ahead <= last:
                b = _bdf(node + ahead + before)[ahead] / h
                later_v += b * (mass @ mus[node + ahead] + seeds.acceleration[node + ahead])
                later_q -= b * etas[node + ahead]
        if node == 0:
            break
        equations.look(node, q, v, nodes.multiplier[node])
        drag = b0 * mass + equations.damping.T
        right = np.concatenate([-(later_q + b0 * later_v), -seeds.multiplier[node]])
        jacobian = equations.jacobian.copy()
        block = (b0 * drag + equations.stiffness.T).T
        # columns of the constraint are scaled like the step itself
        found = np.linalg.lstsq(
            saddle(block / b0**2, jacobian, 0.0).T, np.append(right[:n] / b0**2, right[n:]), rcond=1e-13
        )[0]
        mus[node] = found[:n]
        nus[node] = found[n:] * b0**2
        etas[node] = -(later_v + drag @ mus[node])
        equations.contract(node, q, v, mus[node].copy(), gradient)
    return Pulled(gradient, mus[: last + 1], nus, later_q, later_v)
