"""The bound formulation with convex quadratic rows, solved by a primal-dual interior point.

    min over (d, t) of t   subject to   c_j + G_j d + |W_j d|^2/2 <= t     (rows: scenario x peak x neighbour)
                                        A d <= b,   lo <= d <= hi
    row multipliers y_j >= 0 (their sum is 1), budget multipliers l >= 0, bound multipliers zl, zu >= 0

The matrix of a Newton step is diagonal (bounds) plus low rank (rows, their factors and the budgets), so a
step costs O(members x rank^2): Mehrotra 1992, predictor and corrector with one step length for both sides,
as a quadratic needs. `newton_direction` is shared with the central path.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from numpy.typing import NDArray

__all__ = ["BoundState", "BoundStep", "NewtonSystem", "quadratic_bound"]

Array = NDArray[np.float64]

_ITERATIONS = 80
_STEP_TO_BOUNDARY = 0.99
_FAINT = 1e-7  # singular value, relative, below which a direction of rows and factors is left out
_FEWER = 0.5  # directions as a share of rows and factors from which a common basis saves nothing


@dataclass(slots=True, kw_only=True)
class BoundState:
    """Primal and dual variables of the bound formulation; changed in place by the solver.

    d (n,) in place of the step or the design, t the bound, s (q,) slacks of rows and budgets, y (q,) their
    multipliers, zl and zu (n,) multipliers of the bounds.
    """

    d: Array
    t: float
    s: Array
    y: Array
    zl: Array
    zu: Array

    def complementarity(self, lo: Array, hi: Array) -> float:
        """Sum of all products of slack and multiplier."""
        return float(self.y @ self.s + self.zl @ (self.d - lo) + self.zu @ (hi - self.d))

    def add(self, step: "BoundState", primal: float, dual: float) -> None:
        """Go along a direction with a step length for each side."""
        self.d = self.d + primal * step.d
        self.t += primal * step.t
        self.s = self.s + primal * step.s
        self.y = self.y + dual * step.y
        self.zl = self.zl + dual * step.zl
        self.zu = self.zu + dual * step.zu


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundStep:
    """Solution of the bound formulation.

    step (n,), bound t, row multipliers (r,), budget multipliers (m,), iterations and the relative gap left.
    """

    step: Array
    bound: float
    row_multipliers: Array
    budget_multipliers: Array
    iterations: int
    gap: float


class NewtonSystem:
    """The factorised Newton system at one state; solves for several right-hand sides.

    curvature: (n, k) columns whose outer products make the Hessian    jacobian: (q, n) rows, then budgets
    n_rows: number of rows that carry -t    residual: of the constraints
    diagonal (n,), signs (k,), slope (n,): a Hessian diag + curvature diag(signs) curvature', and its product
    with the step so far; without them the columns alone, all positive, of a Hessian at the present point.
    basis (K, n): curvature (K, k) and jacobian (q, K) are given in its rows then, K being far below k + q.
    """

    def __init__(
        self,
        state: BoundState,
        lo: Array,
        hi: Array,
        curvature: Array,
        jacobian: Array,
        n_rows: int,
        residual: Array,
        *,
        diagonal: Array | None = None,
        signs: Array | None = None,
        slope: Array | None = None,
        basis: Array | None = None,
    ) -> None:
        q = len(jacobian)
        self.state, self.jacobian, self.n_rows, self.residual = state, jacobian, n_rows, residual
        self.basis = basis
        least = np.finfo(float).eps * (hi - lo)  # a step that ends at a bound but for rounding
        self.below, self.above = np.maximum(state.d - lo, least), np.maximum(hi - state.d, least)
        self.unit = np.r_[np.ones(n_rows), np.zeros(q - n_rows)]
        self.dual_residual = self._to_members(jacobian.T @ state.y) - state.zl + state.zu
        self.weight = state.zl / self.below + state.zu / self.above
        if slope is not None:
            self.dual_residual += slope
        if diagonal is not None:
            self.weight += diagonal
        self.low_rank = np.hstack([curvature, jacobian.T])
        self.first = curvature.shape[1]
        size = self.first + q + 1
        matrix = np.zeros((size, size))
        if basis is None:
            self.scaled = self.low_rank / self.weight[:, None]
            matrix[:-1, :-1] = self.low_rank.T @ self.scaled
        else:
            self.scaled = (basis / self.weight).T
            matrix[:-1, :-1] = self.low_rank.T @ (basis @ self.scaled) @ self.low_rank
        first = np.arange(self.first)
        matrix[first, first] += 1.0 if signs is None else signs
        self.last = np.arange(self.first, size - 1)
        matrix[self.last, self.last] += state.s / state.y
        matrix[self.last, -1] = matrix[-1, self.last] = self.unit
        lu, pivots, _ = scipy.linalg.lapack.dgetrf(matrix)
        # rows that are alike to rounding leave a zero pivot: any share of the load between them will do
        lu[lu.diagonal() == 0.0, lu.diagonal() == 0.0] = np.finfo(float).eps * np.abs(lu.diagonal()).max()
        self.factors = lu, pivots

    def _to_members(self, combined: Array) -> Array:
        """(n,) of what is given in rows of the basis, where there is one."""
        return combined if self.basis is None else combined @ self.basis

    def _seen(self, along: Array) -> Array:
        """What the columns see of a weighted step (n,), (k + q,)."""
        seen = self.scaled.T @ along
        return seen if self.basis is None else seen @ self.low_rank

    def direction(self, target: float, correction: BoundState | None = None) -> BoundState:
        """Newton direction towards the products `target`; the correction holds a predictor's second order."""
        state = self.state
        cs = cl = cu = 0.0
        if correction is not None:
            cs = correction.s * correction.y  # type: ignore[assignment]
            cl = correction.d * correction.zl  # type: ignore[assignment]
            cu = -correction.d * correction.zu  # type: ignore[assignment]
        lower = (target - cl) / self.below - state.zl
        upper = (target - cu) / self.above - state.zu
        first = -self.dual_residual + lower - upper
        second = -self.residual - ((target - cs) / state.y - state.s)
        right = np.r_[self._seen(first), 1 - state.y[: self.n_rows].sum()]
        right[self.last] -= second
        solution = scipy.linalg.lu_solve(self.factors, right, check_finite=False)
        dy, dt = solution[self.first : -1], float(solution[-1])
        dd = (first - self._to_members(self.low_rank @ solution[:-1])) / self.weight
        change = self.jacobian @ (dd if self.basis is None else self.basis @ dd)
        return BoundState(
            d=dd,
            t=dt,
            s=-self.residual - change + self.unit * dt,
            y=dy,
            zl=lower - state.zl / self.below * dd,
            zu=upper + state.zu / self.above * dd,
        )

    def lengths(self, step: BoundState) -> tuple[float, float]:
        """Largest primal and dual step lengths, at most 1, that keep everything positive."""
        state = self.state
        primal = min(_room(state.s, step.s), _room(self.below, step.d), _room(self.above, -step.d))
        return primal, min(_room(state.y, step.y), _room(state.zl, step.zl), _room(state.zu, step.zu))


