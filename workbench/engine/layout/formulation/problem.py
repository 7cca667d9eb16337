"""The layout problem: densities between bounds, budgets, and an objective that is the largest of many rows.

    min over alpha of   max over (s, n) of g_s(t_n; alpha)   scenarios s, nodes n    (7.12), (7.13)
    subject to          sum_i V_ji alpha_i <= h_j            budgets of groups       (7.4), (7.18)
                        c_l(alpha) <= 0                      further constraints, if any
                        lower <= alpha <= upper              lower = upper fixes a member

An evaluation returns every value g_s(t_n) and, for the rows that the master asks for, their gradients and,
if the objective knows them, factors W with  d2g/dalpha2 ~ W'W  (Gauss-Newton of a squared norm, the exact
Hessian of a compliance). A static objective is a history with one node.

(7.4) prints h_0j for the budget and (7.5) h_0j^k for a constant of the model: here `limits` is the budget.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ...errors import EngineError
from ...integration.kinds import AnyTrajectory

__all__ = [
    "FAILURES", "Evaluation", "InvalidLayout", "LayoutProblem", "LimitRow", "MemberGeometry", "TabulatedRows",
    "budget_rows", "static_problem",
]  # fmt: skip

Array = NDArray[np.float64]


class InvalidLayout(EngineError, ValueError):
    """The layout problem, a density or an evaluation is not usable; the message says where."""


# what a model may raise at a design that it cannot stand: a mechanism, a run that does not converge, overflow
FAILURES = (EngineError, ArithmeticError, np.linalg.LinAlgError)


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """What a further constraint stands for: a limit (its number and name) at a peak of a scenario.

    time: s, nan where the limit is not one of a peak.  height: the value there, its `bound`, and the `size`
    that the constraint is divided by, in `unit`.  upper: whether the bound is an upper one.
    """

    limit: int
    name: str
    scenario: int
    time: float
    height: float
    bound: float
    size: float
    unit: str
    upper: bool


class Evaluation(Protocol):
    """What one evaluation of the objective gives back."""

    @property
    def values(self) -> Array:
        """(scenarios, nodes): every g_s(t_n); a static objective has one node."""
        ...

    def gradients(self, rows: NDArray[np.intp]) -> Array:
        """(len(rows), members): derivatives of the rows, numbered through `values.ravel()`."""
        ...

    def factors(self, rows: NDArray[np.intp]) -> Array | None:
        """(len(rows), k, members) with second derivative ~ W'W, or None when nothing is known of it."""
        ...

    def model(self, step: Array) -> Array | None:
        """(scenarios, nodes): all rows after a step, to second order; None when that would cost much."""
        ...

    @property
    def constraints(self) -> Array:
        """(c,): further constraints c(alpha) <= 0; empty when there are none."""
        ...

    @property
    def constraint_gradients(self) -> Array:
        """(c, members)."""
        ...

    @property
    def limit_rows(self) -> tuple[LimitRow, ...]:
        """(c,): what the constraints stand for where they are limits of runs; empty for others."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class TabulatedRows:
    """An evaluation with all gradients at hand.

    gradient_table: (rows, members)    factor_table: (rows, k, members) or None
    """

    values: Array
    gradient_table: Array
    factor_table: Array | None = None
    constraints: Array = field(default_factory=lambda: np.zeros(0))
    constraint_gradients: Array = field(default_factory=lambda: np.zeros((0, 0)))
    limit_rows: tuple[LimitRow, ...] = ()

    def gradients(self, rows: NDArray[np.intp]) -> Array:
        """The gradients of the rows asked for."""
        return self.gradient_table[rows]

    def factors(self, rows: NDArray[np.intp]) -> Array | None:
        """The factors of the rows asked for, or None."""
        return None if self.factor_table is None else self.factor_table[rows]

    def model(self, step: Array) -> Array:
        """All rows after a step: value + gradient + half the square of the factors."""
        change = self.gradient_table @ step
        if self.factor_table is not None:
            change = change + 0.5 * ((self.factor_table @ step) ** 2).sum(axis=1)
        return self.values + change.reshape(self.values.shape)


@dataclass(frozen=True, slots=True, kw_only=True)
class MemberGeometry:
    """Where the members are: what a drawing and a list of members need.

    body_a, body_b: (members,) body numbers
    point_a, point_b: (members, 2 or 3) m, global at the start
    kind: one word per member, for example "belt"
    stiffness: (members,) at density 1, for the sums of purification    names: as given, "" without one
    """

    body_a: NDArray[np.intp]
    point_a: Array
    body_b: NDArray[np.intp]
    point_b: Array
    kind: tuple[str, ...]
    stiffness: Array | None = None
    names: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutProblem:
    """Densities, bounds, budgets and the objective of a layout.

    evaluate: alpha (members,) -> Evaluation.
    start, lower, upper: (members,).
    costs, limits: (budgets, members) V_ji and (budgets,) h_j. A member in no budget has zeros in its column.
    convex: the caller's promise that every row is convex in alpha (compliance of a truss): a local optimum
        is then the optimum, and the central path is followed.
    convex_constraints: the caller's promise that every further constraint is convex in alpha; only then can
        their linearisations prove that no design meets them.
    times: (nodes,) s, only for messages and reports.
    names: a name per budget.    title, response, unit: words for reports.
    simulated: alpha -> (name, run) of every scenario, for what is told of single members; None for a problem
        without runs.
    variables: of laws (`law_variables.LawVariable`), behind the densities in every design, start and bound.

    Raises InvalidLayout when sizes, bounds, costs or limits cannot be met.

    >>> def bowl(x):
    ...     return float(((x - 1) ** 2).sum()), 2 * (x - 1)
    >>> problem = static_problem(bowl, start=np.full(3, 0.2), budgets=[(np.ones(3), 1.5)])
    >>> problem.members, problem.budgets
    (3, 1)
    """

    evaluate: Callable[[Array], Evaluation]
    start: Array
    lower: Array
    upper: Array
    costs: Array
    limits: Array
    convex: bool = False
    convex_constraints: bool = False
    times: Array | None = None
    names: tuple[str, ...] = ()
    geometry: MemberGeometry | None = None
    title: str = "layout"
    response: str = "objective"
    unit: str = "1"
    simulated: Callable[[Array], Sequence[tuple[str, AnyTrajectory]]] | None = None
    variables: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        n = len(self.start)
        for name in ("start", "lower", "upper", "costs", "limits"):
            array = np.array(getattr(self, name), dtype=float)
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if not self.names:
            object.__setattr__(self, "names", tuple(f"budget {j}" for j in range(len(self.limits))))
        _check_sizes(self, n)
        _check_bounds(self)
        _check_budgets(self)

    @property
    def members(self) -> int:
        """Number of design variables."""
        return len(self.start)

    @property
    def densities(self) -> int:
        """Number of those that are densities; law variables stand behind them."""
        return self.members - len(self.variables)

    @property
    def budgets(self) -> int:
        """Number of budgets."""
        return len(self.limits)

    @property
    def free(self) -> NDArray[np.bool_]:
        """(members,): True where the density may change."""
        return self.upper > self.lower

    def usage(self, density: Array) -> Array:
        """(budgets,): the share of each limit that the density uses."""
        return np.asarray(self.costs @ density / np.where(self.limits == 0, 1.0, self.limits))

    def excess(self, density: Array) -> float:
        """The largest relative violation of a budget, zero when all are met."""
        over = self.costs @ density - self.limits
        scale = np.maximum(np.abs(self.limits), np.abs(self.costs) @ np.abs(self.upper) * 1e-12)
        return float(max(0.0, (over / np.where(scale == 0, 1.0, scale)).max(initial=0.0)))

    def into_budgets(self, density: Array) -> Array:
        """The density clipped to its bounds and drawn towards the lower bounds until all budgets are met."""
        density = np.clip(density, self.lower, self.upper)
        for cost, limit in zip(self.costs, self.limits, strict=True):
            spent, least = cost @ density, cost @ self.lower
            if spent > limit:
                inside = cost > 0
                share = (limit - least) / (spent - least)
                shrunk = self.lower[inside] + share * (density[inside] - self.lower[inside])
                density[inside] = np.maximum(shrunk, self.lower[inside])
        return np.asarray(density)

    def checked(self, density: Array) -> Evaluation:
        """Evaluate and refuse values or constraints that are not numbers."""
        evaluation = self.evaluate(density)
        values = np.atleast_2d(np.asarray(evaluation.values, dtype=float))
        if not np.isfinite(values).all():
            scenario, node = (int(k) for k in np.argwhere(~np.isfinite(values))[0])
            raise InvalidLayout(f"the objective is {values[scenario, node]} {self.where(scenario, node)}")
        if not np.isfinite(evaluation.constraints).all():
            bad = int(np.argmin(np.isfinite(evaluation.constraints)))
            raise InvalidLayout(
                f"constraint {bad} is {evaluation.constraints[bad]}; expected a finite number"
            )
        return evaluation

    def tried(self, density: Array) -> Evaluation | None:
        """`checked` at a trial design; None where the model fails or a row has no usable gradient there."""
        try:
            evaluation = self.checked(density)
            self.checked_gradients(evaluation, np.array([int(np.argmax(evaluation.values))]))
        except FAILURES:
            return None
        slopes = np.asarray(evaluation.constraint_gradients, dtype=float)
        return evaluation if np.isfinite(slopes).all() else None

    def where(self, scenario: int, node: int) -> str:
        """The place of a row in words."""
        if self.times is None:
            return f"in scenario {scenario}, node {node}"
        return f"in scenario {scenario} at t = {self.times[node]:.6g} s"

    def checked_gradients(self, evaluation: Evaluation, rows: NDArray[np.intp]) -> Array:
        """Gradients of rows; a gradient that is not a number is refused with its member and time."""
        gradients = np.asarray(evaluation.gradients(rows), dtype=float)
        if not np.isfinite(gradients).all():
            row, member = np.argwhere(~np.isfinite(gradients))[0]
            scenario, node = divmod(int(rows[row]), np.atleast_2d(evaluation.values).shape[1])
            raise InvalidLayout(
                f"the gradient with respect to member {member} is {gradients[row, member]} "
                f"{self.where(scenario, node)}. Check the force law of that member and its derivatives"
            )
        return gradients


def _check_sizes(problem: LayoutProblem, n: int) -> None:
    for name, shape in (("lower", (n,)), ("upper", (n,))):
        if getattr(problem, name).shape != shape:
            raise InvalidLayout(f"{name} needs one number for each of the {n} members of start, "
                                f"got the shape {getattr(problem, name).shape}")  # fmt: skip
    m = problem.limits.size
    if problem.costs.shape != (m, n):
        raise InvalidLayout(
            f"costs needs a row per limit and a column per member, ({m}, {n}), got {problem.costs.shape}"
        )
    if len(problem.names) != m:
        raise InvalidLayout(f"names needs one name for each of the {m} budgets, got {len(problem.names)}")


def _check_bounds(problem: LayoutProblem) -> None:
    for name in ("start", "lower", "upper", "costs", "limits"):
        if not np.isfinite(getattr(problem, name)).all():
            raise InvalidLayout(f"{name} holds a number that is not finite")
    crossed = np.flatnonzero(problem.lower > problem.upper)
    if crossed.size:
        i = int(crossed[0])
        raise InvalidLayout(
            f"member {i} needs lower <= upper, got lower={problem.lower[i]:.6g} "
            f"and upper={problem.upper[i]:.6g}"
        )
    if problem.members == 0 or not problem.free.any():
        raise InvalidLayout(
            "all members are fixed (lower = upper): nothing is left to optimise. Free at least one member"
        )


def _check_budgets(problem: LayoutProblem) -> None:
    negative = np.argwhere(problem.costs < 0)
    if negative.size:
        budget, member = (int(k) for k in negative[0])
        raise InvalidLayout(
            f"'{problem.names[budget]}' has the negative cost {problem.costs[budget, member]:.6g} "
            f"for member {member}; "
            "costs are amounts of material and need to be >= 0"
        )
    least = problem.costs @ problem.lower
    for j in np.flatnonzero(least > problem.limits * (1 + 1e-12)):
        raise InvalidLayout(
            f"'{problem.names[j]}' allows {problem.limits[j]:.6g} but the lower bounds alone need "
            f"{least[j]:.6g}. Raise the limit or lower the bounds"
        )


def budget_rows(members: int, budgets: Sequence[tuple[Any, float]]) -> tuple[Array, Array]:
    """Costs and limits from pairs (costs of all members, limit).

    >>> budget_rows(3, [([1, 1, 0], 1.0), ([0, 0, 2], 0.5)])[0]
    array([[1., 1., 0.],
           [0., 0., 2.]])
    """
    costs = np.array([np.broadcast_to(np.asarray(c, dtype=float), (members,)) for c, _ in budgets])
    return costs.reshape(len(budgets), members), np.array([float(limit) for _, limit in budgets])


def static_problem(
    function: Callable[[Array], tuple[Any, ...]],
    *,
    start: Any,
    budgets: Sequence[tuple[Any, float]] = (),
    lower: Any = 0.0,
    upper: Any = 1.0,
    constraints: Callable[[Array], tuple[Any, Any]] | None = None,
    convex: bool = False,
    convex_constraints: bool = False,
    names: tuple[str, ...] = (),
    geometry: MemberGeometry | None = None,
    title: str = "layout",
) -> LayoutProblem:
    """A problem whose objective is a function, or the largest of several.

    function: alpha -> (value, gradient) or (value, gradient, factor), for one objective; or
        (values (s,), gradients (s, members)[, factors (s, k, members)]) whose maximum is minimised.
    constraints: alpha -> (values (c,), gradients (c, members)), feasible where values <= 0.

    >>> problem = static_problem(lambda x: (float(x @ x), 2 * x), start=np.ones(2), upper=2.0)
    >>> float(problem.evaluate(np.ones(2)).values[0, 0])
    2.0
    """
    x0 = np.atleast_1d(np.asarray(start, dtype=float))
    n = len(x0)

    def evaluate(density: Array) -> Evaluation:
        value, gradient, *rest = function(density)
        values = np.atleast_1d(np.asarray(value, dtype=float))
        factor = None
        if rest and rest[0] is not None:
            factor = np.asarray(rest[0], dtype=float).reshape(len(values), -1, n)
        c, dc = constraints(density) if constraints else (np.zeros(0), np.zeros((0, n)))
        return TabulatedRows(
            values=values[:, None],
            gradient_table=np.asarray(gradient, dtype=float).reshape(len(values), n),
            factor_table=factor,
            constraints=np.atleast_1d(np.asarray(c, dtype=float)),
            constraint_gradients=np.asarray(dc, dtype=float).reshape(-1, n),
        )

    costs, limits = budget_rows(n, budgets)
    return LayoutProblem(
        evaluate=evaluate,
        start=x0,
        lower=np.broadcast_to(np.asarray(lower, dtype=float), (n,)),
        upper=np.broadcast_to(np.asarray(upper, dtype=float), (n,)),
        costs=costs,
        limits=limits,
        convex=convex,
        convex_constraints=convex_constraints,
        names=names,
        geometry=geometry,
        title=title,
    )
