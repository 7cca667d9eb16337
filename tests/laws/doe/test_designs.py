"""What holds for every sampler, size and seed."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import doe

SIZES = st.tuples(st.integers(1, 24), st.integers(1, 9), st.integers(0, 2**32))
SAMPLERS = {
    "lhs": doe.lhs,
    "centred": doe.centred_lhs,
    "ihs": doe.ihs,
    "ihs auto": lambda n, d, rng: doe.ihs(n, d, target="auto", placement="random", rng=rng),
    **{
        name: lambda n, d, rng, name=name: doe.optimised_lhs(n, d, criterion=name, swaps=300, rng=rng)
        for name in ("phi_p", "cd2", "maxpro", "correlation")
    },
    "joint": lambda n, d, rng: doe.optimised_lhs(
        n, d, criterion=("phi_p", "cd2", "maxpro", "correlation"), swaps=400, rng=rng
    ),
}


def strata(points):
    n = len(points)
    return np.sort(np.floor(points * n), axis=0)


@pytest.mark.parametrize("name", SAMPLERS)
@settings(max_examples=25, deadline=None)
@given(size=SIZES)
def test_every_stratum_holds_one_point_and_a_seed_gives_the_same_bits(name, size):
    n, d, seed = size
    points = SAMPLERS[name](n, d, rng=np.random.default_rng(seed))
    assert points.shape == (n, d)
    assert points.flags.c_contiguous
    np.testing.assert_array_equal(strata(points), np.tile(np.arange(n)[:, None], (1, d)))
    np.testing.assert_array_equal(points, SAMPLERS[name](n, d, rng=np.random.default_rng(seed)))
