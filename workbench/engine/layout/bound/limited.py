"""The bound formulation with limits beside the rows: an exact penalty, and the curvature of what binds.

    min over (d, s) of  max_j [ g_j + dg_j d + |W_j d|^2/2 ] + |V d|^2/2 + rho s
    subject to          c_l + margin + dc_l d <= s,   s >= 0,   A d <= b,   lo <= d <= hi

The penalty is exact for rho above the sum of the prices of the limits (Fletcher 1989), which rho follows. V'V
is the curvature of the limits weighted by their prices, learnt from gradients by BFGS updates that begin with
nothing. The margin keeps iterates on the feasible side: it follows what the last step broke.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..formulation.problem import Evaluation, LimitRow
from .quadratic import BoundStep, quadratic_bound

__all__ = ["LimitPenalty", "limited_bound"]

Array = NDArray[np.float64]

_LEAST_MARGIN = 1e-9  # in the unit of the limits
_PAIRS = 30  # of the curvature
_FLAT = 1e-8  # s'y of a pair below this share of |s||y| says nothing
_DEAREST = 1e4  # rho in units of the value, a violation of 1 being as large as the limit
_CHEAPEST = 0.1
_LEFT = 1e-5  # violation in a model that a larger rho might still remove


@dataclass(slots=True, kw_only=True)
class LimitPenalty:
    """What a local search knows of its limits.

    rho: price of a violation of 1, in the unit of the objective    margin: added to all limits
    curvature: (k, members) V    prices: (c,) of the limits at the last step
    """

    rho: float = 0.0
    margin: float = _LEAST_MARGIN
    curvature: Array = field(default_factory=lambda: np.zeros((0, 0)))
    prices: Array = field(default_factory=lambda: np.zeros(0))

    def merit(self, evaluation: Evaluation) -> float:
        """The largest row plus the penalty."""
        worst = float(np.max(np.asarray(evaluation.constraints) + self.margin, initial=0.0))
        return float(np.max(evaluation.values)) + self.rho * worst

    def begin(self, unit: float) -> None:
        """A first price where there is none, low: it is raised as soon as a violation is left."""
        self.rho = self.rho or _CHEAPEST * unit

    def curved(self, step: Array) -> float:
        """|V d|^2/2, in the unit of the objective."""
        return 0.5 * float(((self.curvature @ step) ** 2).sum()) if self.curvature.size else 0.0

    def keep_inside(self, evaluation: Evaluation, radius: float) -> None:
        """Set the margin after a step of this radius."""
        if evaluation.constraints.size:
            broken = float(np.max(evaluation.constraints))
            self.margin = float(
                np.clip(broken, _LEAST_MARGIN, max(0.3 * self.margin, 0.02 * radius, _LEAST_MARGIN))
            )

    def tightened(self) -> bool:
        """Make the margin smaller, once the steps promise nothing more; False when it is the smallest."""
        if self.margin <= 2 * _LEAST_MARGIN:
            return False
        self.margin = max(_LEAST_MARGIN, 0.1 * self.margin)
        return True

    def violation(self, evaluation: Evaluation) -> float:
        """The largest violation of a limit, without the margin."""
        return float(np.max(np.asarray(evaluation.constraints), initial=0.0))

    def follow(self, prices: Array, slack: float, unit: float) -> bool:
        """Raise rho where the prices are near it, and more where a violation is left; True when raised."""
        self.prices = prices
        total = float(prices.sum())
        if slack <= _LEFT:
            # neither far above the prices, or steps that bend a little past a limit would be refused
            self.rho = float(np.clip(self.rho, 2.0 * total, max(4.0 * total, _CHEAPEST * unit)))
            return False
        wanted = min(3.0 * self.rho, _DEAREST * unit)
        if total < 0.9 * self.rho or wanted <= self.rho:
            return False
        self.rho = wanted
        return True

    def learn(self, step: Array, before: Evaluation, after: Evaluation) -> None:
        """One more pair of the curvature: the step, and how the priced slopes of the limits changed."""
        if len(self.prices) != len(before.constraints):
            return
        match = _same_rows(before.limit_rows, after.limit_rows)
        pairs = [(i, j) for i, j in enumerate(match) if self.prices[i] > 0.0 and j is not None]
        if not pairs:
            return
        here, there = (np.array(side, dtype=np.intp) for side in zip(*pairs, strict=True))
        bent = after.constraint_gradients[there] - before.constraint_gradients[here]
        change = np.asarray(self.prices[here] @ bent)
        V = self.curvature if self.curvature.size else np.zeros((0, len(step)))
        u = V @ step
        if u @ u > 0.0:
            V = V - np.outer(u, u @ V) / (u @ u)
        along = float(change @ step)
        if along > _FLAT * float(np.linalg.norm(change) * np.linalg.norm(step)):
            V = np.vstack([V, change / np.sqrt(along)])
        self.curvature = V[-_PAIRS:]


def _same_rows(before: Sequence[LimitRow], after: Sequence[LimitRow]) -> list[int | None]:
    """For every row the one of the same limit and scenario afterwards that is nearest in time."""
    found: list[int | None] = []
    for row in before:
        best, near = None, np.inf
        for i, other in enumerate(after):
            if (other.limit, other.scenario) != (row.limit, row.scenario):
                continue
            apart = 0.0 if np.isnan(row.time) else abs(other.time - row.time)
            if apart < near:
                best, near = i, apart
        found.append(best)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitedStep:
    """Solution of the bound formulation with limits: beside it the violation left and the prices (c,)."""

    solved: BoundStep
    slack: float
    prices: Array


def limited_bound(
    c: Array, G: Array, W: Array | None, A: Array, b: Array, lo: Array, hi: Array,
    *, penalty: LimitPenalty, limits: Array, limit_gradients: Array, unit: float, tolerance: float,
) -> LimitedStep:  # fmt: skip
    """Minimise the largest of convex quadratics under budgets and linearised limits in a box.

    Args:    c (r,), G (r, n), W (r, k, n) or None: rows, over `unit`    A (m, n), b (m,) >= 0
             lo <= 0 <= hi    limits (l,), limit_gradients (l, n): feasible where <= 0
    """
    r, n = G.shape
    shifted = limits + penalty.margin
    begin = max(0.0, float(shifted.max()))
    size = np.maximum(np.abs(limit_gradients) @ (hi - lo), 1e-3)  # a row may not see the densities
    V = penalty.curvature / np.sqrt(unit)
    factor = np.zeros((r, 0, n)) if W is None else W
    if len(V):
        factor = np.concatenate([factor, np.broadcast_to(V, (r, *V.shape))], axis=1)
    room = np.concatenate([factor, np.zeros((*factor.shape[:2], 1))], axis=2)
    stretch = begin + 1e-3  # so that the violation is a variable of the size of a density
    solved = quadratic_bound(
        c + penalty.rho / unit * begin,
        np.hstack([G, np.full((r, 1), stretch * penalty.rho / unit)]),
        room if factor.shape[1] else None,
        np.vstack([
            np.hstack([A, np.zeros((len(A), 1))]),
            np.hstack([limit_gradients, np.full((len(limits), 1), -stretch)]) / size[:, None],
        ]),
        np.r_[b, (begin - shifted) / size],
        np.r_[lo, -begin / stretch], np.r_[hi, 0.1], tolerance=tolerance,
    )  # fmt: skip
    step = BoundStep(
        step=solved.step[:-1], bound=solved.bound, row_multipliers=solved.row_multipliers,
        budget_multipliers=solved.budget_multipliers[: len(A)], iterations=solved.iterations, gap=solved.gap,
    )  # fmt: skip
    slack = max(0.0, float((shifted + limit_gradients @ step.step).max()))
    prices = np.maximum(solved.budget_multipliers[len(A) :], 0.0) / size * unit
    return LimitedStep(solved=step, slack=slack, prices=prices)
