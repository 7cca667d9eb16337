"""The count of bounds on worst cases that are predicted from tables."""

import numpy as np
import pytest

from studies.predicted_worst_cases import run
from studies.worst_case_calibration import FUNCTIONS


@pytest.mark.slow
def test_shares_count_from_the_worst_row():
    found = run((0,), functions=FUNCTIONS[:1])  # the borehole, which tables foretell
    assert list(found["case"].values) == ["borehole max", "borehole min"]
    assert (found["extreme"] > 0).all()
    assert (found["upper"] >= found["predicted"]).all()
    assert (found["predicted"] >= 0).all()
    assert found.attrs["covered"] == 1.0


@pytest.mark.slow
def test_bounds_that_are_stated_cover():
    found = run((80,))
    is_stated = np.isfinite(found["upper"])
    covered = found["extreme"] <= found["upper"] + 1e-6
    assert int(is_stated.sum()) >= 12
    assert float(covered[is_stated].mean()) >= 0.8  # 0.96 counted; of about 18 tables three may be missed
