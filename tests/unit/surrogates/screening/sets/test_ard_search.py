"""How long the multi-start of a screening goes on, and over which units."""

from dataclasses import replace

import numpy as np
import pytest

from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.landscape import landscape_of
from surrogates.screening.partitions.optimum import left_out_q2
from surrogates.screening.sets import ard_search
from surrogates.screening.sets.narrowing import WIDE
from surrogates.screening.sets.rules import Rules, threshold_for
from surrogates.screening.sets.single_input_fits import margins

RULES = Rules(
    restricted=True,
    eta=2.0,
    nugget=(1e-4, 10.0),
    threshold=threshold_for(8),
    size=None,
    n_starts=100,
    enough=5,
)


def found(n, d, response, *, rules=RULES, part=False, seed=0):
    x = np.random.default_rng(seed).random((n, d))
    runs = canonical_runs(x, response(x))
    ground = landscape_of(runs)
    search = ard_search.search_maxima(
        ground, rules, margins(runs), part=part, rng=np.random.default_rng(seed)
    )
    return ground, search


def smooth(x):
    return x[:, 0] ** 2 + 2 * x[:, 3]


def noise(x):
    return np.random.default_rng(9).standard_normal(len(x))


def test_starts_that_agree_on_a_maximum_that_predicts_end_the_search():
    ground, search = found(40, 8, smooth)
    assert left_out_q2(ground, search.optima[0]) > ard_search.CONVINCING
    assert ard_search.FEWEST <= search.starts < RULES.n_starts


def test_a_maximum_that_predicts_poorly_gets_half_as_many_starts_again():
    ground, search = found(40, 8, noise)
    assert left_out_q2(ground, search.optima[0]) < ard_search.CONVINCING
    assert search.starts >= RULES.n_starts // 2 + ard_search.FEWEST


def test_a_part_of_the_runs_is_searched_shorter():
    _, search = found(40, 8, smooth, part=True)
    assert ard_search.CLOSE_STARTS // 4 <= search.starts <= ard_search.CLOSE_STARTS


def test_very_many_units_are_searched_wide_then_close():
    _, search = found(60, WIDE + 5, smooth)
    least = ard_search.WIDE_STARTS + ard_search.CLOSE_STARTS // 2
    assert least <= search.starts <= ard_search.ROUNDS * (ard_search.WIDE_STARTS + ard_search.CLOSE_STARTS)


@pytest.mark.parametrize("part", [False, True])
def test_the_starts_asked_for_are_not_exceeded(part):
    few = replace(RULES, n_starts=6)
    _, search = found(40, 8, noise, rules=few, part=part)
    assert search.starts <= 6 + 3  # and half as many again
