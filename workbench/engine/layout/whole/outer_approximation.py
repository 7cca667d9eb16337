"""Convex rows over whole members: outer approximation, proven to the gap it states.

Every evaluation gives tangents that lie below convex rows at all choices; the mixed integer programme (HiGHS)

    min t   subject to   g_k + dg_k (x - x_k) <= t  for all tangents so far,   x in {off, on},  count,
                         budgets, one size a group, y_a >= x for every anchor a of a state, spending

is a lower bound, and its solution is evaluated next (Duran and Grossmann 1986, Fletcher and Leyffer 1994). A
choice that the model cannot stand, a mechanism, is cut off by itself.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import Bounds, LinearConstraint, milp

from .choices import Choices, On
from .evaluated import Evaluated

__all__ = ["outer_approximation"]

Array = NDArray[np.float64]

_CLOSED = 1e-6  # relative gap at which the best choice is the optimum
_SECONDS = 5.0  # for one mixed integer programme


def outer_approximation(seen: Evaluated, choices: Choices, *, until: int) -> float:
    """Evaluate until the bound meets the best choice, or `until` evaluations; the bound, -inf without one."""
    bound = -np.inf
    while len(seen.values) < until:
        found = _master(seen, choices)
        if found is None:  # nothing that is not cut off is left
            return seen.values[seen.best] if len(seen.values) else bound
        on, lower = found
        bound = max(bound, lower)
        best = seen.values[seen.best] if seen.values else np.inf
        closed = np.isfinite(best) and best - bound <= _CLOSED * abs(best)
        if on is None or closed or on in seen:
            break
        seen.look(on)
    return bound


def _master(seen: Evaluated, choices: Choices) -> tuple[On | None, float] | None:
    """The next choice (None where the time ran out) and a lower bound; None when no choice is left."""
    m, bills = choices.states, choices.spending
    paid = 0 if bills is None else bills.table.shape[1]
    rows: list[Array] = []
    right: list[float] = []

    def at_most(bound: float, states: Array, t: float = 0.0, anchors: Array | None = None) -> None:
        rows.append(np.r_[states, np.zeros(paid) if anchors is None else anchors, t])
        right.append(bound)

    scale = max((abs(v) for v in seen.values if np.isfinite(v)), default=1.0)
    for on, tops, slopes in zip(seen.on, seen.tops, seen.slopes, strict=True):
        if slopes is None:  # not this one again
            at_most(float(on.sum()) - 1.0, np.where(on, 1.0, -1.0))
            continue
        for top, slope in zip(tops, slopes, strict=True):
            at_most((float(slope @ on) - float(top)) / scale, slope / scale, -1.0)
    member = (choices.group == np.arange(choices.groups)[:, None]).astype(float)  # (groups, states)
    for i, j in choices.forbidden:
        at_most(1.0, member[i] + member[j])
    for g in range(choices.groups):
        if member[g].sum() > 1.0:
            at_most(1.0, member[g])
        if choices.always[g]:
            at_most(-1.0, -member[g])
    at_most(float(choices.count), choices.sizes.astype(float))
    for cost, limit in zip(choices.costs, choices.limits, strict=True):
        at_most(float(limit), cost)
    if bills is not None and np.isfinite(bills.at_most):
        at_most(bills.at_most, bills.states, anchors=np.full(paid, bills.anchor))
        for state, anchor in np.argwhere(bills.table):
            at_most(0.0, np.eye(m)[state], anchors=-np.eye(paid)[anchor])
    known = any(s is not None for s in seen.slopes)
    least = -np.inf if known else 0.0  # without tangents: as many states as there may be
    solved = milp(
        np.r_[np.zeros(m) if known else -np.ones(m), np.zeros(paid), 1.0],
        constraints=LinearConstraint(np.array(rows), -np.inf, np.array(right)),
        bounds=Bounds(np.r_[np.zeros(m + paid), least], np.r_[np.ones(m + paid), np.inf]),
        integrality=np.r_[np.ones(m), np.zeros(paid + 1)],
        options={"time_limit": _SECONDS, "mip_rel_gap": 1e-7},
    )
    if solved.status == 2:
        return None
    lower = solved.mip_dual_bound if solved.mip_dual_bound is not None else -np.inf
    bound = float(lower) * scale if known else -np.inf
    if solved.x is None:
        return None, bound
    return np.asarray(solved.x[:m] > 0.5), bound
