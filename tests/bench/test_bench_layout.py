"""Layouts beside the MMA of nlopt and pyMOTO and nlopt's CCSAQ: evaluations and CPU seconds of the same run.

Every row is printed; no time is asserted. The peers see the same values and gradients. On trusses the default
method also takes the second derivative, a by-product of the factorised stiffness; those peers have no use
for it. "gsao, gradients" sees what the peers see.
"""

import contextlib
import io
import time
from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from studies.two_body_layout import problem as two_body
from studies.two_objectives import problems as two_objectives
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.outcome.purify import purify
from workbench.engine.layout.several import front

pytestmark = pytest.mark.bench

DISSERTATION = 50 * 49.7  # s: 50 iterations of the two-body layout, 2012


def peer(problem, name, evaluations):
    """Best feasible values over the evaluations of a peer on the largest row."""
    nlopt = pytest.importorskip("nlopt")
    kinds = {"mma": nlopt.LD_MMA, "ccsaq": nlopt.LD_CCSAQ, "slsqp": nlopt.LD_SLSQP}
    n, best = problem.members, []
    solver = nlopt.opt(kinds[name], n)
    solver.set_lower_bounds(problem.lower)
    solver.set_upper_bounds(problem.upper)
    solver.set_maxeval(evaluations)

    def objective(x, gradient):
        evaluation = problem.evaluate(np.array(x))
        row = np.array([int(np.argmax(evaluation.values))])
        value = float(evaluation.values.ravel()[row[0]])
        gradient[:] = evaluation.gradients(row)[0]
        good = value if problem.excess(np.array(x)) <= 1e-6 else np.inf
        best.append(min(good, best[-1] if best else np.inf))
        return value

    solver.set_min_objective(objective)
    for cost, limit in zip(problem.costs, problem.limits, strict=True):

        def budget(x, gradient, cost=cost, limit=limit):
            if gradient.size:
                gradient[:] = cost / limit
            return float(cost @ x) / limit - 1

        solver.add_inequality_constraint(budget, 1e-9)
    try:
        solver.optimize(problem.into_budgets(problem.start))
    except (nlopt.RoundoffLimited, RuntimeError, ValueError) as error:
        print(f"    {name} stopped: {error}")
    return np.array(best)


def pymoto_mma(problem, evaluations):
    """Best feasible values over the evaluations of pyMOTO's MMA on the largest row; variables from 0 to 1."""
    pym = pytest.importorskip("pymoto")
    best = []
    start = problem.into_budgets(problem.start)
    scale = abs(float(problem.evaluate(start).values.max()))
    slopes = np.array([c / b for c, b in zip(problem.costs, problem.limits, strict=True)])
    # without a bound of its own a member can at most take up the whole of its budget
    with np.errstate(divide="ignore"):
        most = np.minimum(problem.upper, (1.0 / slopes).min(axis=0))

    class Layout(pym.Module):
        def __call__(self, u):
            x = np.array(u) * most
            self.evaluation = problem.evaluate(x)
            self.row = np.array([int(np.argmax(self.evaluation.values))])
            value = float(self.evaluation.values.ravel()[self.row[0]])
            good = value if problem.excess(x) <= 1e-6 else np.inf
            best.append(min(good, best[-1] if best else np.inf))
            return value / scale, *(float(v) for v in slopes @ x - 1.0)

        def _sensitivity(self, df, *dg):
            slope = np.zeros(problem.members)
            if df is not None:
                slope += df * self.evaluation.gradients(self.row)[0] / scale
            for weight, row in zip(dg, slopes, strict=True):
                if weight is not None:
                    slope += weight * row
            return slope * most

    u = pym.Signal("u", state=start / most)
    with pym.Network() as network:
        responses = Layout()(u)
    bounds = {"xmin": problem.lower / most, "xmax": np.ones(problem.members)}
    try:
        # its subproblem solver prints whatever the verbosity, and divides by zero
        with contextlib.redirect_stdout(io.StringIO()), np.errstate(all="ignore"):
            pym.minimize_mma(
                [u], list(responses), network, maxit=evaluations, tolx=0, tolf=0, verbosity=0, **bounds
            )
    except ValueError:
        print(f"    pyMOTO stopped after {len(best)} evaluations: its subproblem gave NaN")
    return np.array(best[:evaluations])


def counts(best, optimum, levels):
    reached = [
        int(np.argmax(best <= optimum * (1 + e))) + 1 if best[-1] <= optimum * (1 + e) else "-"
        for e in levels
    ]
    return " / ".join(f"{r}" for r in reached)


