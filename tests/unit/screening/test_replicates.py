"""A screening takes replicates: runs at equal inputs with noise."""

import numpy as np
import pytest

from workbench.screening.kriging import screen
from workbench.space.box import Parameter, Space

SPACE = Space([Parameter(f"x{i}", lower=0.0, upper=1.0) for i in range(6)])
NOISE = 0.3  # of a response that ranges over 4.6


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(2))
def test_the_active_inputs_are_found_in_fifteen_points_run_three_times(seed):
    rng = np.random.default_rng(seed)
    points = np.repeat(rng.random((15, 6)), 3, axis=0)
    rows = [
        {**row, "y": 3 * row["x0"] + 2 * np.sin(3 * row["x1"]) + NOISE * rng.standard_normal()}
        for row in SPACE.rows(points)
    ]
    found = screen(rows, SPACE, "y", effects=False)
    assert set(found.selected) == {"x0", "x1"}
