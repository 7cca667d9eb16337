"""Layouts of whole members: against enumeration, proofs, prices, groups, minimum densities."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from studies import trusses
from studies.whole_members import enumerated, largest_densities, random_problem
from workbench.engine.layout.formulation.groups import tied
from workbench.engine.layout.formulation.problem import InvalidLayout, MemberGeometry, static_problem
from workbench.engine.layout.optimise import optimise_layout
from workbench.engine.layout.whole.spending import Spending
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
    best, members = enumerated(problem, count)
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


def test_more_choices_than_can_be_listed_are_searched_by_what_rows_see():
    # three rows see 40 members through five sums; a choice of six meets what is wanted of the sums
    rng = np.random.default_rng(3)
    sums, weights = rng.normal(size=(5, 40)), rng.uniform(0.5, 2.0, (3, 5))
    wanted = tuple(sorted(rng.choice(40, 6, replace=False).tolist()))
    aim = sums[:, list(wanted)].sum(axis=1)

    def rows(x):
        off = np.tanh(0.3 * (sums @ x - aim))
        slopes = 0.3 * (1 - off**2)
        return 1 + weights @ off**2, 2 * (weights * off * slopes) @ sums

    problem = static_problem(rows, start=np.full(40, 0.15))
    found = whole_members(problem, 6, evaluations=200)
    rounded = problem.lower.copy()
    rounded[np.argsort(-optimise_layout(
        replace(problem, costs=np.ones((1, 40)), limits=np.array([6.0]), names=("on",))
    ).density)[:6]] = 1.0  # fmt: skip
    assert found.evaluations <= 200
    assert found.value < 1.1  # 1 is met by `wanted`, one of 4.6 million choices
    assert found.value < float(np.max(problem.evaluate(rounded).values))


def test_an_uneven_start_is_rounded_itself():
    problem, count = random_problem(1, most=1500)
    start = np.where(np.isin(np.arange(problem.members), [0, 3, 5]), 0.9, 0.01)[: problem.members]
    density = problem.lower.copy()
    density[[0, 3, 5]] = 1.0
    seen = []
    assert count >= 3
    whole_members(
        replace(problem, start=start), 3, evaluations=4, progress=lambda n, value, best: seen.append(value)
    )
    assert float(np.max(problem.evaluate(density).values)) in seen


def test_a_price_is_not_told_where_fractions_have_not_come_as_far():
    found = whole_members(bars(), 2, evaluations=120)
    behind = replace(found, relaxed=2.0 * found.value)
    assert "has not come as far: the price of rounding is not known" in behind.verdicts[1]


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


def brute_force(problem, count, sizes, allowed=lambda levels: True):
    """The best of all choices, each member off or in one of the sizes."""
    best = (np.inf, ())
    for levels in itertools.product(range(len(sizes) + 1), repeat=problem.members):
        if sum(level > 0 for level in levels) <= count and allowed(levels):
            density = np.where(np.array(levels) > 0, np.array([0.0, *sizes])[list(levels)], problem.lower)
            if problem.excess(density) <= 1e-12:
                best = min(best, (float(np.max(problem.evaluate(density).values)), levels))
    return best


def test_given_sizes_are_enumerated():
    problem, _ = random_problem(6, most=400)
    few = tied(problem, [list(range(7, problem.members))]).problem  # seven members and a heap
    sizes = (0.3, 1.0)
    found = whole_members(few, 2, sizes=sizes, evaluations=200)
    assert found.status is WholeStatus.ENUMERATED
    value, levels = brute_force(few, 2, sizes)
    assert found.value == value
    assert found.members == tuple(np.flatnonzero(levels))
    assert set(np.unique(found.density)) <= {1e-4, 0.3, 1.0}
    assert found.value <= whole_members(few, 2, evaluations=200).value


def test_given_sizes_under_a_budget_and_with_groups_are_proved_by_tangents():
    problem = bowls(8, seed=3)
    costs = np.random.default_rng(5).uniform(0.5, 1.5, 8)
    problem = replace(problem, costs=costs[None], limits=np.array([1.6]), names=("mass",))
    sizes = (0.25, 0.6, 1.0)
    value, levels = brute_force(
        problem, 4, sizes, allowed=lambda levels: levels[0] == levels[1] and levels[2] > 0
    )
    found = whole_members(problem, 4, sizes=sizes, groups=[[0, 1]], always=[2], evaluations=300)
    assert found.status is WholeStatus.BOUNDED
    assert found.value == pytest.approx(value, rel=1e-9)
    assert found.members == tuple(np.flatnonzero(levels))
    assert problem.excess(found.density) == 0.0
    assert found.relaxed <= found.value


def posts(members=8, seed=1):
    """Convex rows with a geometry: members of body 0 to four anchors of body 1."""
    r = np.random.default_rng(seed)
    ends = r.uniform(-1, 1, (4, 2))[np.arange(members) % 4]
    geometry = MemberGeometry(
        body_a=np.zeros(members, int), point_a=r.uniform(-1, 1, (members, 2)),
        body_b=np.ones(members, int), point_b=ends, kind=("belt",) * members,
    )  # fmt: skip
    return replace(bowls(members, seed=seed), geometry=geometry)


@pytest.mark.parametrize("seed", [1, 2])
def test_anchors_are_paid_once_and_the_proof_counts_them(seed):
    problem, count = posts(seed=seed), 4
    price = np.random.default_rng(seed).uniform(0.5, 2.0, 8)
    spending = Spending(member=price, anchor=3.0, bodies=[1], at_most=10.0)

    def spent(levels):
        on = np.flatnonzero(levels)
        return price[on].sum() + 3.0 * len({int(i) % 4 for i in on})

    value, levels = brute_force(problem, count, (1.0,), allowed=lambda levels: spent(levels) <= 10.0)
    for evaluations in (400, 120):  # enumerated, then by tangents
        found = whole_members(problem, count, spending=spending, evaluations=evaluations)
        assert found.value == pytest.approx(value, rel=1e-9)
        assert found.status in (WholeStatus.ENUMERATED, WholeStatus.BOUNDED)
        assert found.members == tuple(np.flatnonzero(levels))
        assert found.spent == pytest.approx(spent(levels))
        assert found.anchors == len({int(i) % 4 for i in np.flatnonzero(levels)})
        assert any("is spent on" in said for said in found.verdicts)
    assert whole_members(problem, count, evaluations=120).value < found.value


@pytest.mark.slow
def test_sizes_of_a_transient_problem_are_searched():
    problem, _ = random_problem(2, most=400)
    few = tied(problem, [list(range(6, problem.members))]).problem
    sizes = (0.4, 1.0)
    found = whole_members(few, 3, sizes=sizes, evaluations=200)
    assert found.value <= 1.02 * brute_force(few, 3, sizes)[0]
    assert set(np.unique(found.density)) <= {1e-4, 0.4, 1.0}


def test_sizes_and_spending_that_cannot_be_are_refused():
    problem = posts()
    with pytest.raises(InvalidLayout, match=r"sizes need to lie above the lower .* got 1\.5"):
        whole_members(problem, 3, sizes=(0.5, 1.5))
    with pytest.raises(InvalidLayout, match="either sizes or a minimum"):
        whole_members(problem, 3, sizes=(0.5,), minimum=0.3)
    with pytest.raises(InvalidLayout, match="need to be >= 0"):
        whole_members(problem, 3, spending=Spending(anchor=-1.0))
    with pytest.raises(InvalidLayout, match="need a problem with a geometry"):
        whole_members(bowls(), 3, spending=Spending(anchor=1.0))
    with pytest.raises(InvalidLayout, match="leave room for what is always on"):
        whole_members(problem, 3, always=[0, 1], spending=Spending(anchor=1.0, at_most=1.0, bodies=[1]))
