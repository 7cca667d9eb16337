"""optimise_layout: the strategies, the verdicts, bad input."""

from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from workbench.engine.layout.bound.trust_region import on_bounds
from workbench.engine.layout.formulation.problem import (
    InvalidLayout,
    LayoutProblem,
    TabulatedRows,
    static_problem,
)
from workbench.engine.layout.optimise import METHODS, as_layout_problem, optimise_layout
from workbench.engine.layout.outcome.result import LayoutStatus


def springs(n=200, mixed=False, seed=0):
    """sum w_i/a_i, or half of the members with + w_i a_i: exact by a one-dimensional dual."""
    rng = np.random.default_rng(seed)
    w, v = rng.uniform(0.5, 2, n), rng.uniform(0.5, 2, n)
    rising = np.arange(n) % 2 == 0 if mixed else np.zeros(n, dtype=bool)
    limit = 0.25 * v.sum()

    def value(a):
        return float(np.where(rising, w * a, w / a).sum()), np.where(rising, w, -w / a**2)

    def density(price):
        return np.where(rising, 0.05, np.clip(np.sqrt(w / (price * v)), 0.05, 1.0))

    low, high = 1e-6, 1e6
    for _ in range(200):
        middle = np.sqrt(low * high)
        low, high = (middle, high) if v @ density(middle) > limit else (low, middle)
    problem = static_problem(value, start=np.full(n, 0.2), lower=0.05, budgets=[(v, limit)])
    return problem, value(density(high))[0], high


@pytest.mark.parametrize("mixed", [False, True])
def test_separable_problems_are_solved_to_ten_digits(mixed):
    problem, exact, price = springs(mixed=mixed)
    result = optimise_layout(problem, tolerance=1e-11)
    assert result.value == pytest.approx(exact, rel=1e-10)
    assert result.status is LayoutStatus.CONVERGED
    assert result.shadow_prices[0] == pytest.approx(price, rel=1e-4)
    assert result.excess <= 1e-9


def test_two_groups_have_two_prices():
    problem, _, _ = springs(40)
    half = (np.arange(40) < 20).astype(float)
    two = static_problem(
        lambda a: (float((1 / a).sum()), -1 / a**2), start=np.full(40, 0.1), lower=0.01,
        budgets=[(half, 4.0), (1 - half, 8.0)], names=("left", "right"),
    )  # fmt: skip
    result = optimise_layout(two, tolerance=1e-10)
    assert result.density == pytest.approx(np.where(half > 0, 0.2, 0.4), rel=1e-5)
    assert result.shadow_prices == pytest.approx([25.0, 6.25], rel=1e-4)
    assert problem.budgets == 1


def test_fixed_members_stay():
    lower, upper = np.full(6, 0.01), np.ones(6)
    lower[2] = upper[2] = 0.7
    problem = static_problem(
        lambda a: (float((1 / a).sum()), -1 / a**2), start=np.full(6, 0.2), lower=lower, upper=upper,
        budgets=[(np.ones(6), 2.0)],
    )  # fmt: skip
    for method in ("gsao", "mma", "oc"):
        result = optimise_layout(problem, method, max_evaluations=60)
        assert result.density[2] == 0.7
        assert result.density[0] == pytest.approx(0.26, rel=1e-3)


def test_members_that_are_fixed_at_zero_divide_nothing():
    upper = np.array([1.0, 1.0, 0.0])
    problem = static_problem(
        lambda a: (float(((a - 0.6) ** 2).sum()), 2 * (a - 0.6)), start=[0.9, 0.2, 0.0], upper=upper
    )
    for method in ("gsao", "dsqp"):
        assert optimise_layout(problem, method).density == pytest.approx([0.6, 0.6, 0.0], abs=1e-3)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_improves_and_stays_feasible(method):
    truss = trusses.ground_structure(
        columns=4, rows=3, width=3.0, height=2.0, loads=((((0, -1), (3.0, 1.0)),),)
    )
    problem = trusses.problem(truss, lower=1e-5 / truss.lengths.sum(), second_order=method != "dsqp")
    result = optimise_layout(problem, method, max_evaluations=40)
    best = [entry.best for entry in result.history]
    # plain SLP with its fixed move box only oscillates around such a start; it must not get worse
    assert result.value <= (1.0 if method == "slp" else 0.8) * result.start_value
    assert result.excess <= 1e-9
    assert best == sorted(best, reverse=True)
    assert result.value == pytest.approx(min(entry.value for entry in result.history))