@pytest.mark.parametrize(
    ("name", "loads", "domains", "optimum"),
    [
        ("one load", trusses.ONE_LOAD, 1, 465.8403), ("four loads", trusses.FOUR_LOADS, 1, 561.781),
        ("two domains", trusses.TIP_LOAD, 2, 508.741),
    ],
)  # fmt: skip
def test_trusses(name, loads, domains, optimum):
    truss = trusses.ground_structure(loads=loads)
    budgets = trusses.domain_budgets(truss, domains=domains)
    floor = 1e-7 / truss.lengths.sum()  # the peers evaluate at the bounds, where a truss is a mechanism
    levels = (1e-1, 1e-2, 1e-3, 2e-6)
    print(f"\n{name}, 386 members: evaluations to 10 % / 1 % / 0.1 % / 2e-6 of the optimum, CPU s")
    start = time.process_time()
    result = optimise_layout(trusses.problem(truss, budgets=budgets), max_evaluations=150, tolerance=1e-7)
    best = np.array([entry.best for entry in result.history])
    print(f"  gsao             {counts(best, optimum, levels):24s} {time.process_time() - start:6.2f}")
    for method in ("gsao", "gsao_two_point", "oc", "mma"):
        start = time.process_time()
        plain = trusses.problem(truss, budgets=budgets, lower=floor, second_order=False)
        found = optimise_layout(plain, method, max_evaluations=150, tolerance=1e-7)
        best = np.array([entry.best for entry in found.history])
        name_of = "gsao, gradients" if method == "gsao" else method
        print(f"  {name_of:16s} {counts(best, optimum, levels):24s} {time.process_time() - start:6.2f}")
    for name_of_peer in ("mma", "ccsaq"):
        start = time.process_time()
        best = peer(
            trusses.problem(truss, budgets=budgets, lower=floor, second_order=False), name_of_peer, 150
        )
        print(
            f"  nlopt {name_of_peer:10s} {counts(best, optimum, levels):24s} "
            f"{time.process_time() - start:6.2f}"
        )
    start = time.process_time()
    best = pymoto_mma(trusses.problem(truss, budgets=budgets, lower=floor, second_order=False), 150)
    print(f"  pyMOTO mma       {counts(best, optimum, levels):24s} {time.process_time() - start:6.2f}")
    assert result.value <= optimum * (1 + 2e-6)


@pytest.mark.parametrize(("case", "evaluations", "known"), [("short", 12, 0.1108916), ("long", 60, 0.6213)])
def test_two_bodies(case, evaluations, known):
    problem = two_body(case)
    problem.evaluate(problem.start).gradients(np.arange(5))
    start = time.process_time()
    result = optimise_layout(problem, max_evaluations=evaluations)
    print(f"\ntwo bodies, {case} window, {evaluations} evaluations (best known {known}): value/start, CPU s")
    print(f"  gsao        {result.value / result.start_value:.7f}   {time.process_time() - start:6.2f}")
    clean = purify(problem, result.density)
    print(
        f"  purified    {clean.value / result.start_value:.7f}   "
        f"{clean.fractional_before} -> {clean.fractional} "
        f"fractional members, excess {clean.excess:.1e}"
    )
    for name in ("mma", "ccsaq"):
        start = time.process_time()
        best = peer(problem, name, evaluations)
        print(f"  nlopt {name:6s}{best[-1] / result.start_value:.7f}   {time.process_time() - start:6.2f}")
    start = time.process_time()
    best = pymoto_mma(problem, evaluations)
    print(f"  pyMOTO mma  {best[-1] / result.start_value:.7f}   {time.process_time() - start:6.2f}")
    assert result.value <= known * (1 + 1e-4) * result.start_value


def test_ten_random_starts_on_the_long_window():
    base = two_body("long")
    scale = float(np.max(base.evaluate(base.start).values))
    print("\ntwo bodies, long window, 60 evaluations from random starts: value/uniform start")
    worst = 0.0
    for seed in range(10):
        rng = np.random.default_rng(seed)
        start = base.into_budgets(rng.random(base.members) ** rng.integers(1, 6))
        found = optimise_layout(replace(base, start=start), max_evaluations=60).value / scale
        worst = max(worst, found)
        print(f"  {found:.4f}", end="")
    print(f"   worst {worst:.4f}")
    assert worst <= 0.65


def test_fifty_iterations_with_all_gradients():
    problem = two_body("short")
    optimise_layout(problem, "oc", max_evaluations=3)
    print("\ntwo bodies, short window, 50 evaluations with all gradients: CPU s, ratio to 50 x 49.7 s")
    for method in ("oc", "mma", "gsao_two_point"):
        start = time.process_time()
        result = optimise_layout(problem, method, max_evaluations=50, tolerance=0.0)
        spent = time.process_time() - start
        print(
            f"  {method:15s} {spent:6.2f} s for {result.evaluations}   {DISSERTATION / spent:8.0f} x   "
            f"value/start {result.value / result.start_value:.6f}"
        )


def test_a_front_of_fifteen_layouts():
    problems = two_objectives()
    start = time.process_time()
    found = front(problems, points=15, max_evaluations=15)
    print(
        f"\ntwo objectives, 1,020 members: {int(found.kept.sum())} of 15 points kept, steps from "
        f"{found.spacing.min():.2f} to {found.spacing.max():.2f} of their mean, {found.evaluations} runs, "
        f"{time.process_time() - start:.1f} CPU s"
    )
    assert found.kept.all()
