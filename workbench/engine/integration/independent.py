"""Schemes in independent coordinates: runs and exact gradients of systems whose joints hold on every level.

Redundant joints are told apart from contradicting ones at every step: a row that the independent rows do not
imply stops the run by name.
"""

import logging
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..errors import NotConverged
from ._kernels.chart import SINGULAR
from ._kernels.independent import independent_adjoint, independent_forward
from ._kernels.independent_rk import (
    POINTS,
    STAGES,
    independent_rk8,
    independent_rk8_adjoint,
)
from .chart import Chart, Rates
from .grids import one_step_length, step_lengths
from .run_state import RunState, earlier_nodes, earlier_times
from .schemes import IndependentAlpha, Scheme

__all__ = [
    "IndependentEquations",
    "March",
    "Pulled",
    "Splits",
    "independent_state",
    "march",
    "march_rk8",
    "notices",
    "pulled_alpha",
    "pulled_rk8",
]

Array = np.ndarray[Any, Any]
LOG = logging.getLogger("workbench.engine")

SPLITS = ("rows", "cols", "rank", "tight", "bridged")
CONSISTENT = 1e-8  # m or rad: what the independent joints may leave of a redundant one
NEAR = 1e-3  # share of the largest pivot below which rounding of the joints shows in the accelerations
DEAD = 3e-5  # below it a stage of order 8 is lost: rounding is multiplied by one over its cube


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Splits:
    """How every step split rows and coordinates: independent rows, dependent columns first; node 0: start.

    rows: (steps + 1, m).  cols: (steps + 1, n).  rank: (steps + 1,).
    tight: (steps + 1,) smallest over largest pivot of the dependent Jacobian, 0 at a dead point; of order 8
    the least of the step.  bridged: (steps + 1,) 1 where IndependentAlpha took extrapolated accelerations.
    """

    rows: Array
    cols: Array
    rank: Array
    tight: Array
    bridged: Array


class IndependentEquations(NamedTuple):
    """A system as the kernels see it: tables, work space, rates of what is prescribed, the split's arrays."""

    tables: Any
    work: Any
    rates: Rates
    chart: Chart
    row_names: tuple[str, ...]


class March(NamedTuple):
    """States at the nodes, the splits, the number of evaluations, and what the next step would look at."""

    position: Array
    velocity: Array
    acceleration: Array
    multiplier: Array
    splits: Splits
    evaluations: int
    equations: IndependentEquations
    left: tuple[Array, ...]


def _left(equations: IndependentEquations) -> list[Array]:
    """The arrays of work space and chart: they hold the equations at the point seen last."""
    return [x for part in (equations.work, equations.chart) for x in part if isinstance(x, np.ndarray)]


def _begun(equations: IndependentEquations, start: RunState, arrays: tuple[Array, ...]) -> tuple[Array, ...]:
    """Arrays of a run with the nodes of an earlier one in front, whose last point the equations then hold."""
    own = _left(equations)
    for array, left in zip(own, start.solver[-len(own) :], strict=True):
        array[...] = left
    names = ("position", "velocity", "acceleration", "multiplier", *SPLITS)
    return tuple(np.concatenate([start.earlier[name], x[1:]]) for name, x in zip(names, arrays, strict=True))


def independent_state(run: March, times: Array, scheme: Scheme, start: RunState | None) -> RunState:
    """What a run leaves at its last node."""
    # the accelerations of a step are extrapolated over three nodes, that of the system's start left out
    count = 5 if isinstance(scheme, IndependentAlpha) else 1
    splits = {name: getattr(run.splits, name) for name in SPLITS}
    none = np.zeros((len(times), 0))
    lengths = step_lengths(times, None if start is None else start.step)
    return RunState(
        time=float(times[-1]), step=float(lengths[-1]), scheme=scheme, position=run.position[-1],
        velocity=run.velocity[-1], acceleration=run.acceleration[-1], multiplier=run.multiplier[-1],
        states=none[-1], state_rates=none[-1], auxiliary=run.left[0].copy(),
        earlier=earlier_nodes(
            start, count, times=times, position=run.position, velocity=run.velocity,
            acceleration=run.acceleration, multiplier=run.multiplier, **splits,
        ),
        solver=tuple(x.copy() for x in (*run.left[1:], *_left(run.equations))),
    )  # fmt: skip


def _empty(equations: IndependentEquations, times: Array, q0: Array, v0: Array) -> tuple[Array, ...]:
    nodes, n, m = len(times), len(q0), len(equations.row_names)
    kind = np.result_type(q0, equations.chart.mass)
    q, v, w = (np.zeros((nodes, n), kind) for _ in range(3))
    q[0], v[0] = q0, v0
    return (
        q, v, w, np.zeros((nodes, m), kind),
        np.zeros((nodes, m), np.int64), np.zeros((nodes, n), np.int64), np.zeros(nodes, np.int64),
        np.ones(nodes), np.zeros(nodes, np.int64),
    )  # fmt: skip