def test_trusses_without_second_derivatives_reach_one_per_cent_of_the_optimum():
    truss = trusses.ground_structure(
        columns=4, rows=3, width=3.0, height=2.0, loads=((((0, -1), (3.0, 1.0)),),)
    )
    problem = trusses.problem(truss, second_order=False, lower=1e-7)
    result = optimise_layout(problem, max_evaluations=150)
    assert result.value <= 1.01 * trusses.plastic_optimum(truss)


@pytest.mark.parametrize("cases", [1, 3])
def test_gradients_alone_come_within_digits_of_the_optimum(cases):
    loads = ((((0, -1), (3.0, 1.0)),), (((1, 0), (3.0, 2.0)),), (((0.6, 0.8), (2.0, 0.0)),))[:cases]
    truss = trusses.ground_structure(columns=4, rows=3, width=3.0, height=2.0, loads=loads)
    exact = optimise_layout(trusses.problem(truss), max_evaluations=100, tolerance=1e-10).value
    if cases == 1:
        assert exact == pytest.approx(trusses.plastic_optimum(truss), rel=1e-8)
    result = optimise_layout(trusses.problem(truss, second_order=False), max_evaluations=150)
    best = np.array([entry.best for entry in result.history]) / exact - 1
    # nearly idle load cases are learnt slowly: four digits of three cases take as long as six of one
    for gap, evaluations in ((1e-2, 30), (1e-3, 60), (1e-6 if cases == 1 else 1e-4, 150)):
        assert best[min(evaluations, len(best)) - 1] <= gap


def test_learnt_curvature_solves_convex_rows_that_are_no_trusses():
    # rows that rise, bend more than their slope tells, and compete: the prior of a falling row is wrong there
    rng = np.random.default_rng(3)
    n = 30
    roots = rng.normal(size=(3, n, n)) / np.sqrt(n)
    centre = rng.uniform(0.0, 0.6, (3, n))

    def rows(x):
        moved = np.einsum("rij,rj->ri", roots, x - centre)
        return 1 + (moved**2).sum(1), 2 * np.einsum("rij,ri->rj", roots, moved)

    def problem(second):
        factors = np.sqrt(2) * roots
        return static_problem(
            (lambda x: (*rows(x), factors)) if second else rows, start=np.full(n, 0.2), convex=True,
            budgets=[(np.ones(n), 0.25 * n)],
        )  # fmt: skip

    exact = optimise_layout(problem(True), max_evaluations=100, tolerance=1e-9)
    learnt = optimise_layout(problem(False), max_evaluations=150, tolerance=1e-7)
    assert "curvature from gradients" in learnt.strategy
    assert learnt.value == pytest.approx(exact.value, rel=1e-5)
    assert learnt.excess <= 1e-9


def test_learnt_curvature_keeps_fixed_members_and_refuses_what_it_cannot_do():
    truss = trusses.ground_structure(
        columns=4, rows=3, width=3.0, height=2.0, loads=((((0, -1), (3.0, 1.0)),),)
    )
    open_, total = trusses.problem(truss, second_order=False), truss.lengths.sum()
    held = np.where(np.arange(open_.members) == 3, 0.5 / total, 0.0)
    upper = np.where(held > 0, held, open_.upper)
    result = optimise_layout(replace(open_, lower=held, upper=upper), max_evaluations=40)
    assert result.density[3] == 0.5 / total
    assert result.value < 0.8 * result.start_value
    with pytest.raises(InvalidLayout, match="'secant_path' needs convex static rows"):
        optimise_layout(replace(open_, convex=False), "secant_path")


