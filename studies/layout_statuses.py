"""Whether the status of a layout says more than is known: random problems, every method, counted.

Five makes of small problems: springs between two bodies with a budget, the same with limits that a random
design meets, trusses of least compliance (with second derivatives or gradients only), of least volume under
limits of compliances, and under limits of stresses with one to four load cases. What a result says of itself
is set against what another linear programme finds at its design, run or solved once more.

Run `python -m studies.layout_statuses 500 7000` for the counts of 500 problems from seed 7000 on (minutes).
"""

import sys
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from studies import trusses
from studies.whole_members import random_scenarios
from workbench.engine import Deviation, Maximum, MemberForce, PointSpeed
from workbench.engine.layout.formulation.limits import Limit
from workbench.engine.layout.formulation.problem import LayoutProblem, static_problem
from workbench.engine.layout.formulation.transient import transient_problem
from workbench.engine.layout.optimise import METHODS, RUNS_ONLY, optimise_layout
from workbench.engine.layout.outcome.result import FIRST_ORDER, LayoutStatus

__all__ = ["MAKES", "Case", "Judged", "case", "first_order_error", "judged", "random_truss", "run"]

Array = NDArray[np.float64]

EVALUATIONS = 40
_BUDGETS_ONLY = ("trust_region", "secant_path", "central_path")
_STATIC = ("secant_path", "central_path")
_TOLD = 25  # problems after which the count so far is printed
_ROUNDING, _APART = 1e-6, 1e-3  # by which two linear programmes may differ: absolute, relative


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A problem, the method that is asked for, and a design known to be feasible (None: a budget's start)."""

    make: str
    problem: LayoutProblem
    method: str
    feasible: Array | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """What a result said and what is known.

    error: first-order error at its design by another programme, nan where there is no design
    faults: sentences, one for each thing that the result must not have said
    """

    seed: int
    make: str
    method: str
    status: str
    kkt: float
    error: float
    evaluations: int
    faults: tuple[str, ...]


def springs(rng: np.random.Generator) -> tuple[LayoutProblem, Array | None]:
    """The least displacement of springs within a budget, from random densities."""
    scenarios, _ = random_scenarios(int(rng.integers(10**6)), most=1500)
    n = len(scenarios[0].system.members)
    problem = transient_problem(
        scenarios, start=rng.uniform(0.05, 1.0, n), lower=10 ** rng.uniform(-4, -1.5),
        budgets=[(np.ones(n), rng.uniform(0.15, 0.7) * n)],
    )  # fmt: skip
    return replace(problem, start=problem.into_budgets(problem.start)), None


def limited_springs(rng: np.random.Generator) -> tuple[LayoutProblem, Array | None]:
    """The same with limits of displacement, speed and a force that a random design just meets, or more so."""
    scenarios, _ = random_scenarios(int(rng.integers(10**6)), most=1500)
    n = len(scenarios[0].system.members)
    known = rng.uniform(0.2, 0.9, n)
    quantities = (
        ("displacement", Deviation(bodies=("1",), reference="2")),
        ("speed", PointSpeed(body="1", point=(0.3, 0.1))), ("force", MemberForce(member=0)),
    )  # fmt: skip
    chosen = [q for q in quantities if rng.random() < 0.7] or [quantities[1]]
    loose = [Limit(name=name, objective=Maximum(quantity=q), at_most=1e30) for name, q in chosen]

    def made(limits: list[Limit]) -> LayoutProblem:
        return transient_problem(
            scenarios, start=rng.uniform(0.2, 0.9, n), lower=1e-3,
            budgets=[(np.ones(n), float(known.sum()))], limits=limits,
        )  # fmt: skip

    rows = made(loose).evaluate(known).limit_rows
    limits = []
    for limit in loose:
        top = max(row.height for row in rows if row.name == limit.name)
        size = abs(top) if top else 1.0
        limits.append(replace(limit, at_most=top + rng.choice([1e-6, 0.05, 0.3]) * size))
    return made(limits), known


def random_truss(rng: np.random.Generator, *, small: bool) -> trusses.Truss:
    """A cantilever of random size under one to four cases of a force at its free end."""
    columns, rows = (3, 2) if small else (int(rng.integers(3, 5)), int(rng.integers(2, 4)))
    width, height = rng.uniform(0.8, 4, 2)
    loads = []
    for _ in range(int(rng.integers(1, 5))):
        angle, j = rng.uniform(0, 2 * np.pi), rng.integers(0, rows)
        loads.append((((np.cos(angle), np.sin(angle)), (width, j * height / (rows - 1))),))
    return trusses.ground_structure(columns=columns, rows=rows, width=width, height=height, loads=loads)


def compliant(rng: np.random.Generator) -> tuple[LayoutProblem, Array | None]:
    """The least compliance under one or two budgets, from random areas, which may vanish or may not."""
    truss = random_truss(rng, small=False)
    volume = rng.uniform(0.5, 3)
    lower = 0.0 if rng.random() < 0.5 else 10 ** rng.uniform(-6, -2) * volume / truss.lengths.sum()
    problem = trusses.problem(
        truss, budgets=trusses.domain_budgets(truss, volume=volume, domains=int(rng.integers(1, 3))),
        lower=lower, second_order=bool(rng.integers(2)),
    )  # fmt: skip
    start = problem.upper * rng.uniform(0.01, 1, problem.members)
    return replace(problem, start=np.clip(start, problem.lower, problem.upper)), None


def light(rng: np.random.Generator) -> tuple[LayoutProblem, Array | None]:
    """The least volume under limits of the compliances, which equal areas of 4 meet."""
    truss = random_truss(rng, small=False)
    n = len(truss.ends)
    limit = trusses.problem(truss).evaluate(np.ones(n)).values.ravel() * rng.uniform(0.3, 3)

    def limits(areas: Array) -> tuple[Array, Array]:
        values, gradients, _ = truss.compliances(areas)
        return values / limit - 1, gradients / limit[:, None]

    return static_problem(
        lambda a: (float(truss.lengths @ a), truss.lengths.copy()), start=rng.uniform(0.1, 2, n), lower=1e-4,
        upper=10.0, constraints=limits, convex=bool(rng.integers(2)),
        convex_constraints=bool(rng.integers(2)),
    ), np.full(n, 4.0)  # fmt: skip


def stressed(rng: np.random.Generator) -> tuple[LayoutProblem, Array | None]:
    """The least volume under limits of the stresses, from random areas."""
    problem = trusses.stress_limited(random_truss(rng, small=True), lower=1e-4)
    start = problem.start * 10.0 ** rng.uniform(-2, 0.5, problem.members)
    return replace(problem, start=np.clip(start, problem.lower, problem.upper)), problem.start


Make = Callable[[np.random.Generator], tuple[LayoutProblem, Array | None]]
MAKES: dict[str, Make] = {
    "springs": springs, "limited springs": limited_springs, "compliance": compliant,
    "volume under compliances": light, "volume under stresses": stressed,
}  # fmt: skip


def case(seed: int) -> Case:
    """The problem of a seed; makes and methods take turns."""
    rng = np.random.default_rng(seed)
    names = list(MAKES)
    make = names[seed % len(names)]
    problem, feasible = MAKES[make](rng)
    moving = "springs" in make
    able = [
        method
        for method in (*METHODS, *(RUNS_ONLY if make == "springs" else ()))
        if not (moving and method in _STATIC) and not (feasible is not None and method in _BUDGETS_ONLY)
    ]
    method = able[seed // len(names) % len(able)]
    if method == "central_path" and problem.evaluate(problem.start).factors(np.array([0])) is None:
        method = "secant_path"
    return Case(make=make, problem=problem, method=method, feasible=feasible)


def first_order_error(problem: LayoutProblem, density: Array) -> float:
    """What the linearised rows promise at a design within budgets and limits, over its value.

    scipy's linear programme on all rows; nothing of ours but the gradients.
    """
    evaluation = problem.evaluate(density)
    flat = np.ravel(evaluation.values)
    top, n = float(flat.max()), problem.members
    rows = np.arange(flat.size)
    gradients = evaluation.gradients(rows)
    unit = max(abs(top), 1e-300)
    width = np.where(problem.upper > problem.lower, problem.upper - problem.lower, 1.0)
    table = [np.hstack([gradients * width / unit, -np.ones((len(rows), 1))])]
    right = [(top - flat[rows]) / unit]
    limits = np.asarray(evaluation.constraints)
    for slopes, room in (
        (problem.costs, np.maximum(problem.limits - problem.costs @ density, 0.0)),
        (np.reshape(evaluation.constraint_gradients, (len(limits), n)), np.maximum(-limits, 0.0)),
    ):
        if len(room):
            size = np.maximum(np.abs(slopes * width).max(axis=1), 1e-300)
            table.append(np.hstack([slopes * width / size[:, None], np.zeros((len(room), 1))]))
            right.append(room / size)
    moves = np.column_stack([
        np.minimum(problem.lower - density, 0.0) / width, np.maximum(problem.upper - density, 0.0) / width
    ])  # fmt: skip
    solution = linprog(
        np.r_[np.zeros(n), 1.0], A_ub=np.vstack(table), b_ub=np.concatenate(right),
        bounds=[*moves, (None, None)], method="highs",
    )  # fmt: skip
    return -float(solution.fun) if solution.fun is not None else np.inf


def judged(seed: int, *, evaluations: int = EVALUATIONS) -> Judged:
    """One problem optimised, and everything said that is not so."""
    one = case(seed)
    problem, faults, error = one.problem, [], np.nan
    try:
        result = optimise_layout(problem, one.method, max_evaluations=evaluations)
    except Exception as broken:  # every problem is a proper one: whatever is raised is a fault
        return Judged(
            seed=seed, make=one.make, method=one.method, status="BROKEN", kkt=np.nan, error=np.nan,
            evaluations=0, faults=(f"ended in {type(broken).__name__}: {broken}",),
        )  # fmt: skip
    if one.feasible is not None and float(np.max(problem.evaluate(one.feasible).constraints)) > 0.0:
        raise RuntimeError(f"the design that problem {seed} is known by breaks a limit")
    found = np.isfinite(result.value)
    if found:
        error = first_order_error(problem, result.density)
        again = problem.evaluate(result.density)
        if abs(float(np.max(again.values)) - result.value) > 1e-9 * abs(result.value):
            faults.append("its value is not that of its design")
        excess = max(problem.excess(result.density), float(np.max(again.constraints, initial=0.0)))
        if excess > 1e-9:
            faults.append(f"its design breaks a limit by {excess:.1e}")
    settled = (LayoutStatus.CONVERGED, LayoutStatus.IDLE_BUDGET)
    if result.status in settled and not error <= FIRST_ORDER + _ROUNDING:
        faults.append(f"{result.status.name.lower()} with a first-order error of {error:.1e}")
    if result.status is LayoutStatus.STALLED and error <= FIRST_ORDER < result.kkt:
        faults.append(f"an optimum to {error:.1e} is called stalled at {result.kkt:.1e}")
    if found and error > (1 + _APART) * result.kkt + _ROUNDING:
        faults.append(f"states {result.kkt:.1e} where {error:.1e} is left")
    if result.status is LayoutStatus.INFEASIBLE:
        faults.append("infeasible, and a feasible design is known")
    if result.evaluations > evaluations:
        faults.append(f"{result.evaluations} evaluations instead of {evaluations}")
    return Judged(
        seed=seed, make=one.make, method=one.method, status=result.status.name, kkt=result.kkt, error=error,
        evaluations=result.evaluations, faults=tuple(faults),
    )  # fmt: skip


def run(problems: int, first: int) -> list[Judged]:
    """The problems of seeds `first`, `first` + 1 and so on; what is at fault is printed as it is found."""
    rows = []
    for seed in range(first, first + problems):
        row = judged(seed)
        rows.append(row)
        for fault in row.faults:
            print(f"seed {seed}, {row.make}, {row.method}: {row.status}: {fault}", flush=True)
        if len(rows) % _TOLD == 0:
            print(f"{len(rows)} problems, {sum(bool(row.faults) for row in rows)} with a fault", flush=True)
    return rows


def main() -> None:
    """Print the faults and how often each status was given to each make."""
    problems = int(sys.argv[1]) if len(sys.argv) > 1 else 500
    began = time.process_time()
    rows = run(problems, int(sys.argv[2]) if len(sys.argv) > 2 else 7000)
    for make in MAKES:
        here = Counter(row.status for row in rows if row.make == make)
        print(f"{make:26s}", "  ".join(f"{name} {count}" for name, count in sorted(here.items())))
    faulty = sum(bool(row.faults) for row in rows)
    print(f"{faulty} of {len(rows)} problems with something said that is not so; "
          f"{time.process_time() - began:.0f} CPU s")  # fmt: skip


if __name__ == "__main__":
    main()
