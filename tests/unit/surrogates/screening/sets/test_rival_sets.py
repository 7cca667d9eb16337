"""Sets of units beside each other: what comes close, and what they have in common."""

import numpy as np
import pytest

from surrogates import KrigingScreener
from surrogates.screening.partitions.optimum import Optimum
from surrogates.screening.sets.backward import Chain, alone
from surrogates.screening.sets.rival_sets import also, entering, ranked, rivals

PRICE = 2.0


def chain(*sets_and_values):
    optima = tuple(
        Optimum(
            partition=alone(members), phi=np.zeros(len(members) + 1), value=value, sigma2=1.0, evaluations=0
        )
        for members, value in sets_and_values
    )
    return Chain(sets=tuple(members for members, _ in sets_and_values), optima=optima)


BEST = chain(((3, 1, 0), 14.0), ((3, 1), 13.0), ((3,), 6.0), ((), 0.0))
OTHER = chain(((3, 2, 1), 13.5), ((3, 2), 12.9), ((3,), 6.0), ((), 0.0))
THIRD = chain(((3, 2, 4), 14.6), ((3, 2), 12.9), ((2,), 3.0), ((), 0.0))


def test_the_closest_sets_and_the_margin():
    beside = rivals(BEST, 1, [OTHER], PRICE)  # {1, 3}: 13 - 4 = 9
    assert beside.closest[0] == ((2, 3), pytest.approx(0.1))
    assert beside.margin == pytest.approx(0.1)
    assert beside.closest[1] == ((0, 1, 3), pytest.approx(1.0))  # holds the chosen ones: no rival of theirs
    assert len(beside.closest) == 5


def test_a_doubt_misses_a_chosen_unit_and_is_nearly_as_likely():
    doubts = rivals(BEST, 1, [OTHER], PRICE).doubts
    # {1, 2, 3} and {0, 1, 3} miss none, {3} falls by 5
    assert [(members, optimum.value) for members, optimum in doubts] == [((2, 3), 12.9)]


def test_all_runs_add_their_doubts_to_those_of_a_part():
    part, whole = rivals(BEST, 1, [OTHER], PRICE), rivals(THIRD, 0, [], PRICE)
    both = also(part, whole)
    assert both.closest == part.closest
    assert both.margin == min(part.margin, whole.margin)
    assert {members for members, _ in both.doubts} == {(2, 3)}


def test_units_that_most_good_sets_share_come_first():
    # {1, 3} is the best set, but 2 is in three of the five nearly as good ones, with more weight
    order = ranked(entering(BEST, 2), [BEST, OTHER, THIRD], PRICE)
    weights = {(3, 1): 9.0, (3, 2): 8.9, (3, 2, 4): 8.6, (3, 1, 0): 8.0, (3, 2, 1): 7.5}
    share = {u: sum(np.exp(w) for s, w in weights.items() if u in s) for u in range(5)}
    assert list(order) == sorted(share, key=lambda u: -share[u]) == [3, 2, 1, 4, 0]


def test_units_of_equal_weight_keep_the_order_of_entering():
    sure = chain(((0, 1, 2), 90.0), ((0, 1), 60.0), ((1,), 30.0), ((), 0.0))
    assert entering(sure, 3) == [1, 0, 2]
    assert ranked(entering(sure, 3), [sure], PRICE) == (1, 0, 2)


@pytest.mark.parametrize("seed", range(3))
def test_selected_inputs_lead_where_the_runs_are_enough(seed):
    rng = np.random.default_rng(seed)
    x = rng.random((60, 12))
    y = 10 * np.sin(np.pi * x[:, 3] * x[:, 8]) + 20 * (x[:, 5] - 0.5) ** 2 + 6 * x[:, 0]
    found = KrigingScreener().fit(x, y)
    assert set(found.ranking_[:4].tolist()) == set(found.selected_.tolist()) == {0, 3, 5, 8}
    asked = KrigingScreener(n_features=2).fit(x, y)
    assert set(asked.ranking_[:2].tolist()) == set(asked.selected_.tolist())


def test_a_large_design_ranks_what_all_runs_selected_first():
    rng = np.random.default_rng(5)
    x = rng.random((180, 8))
    y = np.sin(4 * x[:, 6]) + x[:, 2] * x[:, 1] + 0.02 * rng.standard_normal(180)
    found = KrigingScreener().fit(x, y)
    k = len(found.selected_)
    assert set(found.ranking_[:k].tolist()) == set(found.selected_.tolist()) >= {1, 2, 6}
