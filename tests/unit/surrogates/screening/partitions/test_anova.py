"""The ANOVA correlation: its likelihood against dense algebra, its gradient, its errors and its shares."""

import numpy as np
import pytest

from surrogates.analysis.measure import discrete
from surrogates.screening.partitions.anova import AnovaOptimum, anova_landscape
from surrogates.screening.partitions.anova_shares import drawn_total_indices
from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.landscape import landscape_of

NUGGET = (1e-6, 10.0)


def runs(n=30, d=4, seed=2):
    x = np.random.default_rng(seed).random((n, d))
    return canonical_runs(x, 3 * np.abs(x[:, 0] - 0.4) + np.sin(6 * x[:, 1]) + x[:, 2] * x[:, 0])


def point(k=3):
    return AnovaOptimum(
        units=tuple(range(k)),
        weight=np.array([0.8, 0.3, 0.05, 0.4])[:k],
        log_theta=np.log([6.0, 3.0, 1.5, 4.0])[:k],
        log_nugget=np.log(1e-3),
        value=np.nan,
    )


def correlation(x, at):
    c = np.ones((len(x), len(x)))
    for u, w, t in zip(at.units, at.weight, np.exp(at.log_theta), strict=True):
        c *= (1 + w * np.exp(-t * (x[:, None, u] - x[None, :, u]) ** 2)) / (1 + w)
    return c + np.exp(at.log_nugget) * np.eye(len(x))


@pytest.mark.parametrize("restricted", [True, False])
def test_the_likelihood_is_that_of_dense_algebra(restricted):
    data, at = runs(), point()
    ground = anova_landscape(data, restricted=restricted, eta=2.0, nugget=NUGGET)
    c, f, n = correlation(data.x, at), np.ones(len(data.y)), len(data.y)
    inverse = np.linalg.inv(c)
    p = inverse - np.outer(inverse @ f, inverse @ f) / (f @ inverse @ f)
    m = n - 1 if restricted else n
    s2 = data.y @ p @ data.y / m
    expected = -0.5 * (m * np.log(s2) + np.linalg.slogdet(c)[1] + m)
    expected -= 0.5 * np.log(f @ inverse @ f) if restricted else 0.0
    assert ground.value(at) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("restricted", [True, False])
def test_the_gradient_is_that_of_differences(restricted):
    ground, at = anova_landscape(runs(), restricted=restricted, eta=2.0, nugget=NUGGET), point()
    _, gradient = ground._likelihood(at.units, at.weight, at.log_theta, at.log_nugget)
    step, found = 1e-5, []
    for i in range(7):
        ends = []
        for sign in (1, -1):
            p = np.concatenate([at.weight, at.log_theta, [at.log_nugget]])
            p[i] += sign * step
            ends.append(ground._likelihood(at.units, p[:3], p[3:6], p[6])[0])
        found.append((ends[0] - ends[1]) / (2 * step))
    assert gradient == pytest.approx(found, rel=1e-5, abs=1e-6)


def test_large_weights_are_the_product_of_correlations():
    data, at = runs(), point()
    product = landscape_of(data, restricted=True, eta=2.0)
    expected = product.value(((0,), (1,), (2,)), np.append(at.log_theta, at.log_nugget))
    heavy = AnovaOptimum(
        units=at.units, weight=np.full(3, 1e9), log_theta=at.log_theta, log_nugget=at.log_nugget, value=0.0
    )
    ground = anova_landscape(data, restricted=True, eta=2.0, nugget=NUGGET)
    assert ground.value(heavy) == pytest.approx(expected, abs=1e-5)


def test_ascents_rise_and_leave_what_does_not_act_at_no_weight():
    data = runs(n=40)
    ground = anova_landscape(data, restricted=True, eta=2.0, nugget=NUGGET)
    top = ground.climb(point(), steps=60)
    assert top.value > ground.value(point()) + 1.0
    assert ground.value(top) == pytest.approx(top.value, abs=1e-9)
    weights = ground.climb_weights(range(4), 0.1, np.log(4.0), -5.0, steps=60)
    inert = next(u for u, columns in enumerate(data.units) if data.columns[columns[0]] == 3)
    assert weights.weight[inert] < 0.01 * weights.weight.max()


def test_left_out_errors_are_those_of_predictions_without_the_run():
    data, at = runs(n=20), point()
    ground = anova_landscape(data, restricted=True, eta=2.0, nugget=NUGGET)
    errors, c = ground.left_out_errors(at), correlation(data.x, at)
    for i in (0, 7, 19):
        kept = np.arange(20) != i
        inverse, f, y = np.linalg.inv(c[np.ix_(kept, kept)]), np.ones(19), data.y[kept]
        level = f @ inverse @ y / (f @ inverse @ f)
        predicted = level + c[i, kept] @ inverse @ (y - level)
        assert errors[i] == pytest.approx(data.y[i] - predicted, rel=1e-8)


def total_indices(x, y, measures=None):
    data = canonical_runs(x, y)
    ground = anova_landscape(data, restricted=True, eta=2.0, nugget=NUGGET)
    start = AnovaOptimum(
        units=(0, 1), weight=np.full(2, 0.3), log_theta=np.log([4.0, 4.0]), log_nugget=-9.0, value=0.0
    )
    top = ground.climb(start, steps=80)
    drawn = drawn_total_indices(
        data, top, eta=2.0, given=x, measures=measures, draws=10, rng=np.random.default_rng(0)
    )
    order = np.argsort([data.given(u)[0] for u in top.units])
    return drawn.mean(axis=0)[order]


def test_shares_are_the_total_indices_of_the_function():
    x = np.random.default_rng(0).random((60, 2))
    x[:, 1] *= 10.0
    # variances 1/12 and 4/180 of a line and a parabola: 15/19 and 4/19
    y = x[:, 0] + 2 * (x[:, 1] / 10 - 0.5) ** 2
    assert total_indices(x, y) == pytest.approx([15 / 19, 4 / 19], abs=0.03)


def test_shares_follow_the_law_of_an_input():
    x = np.random.default_rng(0).random((60, 2))
    y = -x[:, 0] + 2 * (x[:, 1] - 0.5) ** 2
    # an input that is 0.2 or 0.4 as often has a hundredth of a uniform one's... (0.1)^2 = 0.01 against 1/45
    found = total_indices(x, y, [discrete([0.2, 0.4]), None])
    line, curve = 0.01, 4 / 180
    assert found == pytest.approx([line / (line + curve), curve / (line + curve)], abs=0.05)
