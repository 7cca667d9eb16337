"""The bound on a predicted worst case, of a table of runs."""

from math import inf

import numpy as np
import pytest

from workbench import Parameter, Space
from workbench.search.evidence.prediction_gap import UNPREDICTED, extrapolation_error
from workbench.search.record import Status
from workbench.search.worst_case import surrogate_worst_case

BOX = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])
POINTS = np.random.default_rng(4).random((24, 2))


def bowl(a, b):
    return (a - 0.3) ** 2 + 0.5 * b**2 + 0.3 * a * b


def cliff(a, b):
    """A slope, and three times as much in the corner where few rows are."""
    return (a + b) * (3.0 if min(a, b) > 0.75 else 1.0)


def table(f, points=POINTS):
    return [{"a": a, "b": b, "y": f(a, b)} for a, b in points.tolist()]


def test_the_errors_at_the_worst_rows_are_those_of_a_kriging_of_the_others():
    smooth, broken = (np.array([row["y"] for row in table(f)]) for f in (bowl, cliff))
    assert broken.max() > 4 > 2 * np.quantile(broken, 0.7)
    assert 1.0 <= extrapolation_error(POINTS, smooth, seed=0) < 3.0
    assert extrapolation_error(POINTS, broken, seed=0) > 3.0
    assert extrapolation_error(POINTS[:4], smooth[:4], seed=0) == inf  # two rows make no Kriging


@pytest.mark.parametrize("sense", ["max", "min"])
def test_a_table_that_foretells_its_worst_rows_has_a_bound_beyond_the_prediction(sense):
    sign = 1.0 if sense == "max" else -1.0
    found = surrogate_worst_case(BOX, table(lambda a, b: sign * bowl(a, b)), response="y", sense=sense)
    assert found.status is Status.SURROGATE
    assert 0.0 < found.gap.width < 1.0
    assert sign * found.gap.upper == pytest.approx(sign * found.value + found.gap.width)
    assert sign * found.gap.upper >= bowl(1.0, 1.0)  # the corner that no row is near


def test_one_that_does_not_has_none():
    found = surrogate_worst_case(BOX, table(cliff), response="y")
    assert (found.gap.upper, found.gap.width) == (inf, inf)
    assert found.gap.sentence == f"No bound is known on how much worse it could be: {UNPREDICTED}."
    assert found.to_dict()["gap"]["upper"] is None
