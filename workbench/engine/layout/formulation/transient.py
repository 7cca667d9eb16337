"""The objective of a moving system: max over scenarios and time of a quantity, with gradients where asked.

Two ways to gradients, chosen by size with the reason kept in words:

forward   one sweep gives dq/dalpha at every node: every peak, its neighbours and the second-order model of
          the whole history come at once. n x N numbers per node. The master over many peaks uses it.
adjoint   one backward sweep for all rows of a run, no memory in N. For large N, for systems with internal
          states, and wherever a run is asked for few gradients (methods that follow a single peak).

A squared displacement R^T W R (7.13) brings factors: its second derivative is 2 J^T W J up to the curvature
of R, J = dR/dalpha. With refined peaks the node at a local top carries the height of the cubic through its
neighbours.
"""

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ...elements.timed import bare
from ...errors import NotConverged
from ...integration.kinds import AnySystem, AnyTrajectory
from ...objectives.quantities import Deviation
from ...simulation.side_by_side import side_by_side
from ...simulation.simulate import simulate
from .law_variables import LawVariable, check_variables, with_values
from .limits import Limit, LimitedRow, limited_rows
from .problem import (
    InvalidLayout,
    LayoutProblem,
    LimitRow,
    MemberGeometry,
    budget_rows,
)
from .scenario import Scenario, ScenarioRun

__all__ = ["Scenario", "TransientObjective", "member_geometry", "transient_problem"]

Array = NDArray[np.float64]
Rows = NDArray[np.intp]

_MEMORY = 256e6  # bytes of forward sensitivities
_FEW = 3  # gradients per run up to which backward sweeps are cheaper


