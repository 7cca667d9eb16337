"""IHS against the published reference runs: n = 10, duplication 5, minimal-standard generator."""

import numpy as np
import pytest
from scipy.spatial.distance import cdist

import doe
from doe.portable.draws import park_miller

# the print-outs carry six decimals
PRINTED = 5e-7


def nearest(cells):
    distances = cdist(cells, cells)
    np.fill_diagonal(distances, np.inf)
    return distances.min(axis=1)


@pytest.mark.parametrize(
    ("seed", "d", "mean", "std"),
    [
        (17, 1, 1.0, 0.0),
        (17, 2, 2.612355, 0.646017),
        (17, 3, 4.250730, 0.381952),
        (17, 4, 5.166268, 0.823054),
        (1207526547, 2, 2.712510, 0.701024),
        (1136848141, 2, 3.162278, 0.0),
        (1231916218, 2, 3.095508, 0.140764),
    ],
)
def test_the_published_runs_are_reproduced(seed, d, mean, std):
    distances = nearest(doe.ihs_cells(10, d, draws=park_miller(seed)))
    assert distances.mean() == pytest.approx(mean, abs=PRINTED)
    assert distances.std(ddof=1) == pytest.approx(std, abs=PRINTED)


def test_the_seeds_of_consecutive_runs_chain():
    draws = park_miller(17)
    for left_behind in (1207526547, 1136848141, 1231916218):
        doe.ihs_cells(10, 2, draws=draws)
        assert int(draws[1]) == left_behind
