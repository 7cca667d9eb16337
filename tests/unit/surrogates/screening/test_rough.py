"""Steps and kinks are screened with a rough correlation, smooth responses with the smooth one."""

import numpy as np
import pytest

from surrogates import KrigingScreener, selected_kriging, selection_stability, sobol_indices
from surrogates.screening.evidence import Evidence
from surrogates.screening.verdict import judge

ACTIVE = (1, 4, 6)


def steps(n=48, d=10, seed=3):
    x = np.random.default_rng(seed).random((n, d))
    return x, 2.0 * (x[:, 1] > 0.5) + 1.5 * (x[:, 4] > 0.3) + 1.0 * (x[:, 6] < 0.6)


@pytest.fixture(scope="module")
def rough():
    x, y = steps()
    return KrigingScreener().fit(x, y), x, y


def test_steps_ask_for_the_rough_correlation(rough):
    screener, x, y = rough
    assert screener.eta_ == 1.5
    assert set(screener.selected_) == set(ACTIVE)
    smooth = KrigingScreener(eta=2.0).fit(x, y)
    assert smooth.eta_ == 2.0
    assert screener.log_likelihood_ > smooth.log_likelihood_ + 3.0
    assert not screener.diagnosis_.resolved
    assert screener.diagnosis_.hidden_share >= min(smooth.diagnosis_.hidden_share, 0.1)
    assert screener.diagnosis_.state == "partly resolved"
    assert "the runs speak for steps or kinks" in screener.diagnosis_.verdict


def test_smooth_responses_keep_the_smooth_one():
    rng = np.random.default_rng(1)
    x = rng.random((40, 6))
    y = np.sin(5 * x[:, 2]) + 2 * x[:, 4] * x[:, 1]
    for noise in (0.0, 0.1):
        screener = KrigingScreener().fit(x, y + noise * rng.standard_normal(40))
        assert screener.eta_ == 2.0
    again = KrigingScreener(eta=2.0).fit(x, y)
    free = KrigingScreener().fit(x, y)
    assert again.log_likelihood_ == free.log_likelihood_
    assert again.selected_.tolist() == free.selected_.tolist()


def test_a_rough_one_is_resolved_at_no_share():
    facts = {"n_runs": 60, "n_inputs": 6, "n_selected": 3, "margin": 9.0, "rest_gain": 0.1, "q2": 0.99}
    found = [
        judge(Evidence(**facts, starts_at_best=5, hidden_share=0.004, is_rough=r)) for r in (False, True)
    ]
    assert [one.state for one in found] == ["resolved", "partly resolved"]


def test_published_methods_and_constants_stay_as_they_are():
    x, y = steps(n=24, d=8)
    assert KrigingScreener(method="forward").fit(x, y).eta_ == 2.0
    assert KrigingScreener().fit(x, np.ones(24)).eta_ == 2.0


def test_what_follows_uses_the_same_correlation(rough):
    screener, x, y = rough
    model = selected_kriging(screener, x, y)
    assert (model.correlation, model.eta) == ("power_exponential", 1.5)
    total = sobol_indices(model, draws=20, thetas=0, rng=np.random.default_rng(0)).total.mean
    assert np.argsort(-total).tolist() == [0, 1, 2]
    share = selection_stability(screener, resamples=3, rng=np.random.default_rng(0))
    assert share[list(ACTIVE)].mean() > 0.8