def march(
    equations: IndependentEquations, scheme: IndependentAlpha, times: Array, q0: Array, v0: Array,
    start: RunState | None = None,
) -> March:  # fmt: skip
    """Generalised-alpha from a closed state, or from where an earlier run ended. Raises NotConverged.

    `equations` is sampled at the nodes of `earlier_times(start, times)`.
    """
    before = None if start is None else start.step
    n, h = len(q0), one_step_length(times, "IndependentAlpha", before)
    arrays = _empty(equations, times, q0, v0)
    acc, carried, info = np.zeros(n, arrays[0].dtype), np.zeros(3), np.zeros(5)
    known = 0
    if start is not None:
        arrays, known = _begun(equations, start, arrays), start.known
        acc[:], carried[:] = start.auxiliary, start.solver[0]
    q, v, w, lam, rows, cols, rank, tight, bridged = arrays
    independent_forward(
        *equations[:4], scheme.numbers, h, q, v, w, lam, acc, rows, cols, rank, tight, bridged,
        np.zeros((n, n), q.dtype), np.zeros(n, np.int64), np.zeros(n, q.dtype),
        np.array([scheme.tolerance, scheme.iterations]), info, known, carried,
    )  # fmt: skip
    _check(equations, earlier_times(start, times), info, f"IndependentAlpha(rho={scheme.rho:g})", rows)
    q, v, w, lam, rows, cols, rank, tight, bridged = (x[max(known - 1, 0) :] for x in arrays)
    splits = Splits(rows=rows, cols=cols, rank=rank, tight=tight, bridged=bridged)
    return March(q, v, w, lam, splits, int(info[2]), equations, (acc, carried))


def march_rk8(
    equations: IndependentEquations, tableau: tuple[Array, Array], times: Array, q0: Array, v0: Array,
    start: RunState | None = None,
) -> tuple[March, Array, Array]:  # fmt: skip
    """Order 8 from a closed state, or from where an earlier run ended, and the states at all stages.

    `equations` is sampled at `point_times`.
    """
    n, m, steps = len(q0), len(equations.row_names), len(times) - 1
    arrays = _empty(equations, times, q0, v0)
    last, info = np.zeros((2, n + m), arrays[0].dtype), np.zeros(5)
    if start is not None:
        arrays = _begun(equations, start, arrays)
        last[0, :n], last[1, :m] = start.acceleration, start.multiplier
    q, v, w, lam, rows, cols, rank, tight, bridged = arrays
    sq, sv = np.zeros((POINTS * steps + 1, n), q.dtype), np.zeros((POINTS * steps + 1, n), q.dtype)
    sq[0], sv[0] = q[0], v[0]
    independent_rk8(
        *equations[:4], *tableau, times, q, v, w, lam, sq, sv, np.zeros((STAGES, n), q.dtype),
        last, rows, cols, rank, tight, info, 0 if start is None else 1,
    )  # fmt: skip
    _check(equations, times, info, "RungeKutta8", rows)
    worst = int(tight.argmin())
    if tight[worst] < DEAD:
        raise NotConverged(
            f"RungeKutta8 met a dead point of the joints before t = {times[worst]:.6g} s, where order 8 "
            "loses its "
            f"accuracy (pivot {tight[worst]:.1g} of the largest). Take another number of steps, or "
            "GeneralisedAlpha(rho=1), which steps over it",
            float(times[worst]),
        )
    splits = Splits(rows=rows, cols=cols, rank=rank, tight=tight, bridged=bridged)
    return March(q, v, w, lam, splits, POINTS * steps, equations, (np.zeros(0),)), sq, sv


def point_times(times: Array, nodes: Array) -> Array:
    """(13 steps,) times of all stages, with the node at the end of every step after them; nodes: c (12,)."""
    ends = np.append(nodes, 1.0)
    return np.asarray((times[:-1, None] + np.diff(times)[:, None] * ends).ravel())


def notices(scheme: str, run: March, redundant: tuple[str, ...], times: Array) -> tuple[str, ...]:
    """What a user should know of a run, a sentence each; also logged."""
    out = []
    if redundant:
        out.append(
            f"redundant joint rows are set aside, and carry no joint force of their own: "
            f"{'; '.join(redundant)}"
        )
    over = np.flatnonzero(run.splits.bridged)
    if len(over):
        out.append(
            f"{len(over)} steps next to a dead point of the joints took extrapolated accelerations, the "
            "first at "
            f"t = {times[over[0]]:.6g} s"
        )
    near = np.flatnonzero(run.splits.tight < NEAR)
    if scheme == "RungeKutta8" and len(near):
        worst = int(run.splits.tight.argmin())
        out.append(
            f"a stage came close to a dead point of the joints at t = {times[worst]:.6g} s (pivot "
            f"{run.splits.tight[worst]:.1g} of the largest): expect less than order 8, and compare two "
            "step numbers"
        )
    for sentence in out:
        LOG.warning(sentence)
    return tuple(out)