def test_an_idle_budget_is_named():
    problem = static_problem(
        lambda a: (float(((a - 0.1) ** 2).sum()) + 1.0, 2 * (a - 0.1)), start=np.full(5, 0.5),
        budgets=[(np.ones(5), 4.0)], names=("steel",),
    )  # fmt: skip
    result = optimise_layout(problem)
    assert result.status is LayoutStatus.IDLE_BUDGET
    assert "rewards removing members" in result.status.value
    assert any("'steel' is idle" in said for said in result.verdicts)
    assert result.shadow_prices == pytest.approx([0.0], abs=1e-9)


def test_a_blind_objective_is_refused_with_the_reason():
    problem = static_problem(lambda a: (3.0, np.zeros(4)), start=np.full(4, 0.5), budgets=[(np.ones(4), 2.0)])
    result = optimise_layout(problem)
    assert result.status is LayoutStatus.ZERO_SENSITIVITY
    assert result.evaluations == 2  # a second design tells a blind objective from a stationary start
    assert "does not see these variables" in result.verdicts[0]


def test_a_trivial_layout_is_returned_when_it_is_better():
    # a barrier between the start and the empty layout: descent goes the wrong way
    def value(a):
        s = float(a.sum())
        return 1.0 + np.sin(3 * s) + 0.2 * s, (3 * np.cos(3 * s) + 0.2) * np.ones(3)

    problem = static_problem(value, start=np.full(3, 0.45), budgets=[(np.ones(3), 2.0)])
    result = optimise_layout(problem, max_evaluations=40)
    assert result.value <= min(value(np.zeros(3))[0], value(np.full(3, 2 / 3))[0])


def test_evaluations_of_trivial_layouts_are_left_to_the_search_where_asked():
    def value(a):
        s = float(a.sum())
        return 1.0 + np.sin(3 * s) + 0.2 * s, (3 * np.cos(3 * s) + 0.2) * np.ones(3)

    problem = static_problem(value, start=np.full(3, 0.45), budgets=[(np.ones(3), 2.0)])
    compared, alone = (optimise_layout(problem, max_evaluations=8, compare=asked) for asked in (True, False))
    assert [h.start for h in compared.history].count(-1) == 2
    assert [h.start for h in alone.history].count(-1) == 0
    assert set(compared.baselines) == {"none", "uniform"}
    assert alone.baselines == {}


def test_what_an_interior_step_leaves_of_a_member_is_taken_from_it():
    problem = static_problem(
        lambda a: (float(a.sum()), np.ones(4)), start=np.full(4, 0.5), lower=0.1,
        budgets=[(np.ones(4), 2.0)],
    )  # fmt: skip
    found = on_bounds(problem, np.array([0.1 + 1e-9, 0.1 + 1e-6, 1.2, 0.3]))
    assert found[0] == 0.1
    assert found[1] > 0.1
    assert found.sum() <= 2.0 + 1e-12
    assert found[2] == 1.0


def test_an_infeasible_problem_is_reported():
    problem = static_problem(
        lambda a: (float(a.sum()), np.ones(2)), start=np.full(2, 0.5), convex_constraints=True,
        constraints=lambda a: (np.array([2.0 - a[0], a[0] - 0.2]), np.array([[-1.0, 0.0], [1.0, 0.0]])),
    )  # fmt: skip
    result = optimise_layout(problem, max_evaluations=15)
    assert result.status is LayoutStatus.INFEASIBLE
    assert "contradict" in result.verdicts[0]
    assert "is at least 1 at every design" in result.verdicts[1]


def test_an_infeasible_start_is_repaired():
    problem = static_problem(
        lambda a: (float((1 / a).sum()), -1 / a**2),
        start=np.full(4, 0.9),
        lower=0.01,
        budgets=[(np.ones(4), 1.0)],
    )
    result = optimise_layout(problem)
    assert result.value == pytest.approx(16.0, rel=1e-5)
    assert all(entry.budget <= 1 + 1e-9 for entry in result.history)