def _room(x: Array, dx: Array) -> float:
    inward = dx < 0
    return float(min(1.0, (-x[inward] / dx[inward]).min())) if inward.any() else 1.0


def quadratic_bound(
    c: Array,
    G: Array,
    W: Array | None,
    A: Array,
    b: Array,
    lo: Array,
    hi: Array,
    *,
    tolerance: float = 1e-9,
) -> BoundStep:
    """Minimise the largest of convex quadratics under budgets in a box.

    Args:    c (r,), G (r, n), W (r, k, n) or None    A (m, n), b (m,) >= 0    lo <= 0 <= hi (n,)
    Variables with lo = hi stay at lo; budgets without a free variable have no price.

    >>> import numpy as np
    >>> c, G = np.array([0.0, 0.0]), np.array([[1.0], [-1.0]])
    >>> one = quadratic_bound(c, G, None, np.zeros((0, 1)), np.zeros(0), np.array([-1.0]), np.array([1.0]))
    >>> abs(one.bound) < 1e-8
    True
    """
    free = hi > lo
    if not free.all():
        rest = quadratic_bound(
            c, G[:, free], None if W is None else W[:, :, free], A[:, free], b, lo[free], hi[free],
            tolerance=tolerance,
        )  # fmt: skip
        step = lo.copy()
        step[free] = rest.step
        return BoundStep(
            step=step, bound=rest.bound, row_multipliers=rest.row_multipliers,
            budget_multipliers=rest.budget_multipliers, iterations=rest.iterations, gap=rest.gap,
        )  # fmt: skip
    used = A.any(axis=1)
    if not used.all():  # budgets that no variable here draws on hold as they are, and have no interior scale
        rest = quadratic_bound(c, G, W, A[used], b[used], lo, hi, tolerance=tolerance)
        prices = np.zeros(len(A))
        prices[used] = rest.budget_multipliers
        return replace(rest, budget_multipliers=prices)
    r, n = G.shape
    basis, rows, budget_rows = _quadratic_rows(c, G, W, A)
    width = hi - lo
    d = np.clip(np.zeros(n), lo + 0.1 * width, hi - 0.1 * width)
    values, _, _ = rows(d, np.full(r, 1 / r))
    scale = float((np.abs(G) * width).sum(1).max() / np.sqrt(n) + np.ptp(c)) + 1e-300
    t = float(values.max() + 0.1 * scale)
    row_scale = np.r_[np.full(r, scale), np.maximum(np.abs(A) @ width, 1e-300) * 0.1]
    barrier = 0.1 * scale / n
    state = BoundState(
        d=d,
        t=t,
        s=np.r_[t - values, np.maximum(b - A @ d, 0.05 * row_scale[r:])],
        y=np.r_[np.full(r, 1 / r), scale / row_scale[r:] * 0.1],
        zl=barrier / (d - lo),
        zu=barrier / (hi - d),
    )
    gap = np.inf
    iterations = 0
    while iterations < _ITERATIONS:
        values, gradients, curvature = rows(state.d, state.y[:r])
        residual = np.r_[values - state.t, A @ state.d - b] + state.s
        system = NewtonSystem(
            state, lo, hi, curvature, np.vstack([gradients, budget_rows]), r, residual, basis=basis
        )
        products = state.complementarity(lo, hi)
        gap = products / scale
        off = float(np.abs(system.dual_residual) @ width)
        if max(gap, (np.abs(residual) / row_scale).max(), off / scale) <= tolerance:
            break
        count = len(state.y) + 2 * n
        predictor = system.direction(0.0)
        length = min(system.lengths(predictor))
        trial = BoundState(d=state.d, t=state.t, s=state.s, y=state.y, zl=state.zl, zu=state.zu)
        trial.add(predictor, length, length)
        mu = products / count
        target = max((trial.complementarity(lo, hi) / count / mu) ** 3, 1e-3) * mu
        direction = system.direction(target, predictor)
        length = _STEP_TO_BOUNDARY * min(system.lengths(direction))
        if not np.isfinite(direction.d).all() or length < 1e-10:
            break  # rounding has the last word; the gap reached so far is reported
        state.add(direction, length, length)
        iterations += 1
    return BoundStep(
        step=np.clip(state.d, lo, hi),
        bound=state.t,
        row_multipliers=state.y[:r],
        budget_multipliers=state.y[r:],
        iterations=iterations,
        gap=float(gap),
    )


