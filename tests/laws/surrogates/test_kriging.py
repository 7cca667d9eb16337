"""What holds for every Kriging model: interpolation, leave-one-out, invariances, gradients, error
contrasts."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import null_space
from scipy.stats import multivariate_normal

from surrogates.likelihood._kernels_correlation import cross, derivatives, gram
from surrogates.likelihood.correlation import CORRELATIONS, Correlation
from surrogates.likelihood.likelihood import Likelihood
from tests.plain_kriging import plain

KINDS = sorted(CORRELATIONS)
INTERPOLATION = 1e-8  # of the spread of y, for condition numbers below 1e7
REFIT = 1e-8  # closed form against refitting at the same parameters
SHIFT = 1e-6  # in l, after the known shift: two searches stop at slightly different points
TWIN = 1e-13  # fast arithmetic against numpy, both in double precision
DIFFERENCE = 1e-6  # central differences with a step of 1e-5 or 1e-6
few = settings(max_examples=12, deadline=None)


def runs(seed, n=20, d=3):
    rng = np.random.default_rng(seed)
    x = rng.random((n, d))
    w = rng.normal(size=(2, d))
    return x, np.sin(3 * x @ w[0]) + (x @ w[1]) ** 2 + 0.2 * x[:, 0]


def twin(a, b, theta, kind, eta):
    h = np.abs(a[:, None] - b[None])
    if kind in ("gaussian", "power_exponential"):
        return np.exp(-(theta * h ** (2 if kind == "gaussian" else eta)).sum(-1))
    if kind == "matern32":
        t = np.sqrt(3 * theta) * h
        return ((1 + t) * np.exp(-t)).prod(-1)
    if kind == "matern52":
        t = np.sqrt(5 * theta) * h
        return ((1 + t + t**2 / 3) * np.exp(-t)).prod(-1)
    t = np.sqrt(7 * theta) * h
    return ((1 + t + 2 * t**2 / 5 + t**3 / 15) * np.exp(-t)).prod(-1)


@pytest.mark.parametrize("kind", KINDS)
@given(seed=st.integers(0, 10**6))
@few
def test_correlation_equals_its_numpy_twin(kind, seed):
    rng = np.random.default_rng(seed)
    a, b, theta = rng.random((7, 4)), rng.random((5, 4)), np.exp(rng.normal(size=4) * 2)
    r = Correlation(kind=kind, eta=1.6)
    assert r.matrix(a, theta) == pytest.approx(twin(a, a, theta, kind, 1.6), abs=TWIN)
    assert r.cross(a, b, theta) == pytest.approx(twin(a, b, theta, kind, 1.6), abs=TWIN)
    one = np.prod([r.along(a[:, k, None] - b[None, :, k], theta[k], column=k) for k in range(4)], axis=0)
    assert one == pytest.approx(twin(a, b, theta, kind, 1.6), abs=TWIN)


def test_compiled_kernels_equal_their_python_source():
    rng = np.random.default_rng(0)
    x, theta = rng.random((6, 3)), np.array([1.0, 4.0, 0.2])
    w, v = rng.random((6, 6)), rng.random(6)
    w = w + w.T
    for kind in (2, 3):
        r = gram(x, theta, kind, 2.0)
        assert cross(x, x, theta, kind, 2.0) == pytest.approx(r, abs=TWIN)
        fast = derivatives(x, r, w, v, theta, kind, 2.0)
        step = 1e-6
        for k in range(3):
            up, down = theta.copy(), theta.copy()
            up[k] *= np.exp(step / 2)  # scale is the square root of theta
            down[k] *= np.exp(-step / 2)
            dr = (gram(x, up, kind, 2.0) - gram(x, down, kind, 2.0)) / (2 * step)
            assert fast[0][k] == pytest.approx((w * dr).sum(), rel=DIFFERENCE)
            assert fast[1][:, k] == pytest.approx(dr @ v, rel=DIFFERENCE, abs=1e-9)


def complex_l(vector, x, f, y, nugget, restricted):
    """l of the Gaussian correlation for complex log theta: LU in place of Cholesky."""
    theta = np.exp(vector)
    c = np.exp(-((x[:, None] - x[None]) ** 2 * theta).sum(-1)) + nugget * np.eye(len(x))

    def log_det(a):
        sign, size = np.linalg.slogdet(a)
        return np.log(sign) + size

    ci_f = np.linalg.solve(c, f)
    a = f.T @ ci_f
    residual = y - f @ np.linalg.solve(a, ci_f.T @ y)
    m = len(y) - f.shape[1] if restricted else len(y)
    quadratic = residual @ np.linalg.solve(c, residual)
    twice = -m * np.log(quadratic / m) - log_det(c) - m
    return 0.5 * (twice - (log_det(a) if restricted else 0))


@pytest.mark.parametrize("restricted", [True, False])
@pytest.mark.parametrize("p", [1, 4])
@given(seed=st.integers(0, 10**6))
@few
def test_gradient_equals_the_complex_step(restricted, p, seed):
    x, y = runs(seed)
    f = np.column_stack([np.ones(len(x)), x])[:, :p]
    y = (y - y.mean()) / y.std()
    vector = np.random.default_rng(seed).normal(size=3) + 1
    likelihood = Likelihood(
        x=x,
        f=f,
        y=y[:, None],
        correlation=Correlation(),
        groups=np.arange(3),
        nugget=1e-4,
        restricted=restricted,
    )
    evaluation = likelihood.evaluate(vector)
    assert evaluation.value == pytest.approx(complex_l(vector, x, f, y, 1e-4, restricted).real, rel=1e-10)
    steps = [complex_l(vector + 1e-30j * e, x, f, y, 1e-4, restricted).imag / 1e-30 for e in np.eye(3)]
    assert evaluation.gradient == pytest.approx(steps, rel=1e-8, abs=1e-8 * np.abs(steps).max())


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("noisy", "q"), [(False, 1), (False, 2), (True, 1)])
def test_gradient_in_every_parameter_equals_central_differences(kind, noisy, q):
    x, y = runs(3, n=18, d=4)
    x[:, 3] = np.arange(18) % 3
    targets = np.column_stack([y, y**2])[:, :q]
    likelihood = Likelihood(
        x=x,
        f=np.column_stack([np.ones(18), x[:, 0]]),
        y=(targets - targets.mean(axis=0)) / targets.std(axis=0),
        correlation=Correlation(kind=kind, eta=2.0 if kind == "gaussian" else 1.7, labels=(3,)),
        groups=np.array([0, 1, 1, 2]),
        eta_free=kind == "power_exponential",
        nugget=None,
        noise=np.linspace(0.001, 0.1, 18) if noisy else None,
    )
    start = np.array(
        [{"eta": 1.6, "nugget": -4.0, "sigma2": 0.3}.get(name, 0.2) for name in likelihood.names]
    )
    steps = 1e-5 * np.eye(len(start))
    differences = [(likelihood.value(start + e) - likelihood.value(start - e)) / 2e-5 for e in steps]
    evaluation = likelihood.evaluate(start)
    assert evaluation.gradient == pytest.approx(differences, rel=DIFFERENCE, abs=DIFFERENCE)
    assert np.linalg.eigvalsh(evaluation.information).min() > -1e-10


def test_a_prior_adds_its_log_density_to_what_is_climbed_and_nothing_to_the_likelihood():
    x, y = runs(4, n=18, d=4)
    mean, deviation = np.array([0.5, -1.0, 2.0]), 0.7
    plain = Likelihood(
        x=x,
        f=np.ones((18, 1)),
        y=((y - y.mean()) / y.std())[:, None],
        correlation=Correlation(kind="matern52"),
        groups=np.array([0, 1, 1, 2]),
        nugget=None,
    )
    held = replace(plain, prior=(mean, deviation))
    at = np.array([0.3, 0.1, -0.2, -5.0])
    alone, both = plain.evaluate(at), held.evaluate(at)
    z = (at[:3] - mean) / deviation
    assert held.value(at) == plain.value(at)
    assert both.value == pytest.approx(alone.value - 0.5 * z @ z)
    assert both.gradient - alone.gradient == pytest.approx(np.append(-z / deviation, 0.0))
    assert both.information - alone.information == pytest.approx(np.diag([deviation**-2] * 3 + [0.0]))


@pytest.mark.parametrize("trend", ["constant", "linear"])
@given(seed=st.integers(0, 10**6))
@few
def test_restricted_likelihood_is_the_density_of_error_contrasts(trend, seed):
    x, y = runs(seed)
    kriging = plain(trend=trend, theta=[3.0, 2.0, 1.0], nugget=1e-4).fit(x, y)
    f = np.column_stack([np.ones(len(x)), x])[:, : len(kriging.beta_)]
    contrasts = null_space(f.T)
    z = kriging.sigma2_ * (twin(x, x, kriging.theta_, "gaussian", 2) + 1e-4 * np.eye(len(x)))
    density = multivariate_normal(cov=contrasts.T @ z @ contrasts).logpdf(contrasts.T @ y)
    constant = -0.5 * contrasts.shape[1] * np.log(2 * np.pi) + 0.5 * np.linalg.slogdet(f.T @ f)[1]
    assert kriging.log_likelihood_ + constant == pytest.approx(density, rel=1e-9, abs=1e-9)


@given(seed=st.integers(0, 10**6))
@few
def test_profiled_variance_is_the_best_free_variance(seed):
    x, y = runs(seed)
    z = ((y - y.mean()) / y.std())[:, None]
    common = dict(
        x=x, f=np.ones((len(x), 1)), y=z, correlation=Correlation(), groups=np.arange(3), nugget=1e-4
    )
    profiled = Likelihood(**common)
    vector = np.log([3.0, 2.0, 1.0])
    at = profiled.unpack(vector)
    factor = profiled.factor(at)
    best = profiled.variances(factor, at)
    free = Likelihood(**common, noise=np.zeros(len(x)))
    values = [free.value(np.append(vector, np.log(best[0] * c))) for c in (1.0, 1.001, 0.999)]
    assert values[0] == pytest.approx(profiled.value(vector), rel=1e-12)
    assert values[0] > max(values[1:])


@pytest.mark.parametrize("kind", ["power_exponential", "matern32", "matern52", "matern72"])
@pytest.mark.parametrize("trend", ["constant", "linear", "quadratic"])
def test_without_nugget_the_runs_are_met_and_their_variance_is_zero(kind, trend):
    x, y = runs(1, n=25)
    kriging = plain(correlation=kind, eta=1.5, trend=trend, nugget=0.0, theta=[2.0, 2.0, 2.0]).fit(x, y)
    mean, std = kriging.predict(x, return_std=True)
    assert np.abs(mean - y).max() < INTERPOLATION * y.std()
    assert std.max() < 1e-6 * np.sqrt(kriging.sigma2_)  # the root of rounding in 1 - r'C^-1 r


@pytest.mark.parametrize("trend", ["constant", "linear"])
@pytest.mark.parametrize("kind", ["gaussian", "matern52"])
@given(seed=st.integers(0, 10**6))
@few
def test_leave_one_out_equals_refitting_at_fixed_parameters(trend, kind, seed):
    x, y = runs(seed, n=14)
    kriging = plain(correlation=kind, trend=trend, theta=[3.0, 2.0, 4.0], nugget=1e-5).fit(x, y)
    loo = kriging.leave_one_out()
    for i in (0, 6, 13):
        kept = np.arange(14) != i
        other = plain(correlation=kind, trend=trend, theta=[3.0, 2.0, 4.0], nugget=1e-5).fit(x[kept], y[kept])
        mean, std = other.predict(x[[i]], return_std=True)
        # the leave-one-out keeps sigma^2 of all runs and predicts the noisy observation
        variance = kriging.sigma2_ * (std[0] ** 2 / other.sigma2_ + 1e-5)
        assert loo.prediction[i] == pytest.approx(mean[0], rel=REFIT, abs=REFIT * np.ptp(y))
        assert loo.variance[i] == pytest.approx(variance, rel=1e-7)
        assert loo.standardised[i] == pytest.approx((y[i] - mean[0]) / np.sqrt(variance), rel=1e-6)
    assert loo.q2 == pytest.approx(1 - ((y - loo.prediction) ** 2).sum() / ((y - y.mean()) ** 2).sum())


@given(seed=st.integers(0, 10**6), a=st.sampled_from([1e-12, 0.3, 1e12]), b=st.sampled_from([0.0, 5.0]))
@few
def test_affine_change_of_the_response(seed, a, b):
    x, y = runs(seed)
    one = plain(trend="linear", n_starts=2).fit(x, y)
    two = plain(trend="linear", n_starts=2).fit(x, a * (y + b))
    degrees = len(y) - 4
    assert two.log_likelihood_ + degrees * np.log(a) == pytest.approx(one.log_likelihood_, abs=SHIFT)
    new = np.random.default_rng(seed).random((5, 3))
    (m1, s1), (m2, s2) = one.predict(new, return_std=True), two.predict(new, return_std=True)
    assert m2 / a - b == pytest.approx(m1, abs=1e-4 * y.std())
    assert s2 / a == pytest.approx(s1, rel=1e-3, abs=1e-4 * y.std())


@given(seed=st.integers(0, 10**6), power=st.sampled_from([-9, 9]), turned=st.booleans())
@few
def test_affine_change_of_an_input(seed, power, turned):
    x, y = runs(seed)
    scale = np.array([10.0**power, -1.0 if turned else 1.0, 1.0])
    one = plain(n_starts=3).fit(x, y)
    two = plain(n_starts=3).fit(x * scale, y)
    assert two.log_likelihood_ == pytest.approx(one.log_likelihood_, abs=SHIFT)
    assert two.predict(x[:5] * scale) == pytest.approx(one.predict(x[:5]), abs=1e-5 * y.std())


@given(seed=st.integers(0, 10**6))
@few
def test_order_of_rows_and_columns_does_not_matter(seed):
    rng = np.random.default_rng(seed)
    x, y = runs(seed, d=4)
    rows, columns = rng.permutation(len(x)), rng.permutation(4)
    one = plain(n_starts=4).fit(x, y)
    two = plain(n_starts=4).fit(x[rows][:, columns], y[rows])
    assert two.log_likelihood_ == pytest.approx(one.log_likelihood_, abs=SHIFT)
    assert two.predict(x[:5][:, columns]) == pytest.approx(one.predict(x[:5]), abs=1e-5 * y.std())


def test_same_seed_same_bits():
    x, y = runs(5, n=30, d=6)
    one, two = (plain(seed=4).fit(x, y) for _ in range(2))
    assert one.theta_.tobytes() == two.theta_.tobytes()
    assert one.log_likelihood_ == two.log_likelihood_


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("trend", ["constant", "quadratic", "function"])
def test_slopes_of_mean_and_variance_equal_central_differences(kind, trend):
    x, y = runs(2, n=24)
    form = trend
    if trend == "function":
        form = polynomial
    scale = np.array([1.0, 50.0, 0.01])
    kriging = plain(correlation=kind, eta=1.8, trend=form, theta=3.0 / scale**2, nugget=1e-6)
    kriging.fit(x * scale, 7 + 100 * y)
    points = np.random.default_rng(0).random((6, 3)) * scale
    mean, variance = kriging.predict_gradient(points)
    for k in range(3):
        step = np.eye(3)[k] * 1e-5 * scale[k]
        up, down = (kriging.predict(points + s * step, return_std=True) for s in (1, -1))
        size = 2e-5 * scale[k]
        assert mean[:, k] == pytest.approx(
            (up[0] - down[0]) / size, rel=1e-5, abs=1e-5 * np.abs(mean[:, k]).max()
        )
        assert variance[:, k] == pytest.approx(
            (up[1] ** 2 - down[1] ** 2) / size, rel=1e-4, abs=1e-4 * np.abs(variance[:, k]).max()
        )


def polynomial(x):
    return np.column_stack([np.ones(len(x)), x[:, 0] ** 2])


def test_joint_draws_have_the_joint_mean_and_covariance():
    x, y = runs(8)
    kriging = plain(correlation="matern52", trend="linear").fit(x, y)
    points = np.random.default_rng(0).random((4, 3))
    mean, covariance = kriging.predict_covariance(points)
    draws = kriging.sample_posterior(points, 40_000, rng=np.random.default_rng(1))
    both = kriging.predict(points, return_std=True)
    assert mean == pytest.approx(both[0])
    assert np.sqrt(np.diag(covariance)) == pytest.approx(both[1])
    four_errors = 4 / np.sqrt(40_000)
    assert np.abs((draws.mean(0) - mean) / both[1]).max() < four_errors
    scaled = (np.cov(draws.T) - covariance) / np.outer(both[1], both[1])
    assert np.abs(scaled).max() < np.sqrt(2) * four_errors