@dataclass(slots=True, kw_only=True)
class _Evaluation:
    """All scenarios at one density."""

    runs: list[ScenarioRun]
    values: Array
    threads: int = 0  # that sweep at once, as in `side_by_side`
    limited: list[list[LimitedRow]] = field(default_factory=list)  # of every run
    _limit_gradients: Array | None = None

    @property
    def constraints(self) -> Array:
        """(c,): the rows of all limits."""
        return np.array([row.value for rows in self.limited for row in rows])

    @property
    def limit_rows(self) -> tuple[LimitRow, ...]:
        """(c,): what they stand for."""
        return tuple(row.row for rows in self.limited for row in rows)

    @property
    def constraint_gradients(self) -> Array:
        """(c, N): one backward sweep per run, when first asked for."""
        if self._limit_gradients is None:
            found: list[Array] = [np.zeros((0, self.runs[0].width))] * len(self.runs)

            def fill(case: int) -> None:
                rows = self.limited[case]
                slopes = np.array([row.slope for row in rows])
                sweep = self.runs[case].by_design([row.objective for row in rows])
                found[case] = slopes[:, None] * sweep

            some = [case for case, rows in enumerate(self.limited) if rows]
            side_by_side(fill, some, threads=self.threads)
            self._limit_gradients = np.vstack(found)
        return self._limit_gradients

    def gradients(self, rows: Rows) -> Array:
        """Gradients of rows (scenario x node)."""
        nodes, few = self.values.shape[1], len(rows) <= _FEW * len(self.runs)
        rows = np.asarray(rows)
        cases = rows // nodes
        found = np.empty((len(rows), self.runs[0].width))

        def fill(case: int) -> None:
            own = np.flatnonzero(cases == case)
            found[own] = self.runs[case].gradients(rows[own] % nodes, few=few)

        side_by_side(fill, np.unique(cases).tolist(), threads=self.threads)
        return found

    def factors(self, rows: Rows) -> Array | None:
        """Gauss-Newton factors of squared displacements."""
        if not all(
            isinstance(run.scenario.objective.quantity, Deviation) and run.forward for run in self.runs
        ):
            return None
        nodes = self.values.shape[1]
        found = []
        for row in rows:
            run = self.runs[row // nodes]
            found.append(np.sqrt(2 / run.scenario.scale) * run.residual[1][row % nodes])
        return np.array(found).reshape(len(rows), 2, -1) if found else np.zeros((0, 2, 0))

    def model(self, step: Array) -> Array | None:
        """The whole history after a step, R to first order."""
        if self.factors(np.zeros(0, dtype=np.intp)) is None:
            return None
        table = []
        for run in self.runs:
            R, J = run.residual
            moved = ((R + J @ step) ** 2).sum(axis=1) - (R**2).sum(axis=1)
            table.append(run.values + moved / run.scenario.scale)
            table[-1][: run.first] = table[-1][run.last + 1 :] = run.values.min()
        return np.array(table)


class TransientObjective:
    """alpha -> Evaluation for `LayoutProblem.evaluate`; `reason` says how gradients are found and why."""

    def __init__(
        self,
        scenarios: Sequence[Scenario],
        *,
        sensitivities: Literal["auto", "forward", "adjoint"] = "auto",
        power: float = 1.0,
        limits: Sequence[Limit] = (),
        variables: Sequence[LawVariable] = (),
    ) -> None:
        self.scenarios, self.limits, self.variables = tuple(scenarios), tuple(limits), tuple(variables)
        if not self.scenarios:
            raise InvalidLayout("a transient objective needs at least one scenario")
        if len({(s.steps, len(s.system.members)) for s in self.scenarios}) > 1:
            raise InvalidLayout("all scenarios need the same number of steps and of members")
        self.power = power
        first = self.scenarios[0]
        N = len(first.system.members)
        n = max(scenario.system.size for scenario in self.scenarios)
        size = 8.0 * 3 * (first.steps + 1) * n * N * len(self.scenarios)
        for scenario in self.scenarios if variables else ():
            check_variables(scenario.system, variables, scenario.t_end / scenario.steps)
        if variables and sensitivities == "forward":
            raise InvalidLayout("law variables have gradients by adjoint sweeps alone; leave sensitivities")
        if variables:
            choice, why = "adjoint", "numbers of the laws are design variables too"
        elif sensitivities == "auto":
            backward = next(
                (k for k, scenario in enumerate(self.scenarios) if not _goes_forward(scenario)), None
            )
            if backward is not None:
                which = "the system" if backward == 0 else f"that of scenario {backward + 1}"
                choice, why = "adjoint", f"{which} has internal states, redundant joints or laws in Python"
            elif size > _MEMORY:
                choice, why = "adjoint", f"forward sensitivities would take {size / 1e6:.0f} MB"
            else:
                choice, why = "forward", f"{n} coordinates and {N} members: all peaks for {size / 1e6:.0f} MB"
        else:
            choice, why = sensitivities, "as asked"
        self.forward = choice == "forward"
        self.threads = _threads(self.scenarios)
        self.reason = f"{choice} sensitivities: {why}"

    def _trajectory(self, scenario: Scenario, design: Array) -> AnyTrajectory:
        system, count = scenario.system, len(scenario.system.members)
        if self.variables:
            values = [v.at(share) for v, share in zip(self.variables, design[count:], strict=True)]
            system = with_values(system, self.variables, values)
        return simulate(
            system, design[:count] ** self.power, scenario.t_end, scenario.steps, scheme=scenario.scheme
        )

    def simulated(self, design: Array) -> tuple[tuple[str, AnyTrajectory], ...]:
        """The name and the run of every scenario."""
        return tuple((scenario.name, self._trajectory(scenario, design)) for scenario in self.scenarios)

    def __call__(self, design: Array) -> _Evaluation:
        """Simulate all scenarios. design: densities, then the shares of law variables."""
        try:
            return self._evaluation(design)
        except NotConverged as error:
            error.add_note("while evaluating a layout; a softer lower bound or a smaller step may help")
            raise

    def of_scenarios(self, chosen: Sequence[int]) -> "TransientObjective":
        """The objective of some scenarios, with gradients found in the same way."""
        some = copy(self)
        some.scenarios = tuple(self.scenarios[k] for k in chosen)
        return some

    def until(self, share: float) -> "TransientObjective | None":
        """The objective over the first share of every run, in the same steps; None where a window begins
        later."""
        some, shorter = copy(self), []
        for scenario in self.scenarios:
            steps = max(1, round(share * scenario.steps))
            t_end, window = scenario.t_end * steps / scenario.steps, scenario.objective.window
            if window is not None and window[0] >= t_end:
                return None
            cut = None if window is None else (window[0], min(window[1], t_end))
            shorter.append(
                replace(scenario, t_end=t_end, steps=steps, objective=replace(scenario.objective, window=cut))
            )
        some.scenarios = tuple(shorter)
        return some

    def _evaluation(self, design: Array) -> _Evaluation:
        def run(scenario: Scenario) -> ScenarioRun:
            trajectory = self._trajectory(scenario, design)
            return ScenarioRun(
                scenario=scenario, trajectory=trajectory, forward=self.forward, variables=self.variables
            )

        runs = side_by_side(run, self.scenarios, threads=self.threads)
        limited = (
            [limited_rows(self.limits, r.trajectory, k) for k, r in enumerate(runs)] if self.limits else []
        )
        evaluation = _Evaluation(
            runs=runs, values=np.array([run.values for run in runs]), threads=self.threads, limited=limited
        )  # fmt: skip
        if self.power != 1.0:
            slope = self.power * design ** (self.power - 1)
            slope[len(self.scenarios[0].system.members) :] = 1.0
            return _powered(evaluation, slope)  # type: ignore[return-value]
        return evaluation


def _goes_forward(scenario: Scenario) -> bool:
    """Whether a run of the scenario has forward sensitivities, by its first step."""
    nothing = np.zeros(len(scenario.system.members))
    return simulate(scenario.system, nothing, 1e-3 * scenario.t_end, 1, scheme=scenario.scheme).goes_forward


def _threads(scenarios: Sequence[Scenario]) -> int:
    """One where a user's law is called, which may keep a state of its own; otherwise as many as there are."""
    return 0 if not any(scenario.system.in_python for scenario in scenarios) else 1


@dataclass(slots=True, kw_only=True)
class _Powered:
    """Chain rule of alpha -> alpha^power; factors keep their first-order part."""

    inner: _Evaluation
    slope: Array
    values: Array
    constraints: Array
    limit_rows: tuple[LimitRow, ...]

    @property
    def constraint_gradients(self) -> Array:
        """(c, N) by the density itself."""
        return self.inner.constraint_gradients * self.slope

    def gradients(self, rows: Rows) -> Array:
        """Gradients by the density itself."""
        return self.inner.gradients(rows) * self.slope

    def factors(self, rows: Rows) -> Array | None:
        """Factors by the density itself."""
        found = self.inner.factors(rows)
        return None if found is None else found * self.slope

    def model(self, step: Array) -> Array | None:
        """The history after a step of the density."""
        return self.inner.model(self.slope * step)


def _powered(evaluation: _Evaluation, slope: Array) -> _Powered:
    return _Powered(
        inner=evaluation, slope=slope, values=evaluation.values, constraints=evaluation.constraints,
        limit_rows=evaluation.limit_rows,
    )  # fmt: skip


def member_geometry(system: AnySystem) -> MemberGeometry:
    """End points of all members at the start, in global coordinates."""
    return MemberGeometry(
        **system.member_ends()._asdict(),
        kind=tuple(type(bare(m.law)).__name__.lower() for m in system.members),
        stiffness=np.array([float(getattr(bare(m.law), "k", 1.0)) for m in system.members]),
        names=tuple(str(getattr(m, "name", "")) for m in system.members),
    )


def transient_problem(
    scenarios: Sequence[Scenario],
    *,
    start: Any,
    budgets: Sequence[tuple[Any, float]],
    lower: Any = 0.0,
    upper: Any = 1.0,
    sensitivities: Literal["auto", "forward", "adjoint"] = "auto",
    power: float = 1.0,
    names: tuple[str, ...] = (),
    title: str = "layout",
    response: str = "objective",
    unit: str = "1",
    limits: Sequence[Limit] = (),
    variables: Sequence[LawVariable] = (),
) -> LayoutProblem:
    """A layout problem over scenarios of moving systems.

    budgets: (costs of all members, limit) each.    power: SIMP exponent on every density, (7.2).
    limits: on peaks of any quantity, in every scenario.
    variables: numbers of the laws, firing times for example, which stand behind the densities in the design
        as shares of their ranges; no budget counts them.
    """
    objective = TransientObjective(
        scenarios, sensitivities=sensitivities, power=power, limits=limits, variables=variables
    )
    first, more = scenarios[0], len(variables)
    n = len(first.system.members)
    costs, allowed = budget_rows(n, budgets)

    return LayoutProblem(
        evaluate=objective,
        start=np.r_[np.broadcast_to(np.asarray(start, dtype=float), (n,)), [v.first for v in variables]],
        lower=np.r_[np.broadcast_to(np.asarray(lower, dtype=float), (n,)), np.zeros(more)],
        upper=np.r_[np.broadcast_to(np.asarray(upper, dtype=float), (n,)), np.ones(more)],
        costs=np.hstack([costs, np.zeros((len(costs), more))]),
        limits=allowed,
        times=np.linspace(0.0, first.t_end, first.steps + 1),
        names=names,
        geometry=member_geometry(first.system),
        title=title,
        response=response,
        unit=unit,
        simulated=objective.simulated,
        variables=tuple(variables),
    )
