"""Least volumes under stress limits and several load cases, beside IPOPT on the whole problem.

    min  L'a   subject to   sum_i a_i e_ic b_i/L_i = f_c,   |e_ic| <= L_i,   e_ic = b_i u_c,   a >= lower

IPOPT (through casadi) is given areas and displacements together, all equations, and exact second derivatives;
it starts at the even design and at drawn areas. The search is given values and gradients of the stresses and
has 100 evaluations. Under several cases the linear programme of plastic design is a lower bound alone, so the
ends are held against each other. Nothing is asserted.

`STRESS_SEEDS=700:710 STRESS_BARS=100:400` draws others.
"""

import os
import time

import numpy as np
import pytest

from studies.drawn_stress_limits import EVALUATIONS, drawn
from studies.trusses import least_volume, stress_limited
from workbench.engine.layout.optimise import optimise_layout

pytestmark = [pytest.mark.bench, pytest.mark.timeout(3600)]

MET = 1e-6  # of the equations and of the stresses at an end of IPOPT that counts


def interval(name, default):
    first, last = os.environ.get(name, default).split(":")
    return int(first), int(last)


def by_ipopt(truss, problem, rng):
    """Volumes of the ends of IPOPT, and its iterations; an end that does not meet the limits is left out."""
    casadi = pytest.importorskip("casadi")
    n, cases = len(truss.ends), truss.loads.shape[1]
    unit = problem.start[0]  # of areas
    a, u = casadi.SX.sym("a", n), casadi.SX.sym("u", truss.rows.shape[1], cases)
    rows, loads = casadi.sparsify(casadi.DM(truss.rows)), casadi.DM(truss.loads)
    stress = casadi.diag(casadi.DM(1.0 / truss.lengths)) @ (rows @ u)
    balance = rows.T @ (casadi.repmat(unit * a, 1, cases) * stress) - loads
    volume = unit * casadi.dot(casadi.DM(truss.lengths), a)
    solver = casadi.nlpsol(
        "solver", "ipopt",
        {"x": casadi.vertcat(a, casadi.vec(u)), "f": volume,
         "g": casadi.densify(casadi.vertcat(casadi.vec(balance), casadi.vec(stress)))},
        {"ipopt.print_level": 0, "print_time": False, "ipopt.sb": "yes", "ipopt.max_iter": 1000},
    )  # fmt: skip
    balanced, strained = balance.numel(), n * cases
    ends, iterations = [], []
    for areas in (np.ones(n), rng.uniform(0.2, 2.0, n), rng.uniform(0.2, 2.0, n)):
        K = (truss.rows.T * (unit * areas / truss.lengths)) @ truss.rows
        begin = np.r_[areas, np.linalg.solve(K, truss.loads).T.ravel()]
        found = solver(
            x0=begin, lbx=np.r_[problem.lower / unit, np.full(truss.loads.size, -np.inf)], ubx=np.inf,
            lbg=np.repeat([0.0, -1.0], [balanced, strained]), ubg=np.repeat([0.0, 1.0], [balanced, strained]),
        )  # fmt: skip
        g = np.array(found["g"]).ravel()
        if np.abs(g[:balanced]).max() < MET and np.abs(g[balanced:]).max() < 1 + MET:
            ends.append(float(found["f"]))
        iterations.append(solver.stats()["iter_count"])
    return ends, iterations


@pytest.mark.parametrize("cases", [1, 2, 3, 4])
def test_least_volumes(cases, capsys):
    (first, last), (fewest, most) = interval("STRESS_SEEDS", "800:830"), interval("STRESS_BARS", "100:640")
    for seed in range(first, last):
        truss = drawn(seed, cases=cases)
        if not fewest <= len(truss.ends) <= most:
            continue
        problem, begun = stress_limited(truss), time.process_time()
        found = optimise_layout(problem, max_evaluations=EVALUATIONS)
        ours, begun = time.process_time() - begun, time.process_time()
        ends, iterations = by_ipopt(truss, problem, np.random.default_rng([seed, cases]))
        theirs = time.process_time() - begun
        best, bound = min([found.value, *ends]), least_volume(truss)
        near = next((k + 1 for k, made in enumerate(found.history) if made.best <= 1.01 * best), "never")
        with capsys.disabled():
            print(
                f"\n{cases} cases, seed {seed}, {len(truss.ends)} bars: ours {found.value / best:.4f} "
                f"{found.status.name}, 1 % after {near}; IPOPT " + " ".join(f"{e / best:.4f}" for e in ends)
                + f" in {iterations} iterations; best over the bound {best / bound:.4f}; "
                f"{ours:.1f} and {theirs:.1f} CPU s", end="",
            )  # fmt: skip
