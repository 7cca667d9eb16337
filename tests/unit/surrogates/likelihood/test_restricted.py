"""The restricted likelihood: definition, profile, gradient, scale."""

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import minimize_scalar

from surrogates import NotPositiveDefinite, profiled_log_likelihood, restricted_log_likelihood

ROUNDING = 1e-10  # relative: both sides are the same formula in another order
COMPLEX_STEP = 1e-8  # relative: the complex step itself is exact to rounding


def case(seed=0, n=30, d=5):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    y = np.sin(4 * x[:, 0]) + x[:, 1] * x[:, 2] + 0.1 * rng.standard_normal(n)
    return x, y, rng.normal(0, 1, d)


def trend(x, kind):
    return np.ones((len(x), 1)) if kind == "constant" else np.column_stack([np.ones(len(x)), x])


def complex_likelihood(phi, x, y, f, nugget, restricted):
    """l profiled over sigma^2 by plain linear algebra; analytic, so that it takes a complex step."""
    n, p = f.shape
    h = x[:, None, :] - x[None, :, :]
    c = np.exp(-(h * h) @ np.exp(phi)) + nugget * np.eye(n)
    inverse = np.linalg.inv(c)
    a = f.T @ inverse @ f
    residual = y - f @ np.linalg.solve(a, f.T @ inverse @ y)
    m = n - p if restricted else n

    def log_det(z):
        sign, value = np.linalg.slogdet(z)
        return value + np.log(sign)  # sign carries the phase

    l = -0.5 * (m * np.log(residual @ inverse @ residual / m) + log_det(c) + m)
    return l - 0.5 * log_det(a) if restricted else l


@pytest.mark.parametrize("kind", ["constant", "linear"])
def test_it_is_the_density_of_error_contrasts(kind):
    x, y, phi = case()
    f = trend(x, kind)
    n, p = f.shape
    sigma2, nugget = 1.7, 1e-6
    h = x[:, None, :] - x[None, :, :]
    z = sigma2 * (np.exp(-(h * h) @ np.exp(phi)) + nugget * np.eye(n))
    k = null_space(f.T)  # orthonormal contrasts K'F = 0
    covariance = k.T @ z @ k
    value = k.T @ y
    density = -0.5 * (
        (n - p) * np.log(2 * np.pi)
        + np.linalg.slogdet(covariance)[1]
        + value @ np.linalg.solve(covariance, value)
    )
    constant = -0.5 * (n - p) * np.log(2 * np.pi) + 0.5 * np.linalg.slogdet(f.T @ f)[1]
    l = restricted_log_likelihood(np.exp(phi), sigma2, x, y, trend=f, nugget=nugget)
    assert l + constant == pytest.approx(density, rel=1e-8)  # the inverse of an ill-conditioned matrix


@pytest.mark.parametrize("kind", ["constant", "linear"])
def test_free_and_profiled_variance_agree(kind):
    x, y, phi = case()
    f = trend(x, kind)
    best = profiled_log_likelihood(phi, x, y, trend=f, nugget=1e-6)
    at_best = restricted_log_likelihood(np.exp(phi), best.sigma2, x, y, trend=f, nugget=1e-6)
    assert best.value == pytest.approx(at_best, rel=ROUNDING)
    free = minimize_scalar(
        lambda s: -restricted_log_likelihood(np.exp(phi), np.exp(s), x, y, trend=f, nugget=1e-6),
        bracket=(np.log(best.sigma2) - 1, np.log(best.sigma2) + 1),
        tol=1e-12,
    )
    assert -free.fun == pytest.approx(best.value, rel=ROUNDING)
    assert np.exp(free.x) == pytest.approx(best.sigma2, rel=1e-6)


@pytest.mark.parametrize("restricted", [True, False])
@pytest.mark.parametrize("kind", ["constant", "linear"])
def test_gradient_equals_complex_step(kind, restricted):
    x, y, phi = case()
    f = trend(x, kind)
    nugget = 1e-3
    found = profiled_log_likelihood(phi, x, y, trend=f, nugget=nugget, restricted=restricted)
    step = 1e-25
    exact = [
        complex_likelihood(phi + 1j * step * e, x, y, f, nugget, restricted).imag / step for e in np.eye(5)
    ]
    assert found.value == pytest.approx(complex_likelihood(phi, x, y, f, nugget, restricted), rel=ROUNDING)
    np.testing.assert_allclose(found.gradient, exact, rtol=COMPLEX_STEP, atol=COMPLEX_STEP)
    by_nugget = complex_likelihood(phi, x, y, f, nugget * np.exp(1j * step), restricted).imag / step
    assert found.gradient_nugget == pytest.approx(by_nugget, rel=COMPLEX_STEP)


def test_trend_coefficients_are_generalised_least_squares():
    x, y, phi = case()
    f = trend(x, "linear")
    best = profiled_log_likelihood(phi, x, y, trend=f, nugget=1e-4)
    h = x[:, None, :] - x[None, :, :]
    c = np.exp(-(h * h) @ np.exp(phi)) + 1e-4 * np.eye(len(y))
    w = np.linalg.solve(c, f)
    np.testing.assert_allclose(best.beta, np.linalg.solve(f.T @ w, w.T @ y), rtol=1e-8)


def test_equal_runs_without_a_nugget_are_refused():
    x, y, phi = case()
    x[3] = x[7]
    with pytest.raises(
        NotPositiveDefinite, match=r"covariance of 30 runs is not positive definite at nugget=0"
    ):
        restricted_log_likelihood(np.exp(phi), 1.0, x, y)
    with pytest.raises(NotPositiveDefinite, match=r"correlation of 30 runs .*Set a nugget"):
        profiled_log_likelihood(phi, x, y)
