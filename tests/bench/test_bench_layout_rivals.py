"""Layouts beside rivals of every kind in one table: nlopt and IPOPT with a bound on all rows, ESL, and ours.

    min t   subject to   g_j(x)/g0 <= t for rows j spread over time and all load cases,   cost x/limit <= 1

Those who know nlopt and IPOPT would not follow the single largest row, so here they see up to sixty rows of
every run, scaled by the start. IPOPT (through casadi) learns curvature by limited memory. SLSQP and IPOPT are
left out above 400 members, where a step of theirs takes minutes. Values are the best feasible ones over all
nodes, over that of the start, after as many evaluations each. Nothing is asserted.
"""

import contextlib
import io
import os
import time
from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from studies.three_body_layout import problem as three_body
from studies.two_body_layout import problem as two_body
from studies.whole_members import random_problem
from workbench.engine.layout.optimise import optimise_layout

pytestmark = [pytest.mark.bench, pytest.mark.timeout(1800)]

ROWS = 60
FLOOR = 1e-6  # so that no trial of a peer is a mechanism


class BoundRows:
    """Rows and their slopes for a solver; the best feasible value over all nodes is kept on the way."""

    def __init__(self, problem, evaluations):
        self.problem, self.left, self.best = problem, evaluations, []
        start = problem.into_budgets(problem.start)
        first = problem.evaluate(start)
        values = np.atleast_2d(first.values)
        self.unit = float(values.max())
        step = max(1, values.shape[1] * len(values) // ROWS)
        nodes = np.arange(values.shape[1] - 1, -1, -step)
        self.rows = (np.arange(len(values))[:, None] * values.shape[1] + nodes).ravel()
        self.scale = np.maximum(start, 1e-3 * (problem.upper - problem.lower))
        self.start = np.r_[start / self.scale, 1.0]
        self.lower = np.r_[problem.lower / self.scale, 0.0]
        self.upper = np.r_[problem.upper / self.scale, 10.0]
        self.known = (np.zeros(0), None, None)

    def at(self, x):
        """Values (rows,) and slopes (rows, N) over the start's value, by shares of the start's densities."""
        density = x * self.scale
        if not np.array_equal(self.known[0], density):
            if self.left <= 0:
                raise StopIteration
            self.left -= 1
            found = self.problem.evaluate(np.clip(density, self.problem.lower, self.problem.upper))
            met = self.problem.excess(density) <= 1e-6
            value = float(np.max(found.values)) / self.unit if met else np.inf
            self.best.append(min(value, self.best[-1] if self.best else np.inf))
            self.known = (
                density.copy(), np.ravel(found.values)[self.rows] / self.unit,
                found.gradients(self.rows) * self.scale / self.unit,
            )  # fmt: skip
        return self.known[1:]

    @property
    def budgets(self):
        """(budgets, N) costs over their limits."""
        return self.problem.costs * self.scale / self.problem.limits[:, None]


def by_nlopt(problem, name, evaluations):
    nlopt = pytest.importorskip("nlopt")
    kinds = {"MMA": nlopt.LD_MMA, "CCSAQ": nlopt.LD_CCSAQ, "SLSQP": nlopt.LD_SLSQP}
    rows, n = BoundRows(problem, evaluations), problem.members
    solver = nlopt.opt(kinds[name], n + 1)
    solver.set_lower_bounds(rows.lower)
    solver.set_upper_bounds(rows.upper)
    solver.set_initial_step(np.r_[np.full(n, 0.5), 0.2])

    def objective(x, gradient):
        if gradient.size:
            gradient[:] = np.r_[np.zeros(n), 1.0]
        return float(x[n])

    def limits(result, x, gradient):
        values, slopes = rows.at(x[:n])
        result[:] = np.r_[values - x[n], rows.budgets @ x[:n] - 1.0]
        if gradient.size:
            gradient[:] = np.block([
                [slopes, -np.ones((len(values), 1))], [rows.budgets, np.zeros((len(rows.budgets), 1))],
            ])  # fmt: skip

    solver.set_min_objective(objective)
    solver.add_inequality_mconstraint(limits, np.full(len(rows.rows) + problem.budgets, 1e-8))
    with contextlib.suppress(StopIteration, nlopt.RoundoffLimited, RuntimeError, ValueError):
        solver.optimize(rows.start)
    return rows.best


def by_ipopt(problem, evaluations):
    casadi = pytest.importorskip("casadi")
    rows, n = BoundRows(problem, evaluations), problem.members
    count, kept = len(rows.rows), []

    class Slopes(casadi.Callback):
        def __init__(self):
            casadi.Callback.__init__(self)
            self.construct("slopes", {})

        def get_n_in(self):
            return 2

        def get_n_out(self):
            return 1

        def get_sparsity_in(self, i):
            return casadi.Sparsity.dense(n if i == 0 else count, 1)

        def get_sparsity_out(self, i):
            return casadi.Sparsity.dense(count, n)

        def eval(self, arguments):
            return [casadi.DM(rows.at(np.array(arguments[0]).ravel())[1])]

    class Values(casadi.Callback):
        def __init__(self):
            casadi.Callback.__init__(self)
            self.construct("values", {})

        def get_n_in(self):
            return 1

        def get_n_out(self):
            return 1

        def get_sparsity_in(self, i):
            return casadi.Sparsity.dense(n, 1)

        def get_sparsity_out(self, i):
            return casadi.Sparsity.dense(count, 1)

        def eval(self, arguments):
            return [casadi.DM(rows.at(np.array(arguments[0]).ravel())[0])]

        def has_jacobian(self):
            return True

        def get_jacobian(self, name, inames, onames, opts):
            kept.append(Slopes())  # or it is deleted while the solver holds it
            return kept[-1]

    values = Values()
    x, t = casadi.MX.sym("x", n), casadi.MX.sym("t")
    programme = {
        "x": casadi.vertcat(x, t), "f": t,
        "g": casadi.vertcat(values(x) - t, casadi.mtimes(casadi.DM(rows.budgets), x) - 1),
    }  # fmt: skip
    options = {
        "ipopt.hessian_approximation": "limited-memory", "ipopt.print_level": 0, "print_time": False,
        "ipopt.sb": "yes", "ipopt.max_iter": 10 * evaluations, "error_on_fail": False,
        "show_eval_warnings": False,
    }  # fmt: skip
    solver = casadi.nlpsol("solver", "ipopt", programme, options)
    with (
        contextlib.redirect_stdout(io.StringIO()),  # casadi prints the trace of what ends it
        contextlib.redirect_stderr(io.StringIO()),
        contextlib.suppress(RuntimeError, StopIteration, SystemError),
    ):
        solver(x0=rows.start, lbx=rows.lower, ubx=rows.upper, lbg=-np.inf, ubg=0.0)
    return rows.best


def ours(problem, method, evaluations):
    found = optimise_layout(problem, method, max_evaluations=evaluations)
    return [entry.best / found.start_value for entry in found.history]


CASES = {
    "truss, 386 bars, one load": lambda: trusses.problem(
        trusses.ground_structure(loads=((((0, -1), (6.0, 1.5)),),)), lower=FLOOR, second_order=False
    ),
    "truss, 386 bars, three loads": lambda: trusses.problem(
        trusses.ground_structure(
            loads=((((0, -1), (6.0, 3.0)),), (((0, -1), (6.0, 0.0)),), (((1, 0), (6.0, 1.5)),))
        ),
        lower=FLOOR,
        second_order=False,
    ),
    "two bodies, 1020 members, 0.2 s": lambda: two_body("short"),
    "two bodies, 1020 members, 1 s": lambda: two_body("long"),
    "three bodies, 1044 members": three_body,
    "springs, seed 41": lambda: random_problem(41)[0],
}


@pytest.mark.parametrize("case", CASES)
def test_rivals(case, capsys):
    evaluations = int(os.environ.get("RIVALS_EVALUATIONS", "50"))
    problem, lines = CASES[case](), []
    if not problem.budgets:
        problem = with_budget(problem)
    static = np.atleast_2d(problem.evaluate(problem.into_budgets(problem.start)).values).shape[1] == 1
    ways = {
        "ours": lambda: ours(problem, "gsao", evaluations),
        **{
            f"nlopt {name}": lambda name=name: by_nlopt(problem, name, evaluations)
            for name in ("MMA", "CCSAQ")
        },
    }
    if problem.members <= 400:
        ways["nlopt SLSQP"] = lambda: by_nlopt(problem, "SLSQP", evaluations)
        ways["IPOPT"] = lambda: by_ipopt(problem, evaluations)
    if not static:
        ways["ESL"] = lambda: ours(problem, "esl", evaluations)
        ways["ESL, differences"] = lambda: ours(problem, "esl_difference", evaluations)
    for name, way in ways.items():
        start = time.process_time()
        try:
            best = way()
        except pytest.skip.Exception as missing:
            lines.append(f"  {name:18} {missing}")
            continue
        at = [best[min(k, len(best)) - 1] if best else np.nan for k in (10, 20, evaluations)]
        lines.append(
            f"  {name:18} {at[0]:9.5f} {at[1]:9.5f} {at[2]:9.5f}   {time.process_time() - start:7.1f} CPU s"
        )
    with capsys.disabled():
        print(f"\n{case}: value over the start's after 10, 20 and {evaluations} evaluations")
        print("\n".join(lines))


def with_budget(problem):
    """Two fifths of all members' material."""
    n = problem.members
    return replace(
        problem, costs=np.ones((1, n)), limits=np.array([0.4 * n]), names=("material",),
        start=np.full(n, 0.4), lower=np.full(n, 1e-3),
    )  # fmt: skip