def test_progress_hears_of_every_evaluation():
    heard = []
    result = optimise_layout(
        trusses.cantilever(), progress=lambda e, a: heard.append((e.evaluation, len(a))), keep_iterates=True
    )
    assert heard == [(k + 1, 5) for k in range(result.evaluations)]
    assert len(result.iterates) == result.evaluations


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"lower": 0.5, "budgets": [(np.ones(3), 1.0)]},
            "allows 1 but the lower bounds alone need 1.5. Raise",
        ),
        ({"budgets": [([1, -2, 1], 1.0)]}, "negative cost -2 for member 1"),
        ({"lower": 0.5, "upper": 0.5}, "all members are fixed"),
        ({"lower": 0.6, "upper": 0.5}, r"member 0 needs lower <= upper, got lower=0.6 and upper=0.5"),
        ({"start": [0.1, np.nan, 0.1]}, "start holds a number that is not finite"),
        (
            {"names": ("a", "b"), "budgets": [(np.ones(3), 1.0)]},
            "names needs one name for each of the 1 budgets",
        ),
    ],
)
def test_bad_problems_are_refused(arguments, message):
    with pytest.raises(InvalidLayout, match=message):
        static_problem(lambda a: (1.0, np.ones(3)), **{"start": np.full(3, 0.5), **arguments})


def test_sizes_are_checked():
    ones = np.ones(3)
    with pytest.raises(InvalidLayout, match="costs needs a row per limit and a column per member"):
        LayoutProblem(
            evaluate=lambda a: None,
            start=ones,
            lower=0 * ones,
            upper=ones,
            costs=np.ones((1, 2)),
            limits=[1.0],
        )
    with pytest.raises(InvalidLayout, match="lower needs one number for each of the 3 members"):
        LayoutProblem(
            evaluate=lambda a: None,
            start=ones,
            lower=np.zeros(2),
            upper=ones,
            costs=np.ones((1, 3)),
            limits=[1.0],
        )


def test_a_gradient_that_is_not_a_number_is_named_with_member_and_time():
    def evaluate(a):
        gradient = np.ones((3, 4))
        gradient[1, 2] = np.nan
        return TabulatedRows(
            values=np.array([[0.0, 2.0, 1.0]]), gradient_table=gradient, constraint_gradients=np.zeros((0, 4))
        )

    problem = LayoutProblem(
        evaluate=evaluate, start=np.full(4, 0.5), lower=np.zeros(4), upper=np.ones(4), costs=np.ones((1, 4)),
        limits=[2.0], times=np.array([0.0, 0.25, 0.5]),
    )  # fmt: skip
    with pytest.raises(
        InvalidLayout, match=r"member 2 is nan in scenario 0 at t = 0.25 s. Check the force law"
    ):
        optimise_layout(problem)


def test_values_that_are_not_numbers_are_refused():
    problem = static_problem(lambda a: (np.nan, np.ones(2)), start=np.full(2, 0.5))
    with pytest.raises(InvalidLayout, match="the objective is nan in scenario 0, node 0"):
        optimise_layout(problem)
    problem = static_problem(
        lambda a: (1.0, np.ones(2)), start=np.full(2, 0.5), constraints=lambda a: ([np.inf], [[1.0, 1.0]])
    )
    with pytest.raises(InvalidLayout, match="constraint 0 is inf"):
        optimise_layout(problem)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"method": "bfgs"}, "method needs to be one of gsao"),
        ({"max_evaluations": 0}, "max_evaluations needs to be >= 1, got 0"),
        ({"peaks": "some"}, "peaks needs to be 'all'"),
        ({"method": "trust_region"}, "takes budgets only"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    with pytest.raises(InvalidLayout, match=message):
        optimise_layout(trusses.cantilever(), **arguments)


def test_the_central_path_asks_for_what_it_needs():
    problem = static_problem(lambda a: (float(a @ a), 2 * a), start=np.full(2, 0.5))
    with pytest.raises(InvalidLayout, match="needs static rows with second derivatives"):
        optimise_layout(problem, "central_path")
    with pytest.raises(InvalidLayout, match="or a study's record; dict has no system"):
        as_layout_problem({})
