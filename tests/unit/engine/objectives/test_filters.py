"""Filters of samples: gains of sines, the formula of the weighting, transposes."""

import numpy as np
import pytest

from workbench.engine import ChannelFilter, WholeBodyFilter

STEP = 1e-3
# ISO 2631-1:1997, the formula of annex A evaluated by hand with the numbers of table A.1
WK = {1.0: 0.482, 2.0: 0.531, 4.0: 0.967, 8.0: 1.036, 16.0: 0.769, 31.5: 0.405}


def gain(filter, frequency, step=STEP):
    """Ratio of the rms of late periods of a sine behind and before a filter."""
    count = round(60.0 / frequency if frequency < 2.0 else 30.0)
    times = np.arange(0.0, count / frequency, step)
    sine = np.sin(2.0 * np.pi * frequency * times)
    late = abs(times / times[-1] - 0.7) < 0.2  # settled, and not yet at the end
    return np.sqrt((filter.applied(sine, step)[late] ** 2).mean() / (sine[late] ** 2).mean())


@pytest.mark.parametrize(("frequency", "expected"), WK.items())
def test_vertical_weighting_of_sines_is_within_1_percent_of_the_formula(frequency, expected):
    assert gain(WholeBodyFilter(weighting="Wk"), frequency) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("frequency", [0.5, 1.0, 2.0, 4.0, 8.0, 16.0])
def test_weighting_across_is_the_product_of_its_formula(frequency):
    p = 2j * np.pi * frequency
    w1, w2, w3 = 2 * np.pi * 0.4, 2 * np.pi * 100.0, 2 * np.pi * 2.0
    band = p**2 / (p**2 + np.sqrt(2) * w1 * p + w1**2) / (1 + np.sqrt(2) * p / w2 + (p / w2) ** 2)
    expected = abs(band * (1 + p / w3) / (1 + p / (0.63 * w3) + (p / w3) ** 2))
    assert gain(WholeBodyFilter(weighting="Wd"), frequency) == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize("cfc", [60.0, 180.0, 600.0, 1000.0])
def test_channel_classes_pass_the_band_and_halve_the_power_at_their_corner(cfc):
    """Twice two poles at 2.0775 cfc: 1/(1 + (f/2.0775 cfc)^4), frequencies warped; -3 dB at 5/3 cfc."""
    step = 0.02 / cfc
    for times in (0.1, 1.0, 5.0 / 3.0, 3.5):
        warped = np.tan(np.pi * times * cfc * step) / np.tan(np.pi * 2.0775 * cfc * step)
        assert gain(ChannelFilter(cfc=cfc), times * cfc, step) == pytest.approx(1 / (1 + warped**4), rel=2e-3)
    assert gain(ChannelFilter(cfc=cfc), 5.0 / 3.0 * cfc, step) == pytest.approx(np.sqrt(0.5), rel=0.01)


@pytest.mark.parametrize("filter", [ChannelFilter(cfc=60.0), WholeBodyFilter(weighting="Wk")])
def test_the_transpose_is_that_of_the_matrix(filter):
    whole = filter.applied(np.eye(60), STEP)
    other = filter.transposed(np.eye(60), STEP)
    assert np.abs(whole.T - other).max() < 1e-13 * np.abs(whole).max()


def test_filters_refuse_what_they_cannot_do():
    with pytest.raises(
        ValueError, match=r"a channel filter of CFC 1000 needs steps of 0 to 0.000241 s, got 0.001"
    ):
        ChannelFilter(cfc=1000.0).applied(np.zeros(4), 1e-3)
    with pytest.raises(ValueError, match="weighting needs to be one of Wk, Wd, got 'Wz'"):
        WholeBodyFilter(weighting="Wz")
