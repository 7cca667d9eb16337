"""Compiled passes of the interior point against numpy, and what they are made for: a Newton step."""

from types import SimpleNamespace

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
        point, rng.normal(size=ROWS), gradients, lower=np.zeros(N), upper=np.ones(N),
        distances=1.0, exponents=exponents, curvatures=rng.uniform(0, 1, (ROWS, N)),
    )  # fmt: skip
    x = rng.uniform(0.2, 0.9, N)
    return model, x, rng.uniform(0.1, 1, ROWS - 1), rng.uniform(0.1, 1, N), rng.uniform(0.1, 1, N)


def seen(model, x, y, below, above, target):
    """What `conditions` returns and fills; below and above are changed in place."""
    slopes, bend, rest = np.empty((ROWS, N)), np.empty(N), np.empty(N)
    values, largest, total, least = kernels.conditions(
        x, 1 - x, y, below, above, target, model.values, model.gradients, model.distances, model.exponents,
        model.curvatures, model.point, slopes, bend, rest,
    )  # fmt: skip
    return SimpleNamespace(
        values=values, largest=largest, total=total, least=least, slopes=slopes, bend=bend, rest=rest
    )


def test_values_slopes_and_curvature_are_those_of_the_model(inside):
    model, x, y, below, above = inside
    found = seen(model, x, y, below, above, 0.05)
    expected, gradients = model.at(x)
    weights = np.r_[1.0, y]
    assert found.values == pytest.approx(expected, rel=ROUNDING)
    assert found.slopes == pytest.approx(gradients, rel=ROUNDING)
    assert found.bend == pytest.approx(weights @ model.second_derivatives(x), rel=ROUNDING)
    assert found.rest == pytest.approx(weights @ gradients - below + above, abs=ROUNDING)
    products = np.r_[below * x, above * (1 - x)]
    assert found.largest == pytest.approx(np.abs(found.rest).max(), rel=ROUNDING)
    assert found.total == pytest.approx(products.sum(), rel=ROUNDING)
    assert found.least == pytest.approx(products.min(), rel=ROUNDING)
    assert seen(model, x * np.nan, y, below, above, 0.05).largest == np.inf


def test_multipliers_of_the_box_take_up_slopes_near_their_target(inside):
    model, x, y, below, above = inside
    target = 0.05
    before = np.r_[1.0, y] @ model.at(x)[1] - below + above
    was = np.r_[below * x, above * (1 - x)]
    found = seen(model, x, y, below, above, target)
    now = np.r_[below * x, above * (1 - x)]
    assert (np.abs(found.rest) <= np.abs(before) + ROUNDING).all()
    assert (found.rest * before >= 0).all()  # as much as is left, never more
    # a product leaves where it was only as far as three times or a third of the target
    assert (now <= np.maximum(was, kernels.TAKEN_UP * target) + ROUNDING).all()
    assert (now >= np.minimum(was, target / kernels.TAKEN_UP) - ROUNDING).all()
    assert np.abs(found.rest).max() < np.abs(before).max()


def test_directions_solve_the_linearised_conditions(inside):
    model, x, y, below, above = inside
    up, mu, rng = 1 - x, 0.02, np.random.default_rng(2)
    here = seen(model, x, y, below, above, mu)
    theta, weight, first = np.empty(N), np.empty(N), np.empty(N)
    kernels.barrier_bend(x, up, below, above, here.slopes, here.bend, theta, weight)
    J = here.slopes[1:]
    assert theta == pytest.approx(here.bend + below / x + above / up, rel=ROUNDING)
    assert weight == pytest.approx((J**2).sum(axis=0) / theta, rel=ROUNDING)
    kept = np.zeros(N, dtype=bool)
    kept[[1, 4]] = True
    assert kernels.assemble(here.slopes, theta, kept) == pytest.approx(
        (J[:, ~kept] / theta[~kept]) @ J[:, ~kept].T, rel=ROUNDING
    )
    low, high = rng.normal(size=N) * 0.01, rng.normal(size=N) * 0.01
    right = kernels.right_side(x, up, below, above, mu, here.slopes, here.rest, theta, kept, low, high, first)
    assert right == pytest.approx(J[:, ~kept] @ (first / theta)[~kept], rel=ROUNDING)
    dy = np.array([0.3, -0.2])
    dx, dbelow, dabove = np.empty(N), np.empty(N), np.empty(N)
    dx[kept] = ((first - dy @ J) / theta)[kept]  # these come from the linear system
    length = kernels.directions(
        x, up, below, above, mu, here.slopes, theta, kept, first, dy, low, high, dx, dbelow, dabove
    )
    assert here.bend * dx + dy @ J - dbelow + dabove == pytest.approx(-here.rest, abs=1e-10)
    assert below * dx + x * dbelow == pytest.approx(mu - below * x - low, abs=1e-10)
    assert up * dabove - above * dx == pytest.approx(mu - above * up - high, abs=1e-10)
    pairs = [(x, dx), (up, -dx), (below, dbelow), (above, dabove)]
    assert min(float((v + length * dv).min()) for v, dv in pairs) == pytest.approx(0.0, abs=ROUNDING)
    total = kernels.products(x, up, below, above, 0.5, dx, dbelow, dabove, low, high)
    half = (x + 0.5 * dx) @ (below + 0.5 * dbelow) + (up - 0.5 * dx) @ (above + 0.5 * dabove)
    assert total == pytest.approx(half, rel=ROUNDING)
    assert low == pytest.approx(dx * dbelow, rel=ROUNDING)
    assert high == pytest.approx(-dx * dabove, rel=ROUNDING)
