"""Items of arrays and arithmetic in kernels give what numba's own way gives, to the last bit."""

import operator

import numpy as np
import pytest
from numba import njit

from workbench.engine.compiler.options import CAREFUL

UNCACHED = {**CAREFUL, "cache": False}
PLAIN = {"error_model": "numpy"}
ODD = (0.0, -0.0, 1.5, -2.0, 1e-310, np.inf, -np.inf, np.nan)
SIGNS = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "<": operator.lt,
    "<=": operator.le, ">": operator.gt, ">=": operator.ge, "==": operator.eq, "!=": operator.ne,
}  # fmt: skip


def of_text(text):
    names = {}
    exec(text, names)
    return names["f"]


@pytest.mark.parametrize("values", [ODD, (0, 1, -3, 2**62, -(2**62))], ids=["floats", "whole numbers"])
def test_arithmetic_and_comparisons(values):
    """Zeros, infinities and what is no number among them."""
    lines = "\n".join(f"    out[{i}] = x[i] {sign} x[j]" for i, sign in enumerate(SIGNS))
    f = of_text(f"def f(x, i, j, out):\n{lines}\n    out[{len(SIGNS)}] = 2 * x[i] - 0.5")
    ours, numbas, x = njit(**UNCACHED)(f), njit(**PLAIN)(f), np.array(values)
    for i in range(len(x)):
        for j in range(len(x)):
            one, two = np.zeros((2, len(SIGNS) + 1))
            ours(x, i, j, one)
            numbas(x, i, j, two)
            np.testing.assert_array_equal(one, two)
            np.testing.assert_array_equal(np.signbit(one), np.signbit(two))


def views(x, k, out):
    for i in range(x.shape[0]):
        plane = x[i]
        row = plane[k]
        out[i, 0] = x[i, k, 1]
        out[i, 1] = plane[k, 2] + row[1] + row[0] + row.shape[0] + row.size
        out[i, 2] = x[i, k][0] + x[i, 1:, 0][0] + plane.size
        row[0] = i
        plane[0, 1] += 3
        x[i, k, 2] = x[0, 0, 0] + (1 if k > 0 else 2.5)


@pytest.mark.parametrize("dtype", [float, complex, np.int64])
@pytest.mark.parametrize("form", ["C", "F", "every second", "turned", "no rows"])
def test_items_and_views_of_arrays_of_every_form(dtype, form):
    whole = np.arange(96.0).astype(dtype).reshape(4, 3, 8)
    ours = {
        "C": whole[:2, :, :4].copy(), "F": np.asfortranarray(whole[:2, :, :4]),
        "every second": whole[::2, :, ::2], "turned": whole[::-1, :, ::-1],
        "no rows": np.zeros((0, 3, 4), dtype),
    }[form]  # fmt: skip
    expected = ours.copy(order="C")
    one, two = np.zeros((2, 4, 3), dtype)
    njit(**UNCACHED)(views)(ours, 1, one)
    views(expected, 1, two)
    np.testing.assert_array_equal(ours, expected)
    np.testing.assert_array_equal(one, two)
