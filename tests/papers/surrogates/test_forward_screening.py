"""Section 3.3 of the dissertation against an independent implementation, and the shape of Table 3.1."""

import numpy as np
import pytest
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize

from studies.screening_functions import FUNCTIONS
from surrogates import KrigingScreener

SAME_MAXIMUM = 1e-3  # in l: two optimisers stop at different distances from the same maximum
NUGGET = 1e-8


def dense(theta, sigma2, x, y):
    """Eq. (3.13), term by term."""
    h = x[:, None, :] - x[None, :, :]
    z = sigma2 * (np.exp(-(h * h) @ theta) + NUGGET * np.eye(len(y)))
    factor = cho_factor(z)  # an explicit inverse loses two digits of l at this nugget
    f = np.ones((len(y), 1))
    a = f.T @ cho_solve(factor, f)
    b = np.linalg.solve(a, f.T @ cho_solve(factor, y))
    residual = y - f @ b
    log_det = 2 * np.log(np.diag(factor[0])).sum()
    return -0.5 * (log_det + np.log(a[0, 0]) + residual @ cho_solve(factor, residual))


def maximum(selected, start, x, y):
    """Over log theta of each selected input, log theta of the pool, log sigma^2: all free, as published."""
    d = x.shape[1]

    def negative(v):
        theta = np.full(d, np.exp(v[len(selected)]))
        theta[list(selected)] = np.exp(v[: len(selected)])
        try:
            l = dense(theta, np.exp(v[-1]), x, y)
        except np.linalg.LinAlgError:
            return 1e10
        return -l if np.isfinite(l) else 1e10

    bounds = [(-40, 6)] * (len(selected) + 1) + [(-10, 40)]
    ends = [
        minimize(negative, start, method="L-BFGS-B", bounds=bounds, options={"maxiter": 500, "ftol": 1e-13})
    ]
    for _ in range(2):  # central differences run out of digits; a fresh memory goes on
        ends.append(minimize(negative, ends[-1].x, method="L-BFGS-B", bounds=bounds, options={"ftol": 1e-13}))
    return ends[-1].x, -ends[-1].fun


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 1])
def test_forward_equals_an_independent_implementation(seed):
    rng = np.random.default_rng(seed)
    x = rng.random((26, 4)) - 0.5
    y = 2 * np.sin(5 * x[:, 2]) + np.sin(4 * x[:, 0] + 1) + 0.5 * np.sin(3 * x[:, 3])
    # two steps: in the third, two inputs are left in the pool and freeing either gives the same model
    screener = KrigingScreener(method="forward", n_features=2).fit(x, y)
    common = [maximum((), [c, 0.0], x, y) for c in (-7.0, -4.0, -2.0, 0.0, 1.5, 3.0)]
    v, l = max(common, key=lambda c: c[1])
    assert screener.diagnosis_.base_log_likelihood == pytest.approx(l, abs=SAME_MAXIMUM)
    selected = ()
    for step in screener.path_:
        k, tried = len(selected), []
        for i in (i for i in range(4) if i not in selected):
            start = np.concatenate([v[:k], [v[k]], [v[k]], v[k + 1 :]])
            tried.append((*maximum((*selected, i), start, x, y), i))
        v, l, best = max(tried, key=lambda t: t[1])
        selected = (*selected, best)
        assert step.selected == selected
        # L-BFGS with differences stops early on a long ridge: it may go on from where ours ended
        ours = np.log(
            [*np.maximum(step.theta[list(selected)], 1e-15), max(step.theta_common, 1e-15), step.sigma2]
        )
        v, l = max((v, l), maximum(selected, ours, x, y), key=lambda t: t[1])
        assert step.log_likelihood == pytest.approx(l, abs=SAME_MAXIMUM)


def test_a_successful_path_has_the_shape_of_table_3_1():
    """Common theta falls to 0.0000, l rises at every step, the gain falls below 1.92 after the sixth."""
    f = FUNCTIONS["welch"]
    for seed in range(12):
        rng = np.random.default_rng(seed)
        x = (np.argsort(rng.random((20, 80)), axis=1).T + rng.random((80, 20))) / 80
        path = KrigingScreener(method="forward").fit(x, f.evaluate(x)).path_
        if {*path[-2].selected} == {*f.active}:
            break
    else:
        pytest.fail("no successful forward path among twelve samples of 80 runs")
    assert path[0].added == (11,)  # x12 first, as in both tables
    assert path[0].theta_common > path[2].theta_common > path[-2].theta_common
    assert path[-2].theta_common < 5e-4
    assert [s.accepted for s in path] == [True] * 6 + [False]
    assert min(s.gain for s in path[:6]) >= 1.92 > path[6].gain
