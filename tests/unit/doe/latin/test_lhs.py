"""Random Latin hypercubes that are filled in several pieces."""

import numpy as np

import doe
from doe.latin.lhs import ROWS


def test_every_stratum_holds_one_point_across_the_pieces():
    n = 2 * ROWS + 7
    points = doe.lhs(n, 2, rng=np.random.default_rng(5))
    for column in points.T:
        assert np.array_equal(np.sort((column * n).astype(int)), np.arange(n))
