"""The 20-dimensional benchmark, eq. (3.14), against what follows from it by hand.

Variances on [-1/2, 1/2]^20: E x^2 = 1/12, E x^4 = 1/80, E x^6 = 1/448. The reciprocal moments of 1 + x1 are
E 1/(1+x1) = ln 3 and E 1/(1+x1)^2 = 4/3.
"""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

from studies.welch20 import MAXIMUM, NAMES, welch20, worst_corner

# (3.14) has terms up to degree 6 in one variable once squared; 40 Gauss points integrate the reciprocal of
# 1 + x1, analytic with its pole at distance 1/2 from the cube, to rounding
GAUSS_POINTS = 40
ROUNDING = 1e-12

nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
X, W = nodes / 2, weights / 2


def at(**values):
    return welch20(**(dict.fromkeys(NAMES, 0.0) | values))


def variance(values, weights):
    mean = weights @ values
    return weights @ (values - mean) ** 2


def main_effect_variance(name):
    """Variance of one input's own term with all others at 0."""
    return variance(np.array([at(**{name: x}) for x in X]), W)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("x5", 1 / 12),
        ("x19", 1600 / 448 - 400 / 80 + 25 / 12),  # plus sign before 5 x19 would give 10.65 instead of 0.655
        ("x9", 0.09**2 / 12),
        ("x13", 0.25**2 * (1 / 80 - 1 / 144)),
        ("x8", 0.0),
        ("x16", 0.0),
        ("x1", 0.0),  # x1 acts only through x12
    ],
)
def test_variance_of_a_term_that_stands_alone(name, expected):
    assert main_effect_variance(name) == pytest.approx(expected, abs=ROUNDING)


def two_way(a, b):
    values = np.array([[at(**{a: u, b: v}) for v in X] for u in X])
    total = variance(values.ravel(), np.outer(W, W).ravel())
    return total, variance(values @ W, W), variance(W @ values, W)


def test_x1_acts_only_through_x12():
    total, main_1, main_12 = two_way("x1", "x12")
    assert total == pytest.approx(25 / 12 * 4 / 3, abs=ROUNDING)
    assert main_1 == pytest.approx(0.0, abs=ROUNDING)
    assert main_12 == pytest.approx(25 / 12 * math.log(3) ** 2, abs=ROUNDING)


def test_x4_and_x20_share_a_squared_difference():
    total, main_4, main_20 = two_way("x4", "x20")
    assert total == pytest.approx(25 * (1 / 15 - 1 / 36), abs=ROUNDING)
    assert main_4 == pytest.approx(25 * (1 / 80 - 1 / 144), abs=ROUNDING)
    assert main_20 == pytest.approx(main_4, abs=ROUNDING)


def test_mean_over_the_cube():
    # 5/6 from 5 (x4 - x20)^2 and 1/48 from x13^2
    rng = np.random.default_rng(1)
    points = rng.uniform(-0.5, 0.5, (20_000, 20))
    values = [welch20(**dict(zip(NAMES, row, strict=True))) for row in points.tolist()]
    four_standard_errors = 4 * np.std(values) / math.sqrt(len(values))
    assert np.mean(values) == pytest.approx(5 / 6 + 1 / 48, abs=four_standard_errors)
    assert np.var(values) == pytest.approx(4.488, rel=0.05)


def test_largest_value_on_the_cube():
    assert welch20(**worst_corner()) == pytest.approx(MAXIMUM, abs=ROUNDING)
    # the function is a sum of blocks, so no other corner is worse if no single flip and no block flip is
    corner = worst_corner()
    for block in [*[(name,) for name in NAMES], ("x4", "x20"), ("x1", "x12")]:
        flipped = corner | {name: -corner[name] for name in block}
        assert welch20(**flipped) <= MAXIMUM + ROUNDING


def test_names_are_checked():
    with pytest.raises(TypeError, match=r"missing: \['x20'\], unknown: \['x21'\]"):
        welch20(**dict.fromkeys(NAMES[:19], 0.0), x21=0.0)


def test_study_file_describes_the_same_cube():
    study = tomllib.loads((Path(__file__).parents[3] / "studies" / "welch20.toml").read_text())
    assert tuple(p["name"] for p in study["parameter"]) == NAMES
    assert all((p["lower"], p["upper"]) == (-0.5, 0.5) for p in study["parameter"])
    assert study["design"] == {"kind": "ihs", "runs": 50}
    assert study["worst_case"]["budget"] == 60
