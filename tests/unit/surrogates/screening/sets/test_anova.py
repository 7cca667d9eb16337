"""The search for sets under an ANOVA correlation."""

import numpy as np
import pytest

from surrogates.screening.partitions.anova import anova_landscape
from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.landscape import landscape_of
from surrogates.screening.sets.anova import anova_price, anova_sets, units_that_stay
from surrogates.screening.sets.rules import threshold_for

NUGGET = (1e-4, 10.0)
INPUTS, ACTIVE = 10, (1, 4, 7)


@pytest.fixture(scope="module")
def found():
    x = np.random.default_rng(5).random((56, INPUTS))
    v = np.abs(4 * x[:, ACTIVE] - 2)
    data = canonical_runs(x, np.prod((v + np.array([0.0, 1.0, 4.0])) / [1.0, 2.0, 5.0], axis=1))
    product = landscape_of(data, restricted=True, eta=2.0)
    first = next(u for u in range(INPUTS) if data.given(u) == (1,))
    given = product.climb(
        ((first,),), np.array([2.0, -3.0]), nugget=NUGGET, tolerance=1e-3, max_evaluations=100
    )
    ground = anova_landscape(data, restricted=True, eta=2.0, nugget=NUGGET)
    return anova_sets(ground, given, threshold=threshold_for(INPUTS)), ground, data


def test_the_inputs_of_kinks_are_found(found):
    sets, _, data = found
    assert set(data.given_all(sets.best.units)) == set(ACTIVE)
    assert sets.agreeing >= 1


def test_sets_are_ordered_by_worth_and_met_once(found):
    sets, ground, _ = found
    worth = [sets.worth(at) for at in sets.optima]
    assert worth == sorted(worth, reverse=True)
    assert len({frozenset(at.units) for at in sets.optima}) == len(sets.optima)
    assert sets.worth(sets.best) == pytest.approx(ground.value(sets.best) - 3 * sets.price, abs=1e-9)
    unit = sets.best.units[0]
    beside = sets.without(unit)
    assert beside is None or unit not in beside.units


def test_a_weight_costs_one_more_than_a_theta():
    assert anova_price(3.0) == 4.0


def test_units_stay_where_they_are_worth_their_price(found):
    sets, ground, _ = found
    inert = next(u for u in range(INPUTS) if u not in sets.best.units)
    with_inert = ground.climb(sets.best.joined_by(inert, 0.01, np.log(4.0)), steps=20)
    assert set(units_that_stay(ground, with_inert, price=sets.price)) == set(sets.best.units)
    assert len(units_that_stay(ground, sets.best, price=1e6)) == 1