def _quadratic_rows(
    c: Array, G: Array, W: Array | None, A: Array
) -> tuple[Array | None, Callable[[Array, Array], tuple[Array, Array, Array]], Array]:
    """A basis (K, n) or None, the values, slopes and curvature of rows at a step, and the budgets' slopes.

    Between rigid bodies a response sees the densities through a few sums, so a hundred slopes and factors
    span two dozen directions; slopes and curvature are given in those, where they save something.
    """
    n = G.shape[1]
    if W is None or W.shape[1] == 0:
        return None, lambda d, y: (c + G @ d, G, np.zeros((n, 0))), A
    basis = _common_basis(np.vstack([G, W.reshape(-1, n)]))
    if basis is None:

        def all_rows(d: Array, y: Array) -> tuple[Array, Array, Array]:
            Wd = W @ d
            heavy = y > 1e-9 * y.max()  # the others would add columns of rounding size
            columns = (np.sqrt(y[heavy])[:, None, None] * W[heavy]).reshape(-1, n).T
            return c + G @ d + 0.5 * (Wd**2).sum(1), G + np.einsum("rk,rkn->rn", Wd, W), columns

        return None, all_rows, A
    directions = len(basis)
    slopes, factors = G @ basis.T, W @ basis.T
    slopes, factors = (
        np.concatenate([x, np.zeros((*x.shape[:-1], len(A)))], axis=-1) for x in (slopes, factors)
    )

    def rows(d: Array, y: Array) -> tuple[Array, Array, Array]:
        u = np.r_[basis @ d, np.zeros(len(A))]
        Wu = factors @ u
        heavy = y > 1e-9 * y.max()
        columns = (np.sqrt(y[heavy])[:, None, None] * factors[heavy]).reshape(-1, len(u)).T
        return c + slopes @ u + 0.5 * (Wu**2).sum(1), slopes + np.einsum("rk,rkb->rb", Wu, factors), columns

    return np.vstack([basis, A]), rows, np.eye(len(A), directions + len(A), directions)


def _common_basis(rows: Array) -> Array | None:
    """(K, n): orthonormal rows that span the given ones (q, n) but for `_FAINT`; None where K is near q."""
    size = np.sqrt((rows**2).sum(1))
    scaled = rows[size > 0] / size[size > 0, None]
    if not len(scaled):
        return None
    wide = len(scaled) < scaled.shape[1]
    squares, axes = np.linalg.eigh(scaled @ scaled.T if wide else scaled.T @ scaled)
    kept = squares > _FAINT**2 * squares[-1]
    if kept.sum() > _FEWER * len(rows):
        return None
    return np.asarray(np.linalg.qr(scaled.T @ axes[:, kept])[0].T if wide else axes[:, kept].T)
