"""What is known of a layout beside what its result says: the other programme, faults that are found."""

from dataclasses import replace

import numpy as np
import pytest

from studies import layout_statuses
from studies.layout_statuses import MAKES, case, first_order_error, judged
from workbench.engine.layout.formulation.problem import static_problem
from workbench.engine.layout.optimise import METHODS, RUNS_ONLY, optimise_layout
from workbench.engine.layout.outcome.result import LayoutStatus


def test_the_other_programme_knows_optima_and_promises():
    w = np.array([1.0, 4.0, 9.0])
    problem = static_problem(
        lambda a: (float((w / a).sum()), -w / a**2), start=np.full(3, 0.3), lower=0.01,
        budgets=[(np.ones(3), 1.0)],
    )  # fmt: skip
    assert first_order_error(problem, np.array([1.0, 2.0, 3.0]) / 6.0) <= 1e-9
    # at equal shares all moves to the third: slopes -9 w, room 2/3 and -1/3 + 0.01
    third = np.full(3, 1 / 3)
    promised = 81 * (1 - 0.02 - 1 / 3) - (9 + 36) * (1 / 3 - 0.01)
    assert first_order_error(problem, third) == pytest.approx(promised / 42.0, rel=1e-9)


def test_a_limit_keeps_the_other_programme_from_promising():
    problem = static_problem(
        lambda a: (float(a.sum()), np.ones(2)), start=np.ones(2), upper=2.0,
        constraints=lambda a: (np.array([1.0 - a[0] * a[1]]), np.array([[-a[1], -a[0]]])),
    )  # fmt: skip
    assert first_order_error(problem, np.ones(2)) <= 1e-9
    # at (2, 1/2) the linearised limit is dx/2 + 2 dy >= 0: the first falls by 2, the second rises by 1/2
    assert first_order_error(problem, np.array([2.0, 0.5])) == pytest.approx(1.5 / 2.5, rel=1e-9)


def test_every_make_and_method_has_its_turn():
    seeds = range(7000, 7110)
    seen = {(seed % len(MAKES), case(seed).method) for seed in seeds if seed % 5 in (0, 4)}
    assert {method for make, method in seen if make == 0} >= {"gsao", "mma", "slp", *RUNS_ONLY}
    assert {method for make, method in seen if make == 4} >= {"gsao", "oc", "gcmma", "linear_steps"}
    assert {method for _, method in seen} <= {*METHODS, *RUNS_ONLY}


@pytest.mark.parametrize("seed", [7000, 7001, 7002, 7013, 7019])
def test_a_few_results_say_what_is_so(seed):
    row = judged(seed, evaluations=12)
    assert row.faults == ()
    assert row.evaluations <= 12


def test_an_optimum_that_few_rows_hide_is_called_so():
    row = judged(7440)  # the peaks within 10 % of the largest promise 3e-3
    assert (row.status, row.faults) == ("CONVERGED", ())
    assert row.kkt == pytest.approx(row.error, abs=1e-7)


@pytest.mark.parametrize(
    ("status", "said"),
    [
        (LayoutStatus.CONVERGED, "converged with a first-order error of"),
        (LayoutStatus.INFEASIBLE, "a feasible"),
    ],
)  # fmt: skip
def test_what_is_not_so_is_found(monkeypatch, status, said):
    def boasting(problem, method, *, max_evaluations):
        return replace(optimise_layout(problem, method, max_evaluations=max_evaluations), status=status)

    monkeypatch.setattr(layout_statuses, "optimise_layout", boasting)
    assert any(said in fault for fault in judged(7001, evaluations=2).faults)


def test_a_search_that_breaks_is_counted(monkeypatch):
    def broken(problem, method, *, max_evaluations):
        raise ValueError("shapes differ")

    monkeypatch.setattr(layout_statuses, "optimise_layout", broken)
    row = judged(7000)
    assert row.status == "BROKEN"
    assert row.faults == ("ended in ValueError: shapes differ",)
