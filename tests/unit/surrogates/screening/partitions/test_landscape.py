"""The compiled ascent against its plain numpy twin, and the two landscapes against each other."""

import numpy as np
import pytest

from surrogates import restricted_log_likelihood
from surrogates.likelihood._kernels_likelihood import likelihood
from surrogates.likelihood._kernels_matrix import exp_minus
from surrogates.screening.partitions.canonical import canonical_runs
from surrogates.screening.partitions.dense import DenseLandscape
from surrogates.screening.partitions.landscape import landscape_of
from surrogates.screening.partitions.optimum import left_out_q2, standard_scores
from surrogates.screening.partitions.packed import PackedLandscape, packed_distances

SAME = 1e-9  # fastmath reorders sums


def runs(seed=0, n=24, d=4, labels=()):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    for k in labels:
        x[:, k] = rng.integers(0, 3, n)
    return canonical_runs(x, np.sin(4 * x[:, 0]) + x[:, 1] + 0.05 * rng.standard_normal(n), labels=labels)


def twin(D, y, phi, restricted):
    """Value, gradient and average information by dense algebra."""
    n, m = len(y), len(D)
    i, j = np.tril_indices(n, -1)
    square = np.zeros((m, n, n))
    square[:, i, j] = square[:, j, i] = D
    theta, nugget = np.exp(phi[:m]), np.exp(phi[m])
    r = np.exp(-np.tensordot(theta, square, 1))
    c = r + nugget * np.eye(n)
    inverse, one = np.linalg.inv(c), np.ones(n)
    p = inverse - np.outer(inverse @ one, inverse @ one) / (one @ inverse @ one)
    dof = n - 1 if restricted else n
    v = p @ y
    s2 = y @ v / dof
    l = -0.5 * (dof * np.log(s2) + np.linalg.slogdet(c)[1] + dof)
    if restricted:
        l -= 0.5 * np.log(one @ inverse @ one)
    slopes = [*(-theta[k] * square[k] * r for k in range(m)), nugget * np.eye(n)]
    trace = p if restricted else inverse
    gradient = np.array([-0.5 * np.sum(trace * s) + 0.5 * v @ s @ v / s2 for s in slopes])
    q = np.array([s @ v for s in slopes])
    a = q @ v
    return l, s2, gradient, 0.5 * q @ p @ q.T / s2 - 0.5 * np.outer(a, a) / (dof * s2**2)


@pytest.mark.parametrize("n", [24, 25, 26, 27])  # rows are taken in fours
@pytest.mark.parametrize("restricted", [True, False])
def test_kernel_equals_its_twin(restricted, n):
    data = runs(n=n)
    D = packed_distances(data, 2.0)
    phi = np.array([0.5, -1.0, -3.0, 0.1, -4.0])
    gradient, information = np.zeros(5), np.zeros((5, 5))
    l, s2 = likelihood(D, np.arange(4), data.y, phi, restricted, 2, gradient, information, -np.inf, -np.inf)
    expected = twin(D, data.y, phi, restricted)
    for found, value in zip((l, s2, gradient, information), expected, strict=True):
        np.testing.assert_allclose(found, value, rtol=SAME, atol=SAME)


def test_exponential_is_right_to_rounding():
    x = np.append(np.random.default_rng(0).gamma(0.5, 20.0, 4000), [0.0, 1e-300, 700.0])
    found = x.copy()
    exp_minus(found, np.empty_like(x))
    np.testing.assert_allclose(found, np.exp(-x), rtol=1e-15)
    far = np.array([1e5])
    exp_minus(far, np.empty(1))
    assert far[0] < 1e-300


def test_kernel_reports_a_matrix_that_is_not_positive_definite():
    D, out = np.zeros((1, 3)), (np.zeros(2), np.zeros((2, 2)))
    phi = np.array([0.0, -60.0])
    assert likelihood(D, np.arange(1), np.arange(3.0), phi, True, 0, *out, -99.0, -np.inf)[0] < -1e299


@pytest.mark.parametrize("labels", [(), (2,)])
def test_both_landscapes_are_the_same_ground(labels, monkeypatch):
    data = runs(labels=labels)
    packed = landscape_of(data)
    monkeypatch.setattr("surrogates.screening.partitions.landscape.PACKED_RUNS", 0)
    dense = landscape_of(data)
    assert isinstance(packed, PackedLandscape)
    assert isinstance(dense, DenseLandscape)
    np.testing.assert_allclose(packed.reach, dense.reach, rtol=SAME)
    partition = ((0,), (2,), (1, 3))
    start = np.array([0.0, -2.0, -3.0, np.log(1e-3)])
    check_same_ground(packed, dense, partition, start)
    check_same_ground(packed, dense, ((1,), (0,)), np.array([-3.0, 0.0, -7.0]))


def check_same_ground(packed, dense, partition, start):
    assert packed.value(partition, start) == pytest.approx(dense.value(partition, start), rel=SAME)
    options = {"nugget": (1e-4, 1.0), "tolerance": 1e-9, "max_evaluations": 200}
    a, b = packed.climb(partition, start, **options), dense.climb(partition, start, **options)
    assert a.value == pytest.approx(b.value, abs=1e-6)
    np.testing.assert_allclose(standard_scores(packed, a), standard_scores(dense, a), rtol=1e-6, atol=1e-6)
    assert left_out_q2(packed, a) == pytest.approx(left_out_q2(dense, a), abs=1e-5)


def test_gradient_of_units_in_any_order(monkeypatch):
    """Selected inputs stand in the order of their activity, the columns of x in another."""
    monkeypatch.setattr("surrogates.screening.partitions.landscape.PACKED_RUNS", 0)
    dense = landscape_of(runs())
    surface = dense._likelihood(((2,), (0,), (3,)), None)
    phi = np.array([-2.0, 0.5, -3.0, -4.0])
    step = 1e-5 * np.eye(4)
    differences = [(surface.value(phi + h) - surface.value(phi - h)) / 2e-5 for h in step]
    np.testing.assert_allclose(surface.evaluate(phi).gradient, differences, rtol=1e-6, atol=1e-6)


def test_value_is_the_restricted_likelihood():
    data = runs()
    ground = landscape_of(data)
    end = ground.climb(
        ((0,), (1, 2, 3)),
        np.array([0.0, -3.0, -7.0]),
        nugget=(1e-3, 1e-3),
        tolerance=1e-8,
        max_evaluations=99,
    )
    dense = restricted_log_likelihood(
        np.exp(end.log_theta(4)), end.sigma2, data.x, data.y, nugget=float(np.exp(end.phi[-1]))
    )
    assert end.value == pytest.approx(dense, rel=1e-10)


def test_left_out_q2_equals_leaving_out():
    data = runs()
    ground = landscape_of(data)
    end = ground.climb(
        ((0,), (1,), (2, 3)),
        np.array([0.0, 0.0, -3, -5]),
        nugget=(1e-4, 1.0),
        tolerance=1e-6,
        max_evaluations=99,
    )
    c, y = ground.correlation(end), data.y
    errors = []
    for i in range(len(y)):
        keep = np.arange(len(y)) != i
        inverse = np.linalg.inv(c[np.ix_(keep, keep)])
        beta = inverse.sum(axis=0) @ y[keep] / inverse.sum()
        errors.append(y[i] - beta - c[i, keep] @ inverse @ (y[keep] - beta))
    assert left_out_q2(ground, end) == pytest.approx(1 - np.sum(np.square(errors)) / np.sum(y**2), abs=1e-8)
