"""Layouts of whole members: against enumeration, proofs, prices, groups, minimum densities."""

import itertools

import numpy as np
import pytest

from studies import trusses
from studies.whole_members import enumerated, largest_densities, random_problem
from workbench.engine.layout.formulation.problem import InvalidLayout, static_problem
from workbench.engine.layout.whole_members import WholeStatus, whole_members


def bars(cases=2):
    loads = ((((0, -1), (2.0, 0.0)),), (((1, 0.5), (2.0, 1.0)),))[:cases]
    truss = trusses.ground_structure(columns=3, rows=2, width=2.0, height=1.0, loads=loads)
    return trusses.problem(truss, budgets=[(truss.lengths, 1e3)], lower=1e-3, upper=1.0)


def optimum(problem, count):
    found = []
    for on in itertools.combinations(range(problem.members), count):
        density = problem.lower.copy()
        density[list(on)] = problem.upper[list(on)]
        found.append((float(np.max(problem.evaluate(density).values)), on))
    return min(found)


def test_small_problems_are_enumerated_and_say_so():
    problem = bars()
    found = whole_members(problem, 2, evaluations=120)
    assert found.status is WholeStatus.ENUMERATED
    assert (found.value, found.members) == optimum(problem, 2)
    assert found.bound == found.value
    assert found.relaxed <= found.value
    assert "The price of rounding is" in found.verdicts[1]
    assert found.price_of_rounding == pytest.approx(found.value / found.relaxed - 1)


def bowls(members=12, seed=0):
    """Two convex rows, gently bent, that want different members."""
    rng = np.random.default_rng(seed)
    roots = 0.2 * rng.normal(size=(2, 4, members))
    slopes = rng.uniform(-1.0, 0.1, (2, members))

    def rows(x):
        bent = np.einsum("rij,j->ri", roots, x)
        return 9 + slopes @ x + (bent**2).sum(1), slopes + 2 * np.einsum("rij,ri->rj", roots, bent)

    return static_problem(rows, start=np.full(members, 0.3), convex=True)


def test_convex_rows_are_proved_by_their_tangents():
    problem = bowls()
    found = whole_members(problem, 4, evaluations=150)  # of 794 choices
    best = min(optimum(problem, k)[0] for k in range(5))
    assert found.status is WholeStatus.BOUNDED
    assert found.value == pytest.approx(best, rel=1e-9)
    assert best * (1 - 1e-5) <= found.bound <= best * (1 + 1e-9)
    assert found.evaluations <= 150


def test_a_bound_that_is_not_met_is_not_called_a_proof():
    problem = bars()
    found = whole_members(problem, 6, evaluations=40)
    assert found.status in (WholeStatus.LIMIT, WholeStatus.SWAPPED)
    assert found.bound <= optimum(problem, 6)[0] <= found.value
    assert "No choice is better than" in found.verdicts[2]


def test_a_mechanism_is_cut_off():
    truss = trusses.ground_structure(
        columns=3, rows=2, width=2.0, height=1.0, loads=((((0, -1), (2.0, 0.0)),),)
    )
    problem = trusses.problem(truss, budgets=[(truss.lengths, 1e3)], lower=0.0, upper=1.0)
    found = whole_members(problem, 8, evaluations=80)
    assert np.isfinite(found.value)
    density = found.density
    assert float(problem.evaluate(density).values.max()) == found.value
    assert set(np.unique(density)) <= {0.0, 1.0}


@pytest.mark.parametrize(
    ("seed", "evaluations"),
    [pytest.param(1, 120, marks=pytest.mark.slow), pytest.param(3, 300, marks=pytest.mark.slow)],
)
def test_transient_problems_meet_their_enumerated_optimum(seed, evaluations):
    problem, count = random_problem(seed, most=1500)
    best, members, _ = enumerated(problem, count)
    found = whole_members(problem, count, evaluations=evaluations)
    assert found.value <= 1.02 * best
    assert found.value >= best
    assert found.evaluations <= evaluations
    assert found.status in (WholeStatus.SWAPPED, WholeStatus.LIMIT, WholeStatus.ENUMERATED)
    assert largest_densities(problem, count) >= found.value
    assert len(members) <= count


def test_tied_members_stay_together_and_others_stay_apart():
    problem, count = random_problem(1, most=1500)
    tied = whole_members(
        problem, count, evaluations=80, groups=[[0, 1], [2, 3]], forbidden=[(4, 5)], always=[6]
    )
    assert (0 in tied.members) == (1 in tied.members)
    assert (2 in tied.members) == (3 in tied.members)
    assert not {4, 5} <= set(tied.members)
    assert 6 in tied.members
    assert len(tied.members) <= count


def test_densities_above_a_minimum_are_polished():
    # sum of (a - 0.5)^2 over pairs that need three members: at full density they overshoot
    def value(a):
        return 1 + float((a.sum() - 1.8) ** 2), np.full(6, 2 * (a.sum() - 1.8))

    problem = static_problem(value, start=np.full(6, 0.3))
    on_or_off = whole_members(problem, 3)
    assert on_or_off.value == pytest.approx(1.04)
    varied = whole_members(problem, 3, minimum=0.4)
    assert varied.value == pytest.approx(1.0, abs=1e-5)
    off = [i for i in range(6) if i not in varied.members]
    assert (varied.density[off] == 0).all()
    assert (varied.density[list(varied.members)] >= 0.4).all()
    with pytest.raises(
        InvalidLayout, match=r"minimum needs to lie between the bounds of every member, got 1.5"
    ):
        whole_members(problem, 3, minimum=1.5)


def test_a_search_without_a_feasible_choice_says_so():
    problem = static_problem(
        lambda a: (float(a.sum()), np.ones(5)), start=np.full(5, 0.5),
        constraints=lambda a: (np.array([4.5 - a.sum()]), -np.ones((1, 5))),
    )  # fmt: skip
    found = whole_members(problem, 3)
    assert found.status is WholeStatus.NONE_FOUND
    assert found.members == ()
    with pytest.raises(InvalidLayout, match="evaluations needs to be >= 2, got 1"):
        whole_members(problem, 3, evaluations=1)
