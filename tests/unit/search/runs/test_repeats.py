"""The mean of repeated runs."""

import numpy as np
import pytest

from workbench.search.runs.repeats import mean_of

TRIALS, LEAST = 4000, 0.94  # the share that 95 % intervals hold scatters by 0.0034


def test_the_interval_holds_the_mean_in_95_percent():
    rng = np.random.default_rng(0)
    made = [mean_of(list(3.0 + rng.standard_normal(5))) for _ in range(TRIALS)]
    held = np.mean([one.interval[0] <= 3.0 <= one.interval[1] for one in made])
    assert LEAST < held < 0.96


def test_one_run_has_no_interval():
    with pytest.raises(ValueError, match="the mean of repeated runs needs at least 2 of them, got 1"):
        mean_of([1.0])
