"""A chosen scale finds what large values hide, and costs nothing where the response is smooth."""

import numpy as np
import pytest

from studies.screening_lists import FUNCTIONS, jansen_indices
from studies.screening_scales import count, over_decades


def test_a_response_over_decades_is_positive_and_spans_them():
    f = over_decades(2009, 2)
    y = f.evaluate(np.random.default_rng(0).random((4000, f.d)))
    assert y.min() > 0.0
    low, high = np.quantile(y, [0.025, 0.975])
    assert 1.5 < np.log10(high / low) < 2.5
    assert jansen_indices(f).max() > 0.05


@pytest.mark.slow
@pytest.mark.count
def test_the_chosen_scale_lacks_less_over_decades_and_nothing_on_smooth_functions():
    wide = count([over_decades(2023, 2), over_decades(2031, 3)], (0,))
    assert wide["chosen"].screenings == wide["as it is"].screenings == 4
    assert wide["chosen"].lacks <= wide["as it is"].lacks
    assert np.median(wide["chosen"].x) < np.median(wide["as it is"].x)
    smooth = count([FUNCTIONS["loeppky"]], (0,))
    assert smooth["chosen"].lacks == smooth["chosen"].beyond == 0
    assert smooth["chosen"].x == smooth["as it is"].x
