"""What holds for every output transform: monotone, invertible, with the Jacobian it claims."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from surrogates.analysis.search_scale import OutputTransform, candidates

ROUNDING = 1e-7  # log and exp of numbers of order one, times a spread

values = arrays(float, st.integers(5, 30), elements=st.floats(-1e4, 1e4, width=32), unique=True)


@settings(max_examples=60, deadline=None)
@given(values)
def test_transforms_are_monotone_and_invertible(y):
    for transform in candidates(y):
        ordered = np.sort(y)
        w = transform.forward(ordered)
        assert np.all(np.diff(w) >= 0)
        np.testing.assert_allclose(transform.inverse(w), ordered, rtol=1e-6, atol=ROUNDING * np.ptp(y) + 1e-9)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 1000))
def test_the_jacobian_is_the_derivative(seed):
    y = np.random.default_rng(seed).normal(size=12) * 3
    step = 1e-6
    for transform in candidates(y):
        # inside the range of the runs: at the anchor itself one side is held
        inside = np.sort(y)[1:-1]
        slope = (transform.forward(inside + step) - transform.forward(inside - step)) / (2 * step)
        np.testing.assert_allclose(np.log(slope).sum(), transform.log_jacobian(inside), rtol=1e-4, atol=1e-4)


def test_equal_values_offer_the_identity_alone():
    assert [w.kind for w in candidates(np.ones(5))] == ["identity"]


def test_a_prediction_far_beyond_values_that_blew_up_is_a_number():
    scale = OutputTransform(kind="away", spread=1e100)
    assert np.isfinite(scale.inverse(np.array([1e103, -1e103]))).all()
