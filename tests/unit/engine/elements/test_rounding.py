"""Rounded steps at arguments of any size."""

import numpy as np
import pytest
from numba import njit

from workbench.engine.elements._kernels_rounding import saturated


@njit(error_model="numpy")
def called(x):
    """Only kernels may call an inner one."""
    return saturated(x)


@pytest.mark.parametrize("x", [-800.0, -360.0, -40.1, -3.0, 0.0, 0.2, 39.9, 41.0, 355.5, 1e6])
def test_saturation_is_tanh_with_slopes(x):
    assert called(x) == pytest.approx(np.tanh(x), rel=1e-14, abs=0.0)
    step = 1e-30  # by complex step: of the library's tanh this is not a number beyond 355
    assert called(complex(x, step)).imag / step == pytest.approx(1.0 - np.tanh(x) ** 2, rel=1e-12)
