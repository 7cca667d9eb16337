"""The stated gap covers the true one."""

import numpy as np
import pytest

from studies.worst_case_calibration import FUNCTIONS, run

BY_NAME = {f.name: f for f in FUNCTIONS}
OFF = 1e-6  # of the range: the extremes are rounded


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.name)
def test_no_value_lies_beyond_the_known_extremes(function):
    points = np.vstack(
        [np.random.default_rng(0).random((500, function.space.dimension)), np.eye(function.space.dimension)]
    )
    values = np.array([function.function(**row) for row in function.space.rows(points)])
    slack = OFF * (function.high - function.low)
    assert function.low - slack <= values.min() < values.max() <= function.high + slack


@pytest.mark.slow
@pytest.mark.count
def test_the_stated_gap_covers_and_is_not_vacuous():
    chosen = [
        BY_NAME[n]
        for n in ("circuit", "camel", "ishigami", "friedman5", "branin", "styblinski3", "michalewicz3")
    ]
    found = run(range(2), functions=chosen)
    assert len(found.case) == 28
    assert found.attrs["coverage"] >= 0.95
    assert found.attrs["width"] <= 0.10
