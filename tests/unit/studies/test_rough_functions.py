"""Functions on which claims about a worst case are easily wrong."""

import numpy as np
import pytest

from studies.rough_functions import FAMILIES, drawn
from workbench.search.runs.unit_space import SearchSpace


def _values(function, space, n=300):
    where = SearchSpace.of(space)
    out = []
    for row in where.rows(where.snap(np.random.default_rng(0).random((n, where.dimension)))):
        try:
            out.append(function(**row))
        except ArithmeticError:
            out.append(np.nan)
    return np.array(out)


@pytest.mark.parametrize("family", FAMILIES)
def test_a_function_is_drawn_by_its_seed_and_has_values(family):
    number = list(FAMILIES).index(family)
    one, again, other = (drawn(seed, count=11)[number] for seed in (3, 3, 4))
    assert one.name == f"{family} 0"
    values = _values(one.function, one.space)
    np.testing.assert_array_equal(values, _values(again.function, again.space))
    assert np.isfinite(values).mean() > 0.3
    assert np.nanmax(values) > np.nanmin(values)
    assert np.isfinite(values).all() == (family != "breaking")
    other_values = _values(other.function, other.space)
    assert not np.array_equal(values, other_values, equal_nan=True)


def test_a_needle_holds_its_share_of_the_box():
    for seed in range(5):
        needle = next(f for f in drawn(seed, count=11) if f.name == "needle 0")
        beyond = _values(needle.function, needle.space, n=4000) > 1.15  # the broad hill ends at 1
        assert beyond.mean() < 0.02