def _check(equations: IndependentEquations, times: Array, info: Array, name: str, rows: Array) -> None:
    step = int(info[1])
    time = float(times[min(max(step, 0), len(times) - 1)])
    h = float(times[max(step, 1)] - times[max(step, 1) - 1])
    if info[0] != 0:
        cause = {
            1: f"the accelerations of a step did not settle (last update {info[3]:.2g})",
            SINGULAR: "the motion left by the joints is not determined: a mass is missing, or this is a dead "
            "point",
        }.get(int(info[0]), "the joints could not be closed")
        raise NotConverged(
            f"{name} stopped at t = {time:.6g} s (step {h:.3g} s): {cause}. Take more steps, or look at the "
            "joints and masses near that time",
            time,
        )
    if info[4] > CONSISTENT:
        lost = sorted({equations.row_names[r] for r in rows[-1]} - _independent(equations, rows))
        raise NotConverged(
            f"{name}: redundant rows do not agree with the others along the motion (off by {info[4]:.2g}): "
            f"{'; '.join(lost) or 'they change along the motion'}. They were redundant at the start only: "
            "check their axes and lengths, or remove them",
            time,
        )


def _independent(equations: IndependentEquations, rows: Array) -> set[str]:
    rank = int(equations.chart.rank[0])
    return {equations.row_names[r] for r in rows[-1][:rank]}


class Pulled(NamedTuple):
    """What a backward sweep found; point 0 is the start, those of order 8 are stages and nodes in turn."""

    gradient: Array  # (N,) sum of (dF/dscale)^T mu in segment order
    w: Array  # (points, n)
    lam: Array  # (points, m)
    mu: Array  # (points, n) adjoint of the equations of motion
    nu: Array  # (points, 3, m) adjoints of Phi, Phi' and Phi'', where asked for
    by_q: Array  # (n,) slopes by the place at the start
    by_v: Array


def pulled_alpha(
    equations: IndependentEquations, scheme: IndependentAlpha, h: float, run: Any, splits: Splits, seeds: Any,
    *, joints: bool = False, given: bool = False,
) -> Pulled:  # fmt: skip
    """Back over a run of `march`; run: position ... multiplier, as `kinds.Nodes`. joints: their adjoints.

    given: whether it began where an earlier run ended: the first node is held then.
    """
    n, m = run.position.shape[1], run.multiplier.shape[1]
    gradient, lam = np.zeros(len(equations.tables.scale)), run.multiplier.copy()
    mu, costate = np.zeros_like(run.position), np.zeros((6, n))
    nu = np.zeros((len(run.position) if joints else 0, 3, m))
    independent_adjoint(
        *equations[:4], scheme.numbers, h, seeds.last,
        run.position, run.velocity, run.acceleration, lam,
        splits.rows, splits.cols, splits.rank, splits.bridged,
        seeds.position, seeds.velocity, seeds.acceleration, seeds.multiplier,
        costate, np.zeros((3, n)), np.zeros((4, n)), np.zeros((n, n)), np.zeros(n, np.int64),
        mu, nu, gradient, given,
    )  # fmt: skip
    return Pulled(gradient, run.acceleration, lam, mu, nu, costate[4], costate[5])


def pulled_rk8(
    equations: IndependentEquations, tableau: tuple[Array, Array], times: Array, run: March,
    points: tuple[Array, Array], seeds: Any, *, joints: bool = False,
) -> Pulled:  # fmt: skip
    """Back over a run of `march_rk8`, whose points are given. joints: their adjoints too."""
    n, m, count = run.position.shape[1], run.multiplier.shape[1], len(points[0])
    gradient = np.zeros(len(equations.tables.scale))
    w, lam, mu = np.zeros((count, n)), np.zeros((count, m)), np.zeros((count, n))
    nu, yq, yv = np.zeros((count if joints else 0, 3, m)), np.zeros((STAGES, n)), np.zeros((STAGES, n))
    independent_rk8_adjoint(
        *equations[:4], *tableau, times, seeds.last, *points,
        run.splits.rows, run.splits.cols, run.splits.rank,
        seeds.position, seeds.velocity, seeds.acceleration, seeds.multiplier,
        np.zeros((5, n)), np.zeros((3, n)), w, lam, yq, yv, mu, nu, gradient,
    )  # fmt: skip
    return Pulled(gradient, w, lam, mu, nu, yq[0], yv[0])
