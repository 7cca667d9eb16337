"""REML removes the bias of the variance; calibrated intervals hold their promise. Own seeds and functions."""

import numpy as np
import pytest
from scipy.stats import qmc

from surrogates import Kriging
from surrogates.kriging.trend import basis, terms
from surrogates.likelihood.correlation import Correlation
from surrogates.likelihood.likelihood import Likelihood
from tests.plain_kriging import plain

DRAWS = 5000
BIAS = 0.02  # four standard errors of the mean of 5000 draws with 14 degrees of freedom are 0.021


def draws(seed):
    """Responses (20, 5000) of a process with sigma^2 = 1 and a quadratic trend of six terms."""
    rng = np.random.default_rng(seed)
    x, theta = rng.random((20, 2)), np.array([4.0, 4.0])
    f = basis(x, terms("quadratic", 2))
    r = Correlation().matrix(x, theta) + 1e-8 * np.eye(20)
    y = f @ rng.normal(size=6)[:, None] + np.linalg.cholesky(r) @ rng.normal(size=(20, DRAWS))
    return x, f, y, theta


@pytest.mark.parametrize(("restricted", "expected"), [(True, 1.0), (False, 14 / 20)])
def test_variance_over_many_draws(restricted, expected):
    x, f, y, theta = draws(11)
    likelihood = Likelihood(
        x=x, f=f, y=y, correlation=Correlation(), groups=np.arange(2), restricted=restricted, nugget=1e-8
    )
    at = likelihood.unpack(np.log(theta))
    sigma2 = likelihood.variances(likelihood.factor(at), at)
    assert sigma2.mean() == pytest.approx(expected, abs=BIAS)
    criterion = "reml" if restricted else "ml"
    for j in (0, 17):
        kriging = plain(criterion=criterion, trend="quadratic", theta=theta, nugget=1e-8).fit(x, y[:, j])
        assert kriging.sigma2_ == pytest.approx(sigma2[j], rel=1e-4)


def friedman(u):
    return 10 * np.sin(np.pi * u[:, 0] * u[:, 1]) + 20 * (u[:, 2] - 0.5) ** 2 + 10 * u[:, 3] + 5 * u[:, 4]


def borehole(u):
    low = np.array([0.05, 100, 63070, 990, 63.1, 700, 1120, 9855])
    high = np.array([0.15, 50000, 115600, 1110, 116, 820, 1680, 12045])
    rw, r, tu, hu, tl, hl, length, kw = (low + u * (high - low)).T
    g = np.log(r / rw)
    return 2 * np.pi * tu * (hu - hl) / (g * (1 + 2 * length * tu / (g * rw**2 * kw) + tu / tl))


def piston(u):
    low = np.array([30, 0.005, 0.002, 1000, 90000, 290, 340])
    high = np.array([60, 0.02, 0.01, 5000, 110000, 296, 360])
    m, s, v0, k, p0, ta, t0 = (low + u * (high - low)).T
    a = p0 * s + 19.62 * m - k * v0 / s
    v = s / (2 * k) * (np.sqrt(a**2 + 4 * k * p0 * v0 * ta / t0) - a)
    return 2 * np.pi * np.sqrt(m / (k + s**2 * p0 * v0 * ta / t0 / v**2))


def hartmann3(u):
    a = np.array([[3, 10, 30], [0.1, 10, 35], [3, 10, 30], [0.1, 10, 35]])
    p = 1e-4 * np.array([[3689, 1170, 2673], [4699, 4387, 7470], [1091, 8732, 5547], [381, 5743, 8828]])
    return -(np.array([1, 1.2, 3, 3.2]) * np.exp(-(a * (u[:, None] - p) ** 2).sum(-1))).sum(1)


@pytest.mark.slow
def test_calibrated_intervals_cover_and_plug_in_ones_do_not():
    """95 % intervals at 1000 new points: four functions, five Latin hypercubes each."""
    table = {}
    for f, d, n in [(friedman, 5, 50), (borehole, 8, 64), (piston, 7, 70), (hartmann3, 3, 40)]:
        plug_in, calibrated = [], []
        for seed in range(40, 45):
            x = qmc.LatinHypercube(d, rng=np.random.default_rng(seed)).random(n)
            k = plain(intervals="calibrated").fit(x, f(x))
            new = np.random.default_rng(1000 + seed).random((1000, d))
            mean, std = k.predict(new, return_std=True)
            z = np.abs(f(new) - mean) / std
            calibrated.append(np.mean(z < 1.96))
            plug_in.append(np.mean(z * k.interval_factor_ < 1.96))
        table[f.__name__] = np.mean(plug_in), np.mean(calibrated)
        print(f"{f.__name__:10s} plug-in {np.mean(plug_in):.3f}  calibrated {np.mean(calibrated):.3f}")
    assert np.mean([c for _, c in table.values()]) == pytest.approx(0.95, abs=0.03)
    assert all(0.88 < c < 0.995 for _, c in table.values())
    assert np.mean([p for p, _ in table.values()]) < 0.92


def test_calibration_narrows_intervals_of_a_smooth_response():
    """Where the plug-in intervals hold everything."""
    factors, coverage = [], []
    for seed in range(40, 46):
        x = qmc.LatinHypercube(4, rng=np.random.default_rng(seed)).random(40)
        k = plain(intervals="calibrated", n_starts=3).fit(x, x[:, 0] ** 2 + 2 * x[:, 1] * x[:, 2] + x[:, 3])
        new = np.random.default_rng(1000 + seed).random((1000, 4))
        mean, std = k.predict(new, return_std=True)
        truth = new[:, 0] ** 2 + 2 * new[:, 1] * new[:, 2] + new[:, 3]
        factors.append(k.interval_factor_)
        coverage.append(np.mean(np.abs(truth - mean) < 1.96 * std))
        print(
            k.interval_factor_, coverage[-1], np.mean(np.abs(truth - mean) < 1.96 * std / k.interval_factor_)
        )
    assert max(factors) < 1.0
    assert 0.92 < np.mean(coverage) < 0.995


@pytest.mark.slow
def test_kriging_as_imported_covers_and_is_as_good_as_the_better_correlation():
    """Nothing said: four functions, five other Latin hypercubes each."""
    table = {}
    for f, d, n in [(friedman, 5, 50), (borehole, 8, 64), (piston, 7, 70), (hartmann3, 3, 40)]:
        held, errors = [], []
        for seed in range(60, 65):
            x = qmc.LatinHypercube(d, rng=np.random.default_rng(seed)).random(n)
            new = np.random.default_rng(1000 + seed).random((1000, d))
            truth = f(new)
            mean, std = Kriging().fit(x, f(x)).predict(new, return_std=True)
            held.append(np.mean(np.abs(truth - mean) < 1.96 * std))
            named = [plain(correlation=kind).fit(x, f(x)).predict(new) for kind in ("gaussian", "matern52")]
            errors.append([np.sqrt(np.mean((m - truth) ** 2)) for m in (mean, *named)])
        own, gaussian, matern = np.mean(errors, axis=0)
        table[f.__name__] = np.mean(held), own / min(gaussian, matern)
        print(f"{f.__name__:10s} held {np.mean(held):.3f}  error over the better {table[f.__name__][1]:.2f}")
    assert np.mean([c for c, _ in table.values()]) == pytest.approx(0.95, abs=0.03)
    assert all(0.88 < c < 0.995 for c, _ in table.values())
    assert all(ratio < 1.2 for _, ratio in table.values())
