"""Compiled passes of the interior point against numpy, and what they are made for: a Newton step."""

import numpy as np
import pytest

from workbench.engine.layout.separable import _kernels_interior as kernels
from workbench.engine.layout.separable.model import SeparableModel

N, ROWS = 7, 3  # variables; objective and two constraints
ROUNDING = 1e-12


@pytest.fixture
def inside():
    """A model with linear, reciprocal, logarithmic and other terms, and a place inside its box."""
    rng = np.random.default_rng(5)
    point = rng.uniform(0.4, 0.6, N)
    exponents = rng.choice([1.0, -1.0, 0.0, -3.0, 0.5], (ROWS, N))
    gradients = rng.normal(size=(ROWS, N))
    gradients = np.where(exponents == 1.0, gradients, -np.abs(gradients))  # convex with these exponents
    model = SeparableModel.build(
        point, rng.normal(size=ROWS), gradients, lower=np.full(N, 0.1), upper=np.ones(N),
        distances=1.0, exponents=exponents, curvatures=rng.uniform(0, 1, (ROWS, N)),
    )  # fmt: skip
    x = rng.uniform(0.2, 0.9, N)
    return model, x, rng.uniform(0.1, 1, ROWS - 1), rng.uniform(0.1, 1, N), rng.uniform(0.1, 1, N)


def seen(model, x, y, below, above, unit, size):
    slopes, bend, rest = np.empty((ROWS, N)), np.empty(N), np.empty(N)
    values = kernels.conditions(
        x, y, below, above, model.values, model.gradients, model.distances, model.exponents,
        model.curvatures, model.point, unit, size, slopes, bend, rest,
    )  # fmt: skip
    return values, slopes, bend, rest


def test_values_slopes_and_curvature_are_those_of_the_model(inside):
    model, x, y, below, above = inside
    unit, size = 2.0, np.array([0.5, 3.0])
    values, slopes, bend, rest = seen(model, x, y, below, above, unit, size)
    expected, gradients = model.at(x)
    weights = np.r_[1 / unit, y / size]
    assert values == pytest.approx(expected, rel=ROUNDING)
    assert slopes == pytest.approx(gradients, rel=ROUNDING)
    assert bend == pytest.approx(weights @ model.second_derivatives(x), rel=ROUNDING)
    assert rest == pytest.approx(weights @ gradients - below + above, rel=ROUNDING)


def test_squares_and_the_largest_are_those_of_all_conditions(inside):
    model, x, y, below, above = inside
    rest = seen(model, x, y, below, above, 1.0, np.ones(2))[3]
    lo, hi, mu = model.lower, model.upper, 0.02
    parts = np.concatenate([rest * (hi - lo), below * (x - lo) - mu, above * (hi - x) - mu])
    squares, largest = kernels.residuals(x, below, above, mu, lo, hi, rest)
    assert squares == pytest.approx(parts @ parts, rel=ROUNDING)
    assert largest == pytest.approx(np.abs(parts).max(), rel=ROUNDING)
    assert kernels.residuals(x, below, above, mu, lo, hi, rest * np.nan)[1] == np.inf


def test_directions_solve_the_linearised_conditions(inside):
    model, x, y, below, above = inside
    unit, size, mu = 2.0, np.array([0.5, 3.0]), 0.02
    lo, hi = model.lower, model.upper
    _, slopes, bend, rest = seen(model, x, y, below, above, unit, size)
    theta, first = np.empty(N), np.empty(N)
    matrix, right = kernels.assemble(x, below, above, mu, lo, hi, size, slopes, bend, rest, theta, first)
    J = slopes[1:] / size[:, None]
    assert matrix == pytest.approx((J / theta) @ J.T, rel=ROUNDING)
    assert right == pytest.approx(J @ (first / theta), rel=ROUNDING)
    dy = np.array([0.3, -0.2])
    dx, dbelow, dabove = np.empty(N), np.empty(N), np.empty(N)
    length = kernels.directions(
        x, below, above, mu, lo, hi, size, slopes, theta, first, dy, dx, dbelow, dabove
    )
    assert bend * dx + dy @ J - dbelow + dabove == pytest.approx(-rest, abs=1e-10)
    assert below * dx + (x - lo) * dbelow == pytest.approx(mu - below * (x - lo), abs=1e-10)
    assert (hi - x) * dabove - above * dx == pytest.approx(mu - above * (hi - x), abs=1e-10)
    kept = [(x - lo, dx), (hi - x, -dx), (below, dbelow), (above, dabove)]
    least = min(float(((v + length * dv) / v).min()) for v, dv in kept)
    assert 0 < length <= 1
    assert least >= 0.005 - ROUNDING
    assert length == 1 or least == pytest.approx(0.005)
