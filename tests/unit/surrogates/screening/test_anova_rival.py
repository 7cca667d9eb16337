"""A screening takes the set of an ANOVA correlation where that leads, and says so."""

import numpy as np
import pytest

from surrogates import KrigingScreener, selection_stability
from surrogates.screening.evidence import Evidence
from surrogates.screening.verdict import judge

ACTIVE = {2, 5, 8}


def kinked(n=56, d=12, seed=4):
    x = np.random.default_rng(seed).random((n, d))
    v = np.abs(4 * x[:, [2, 5, 8]] - 2)
    return x, np.prod((v + np.array([0.0, 1.0, 4.0])) / [1.0, 2.0, 5.0], axis=1)


@pytest.fixture(scope="module")
def seen():
    x, y = kinked()
    return KrigingScreener().fit(x, y), x, y


def test_weak_kinks_are_found_and_never_called_resolved(seen):
    screener = seen[0]
    assert set(screener.selected_) == ACTIVE
    facts = screener.diagnosis_
    assert facts.state == "partly resolved"
    assert "found by a correlation in which weak inputs may bend" in facts.verdict
    assert facts.hidden_share > 0.01
    assert {share.column for share in facts.shares} >= ACTIVE
    assert facts.q2 == pytest.approx(1 - facts.unexplained)
    # a set has one more to bring for each input than under a product
    assert f"l - {facts.threshold + 1:.2f} x" in facts.rule


def test_order_of_rows_and_columns_and_units_do_not_matter(seen):
    screener, x, y = seen
    rng = np.random.default_rng(0)
    rows, columns = rng.permutation(len(y)), rng.permutation(x.shape[1])
    other = KrigingScreener().fit(3.0 - 7.0 * x[rows][:, columns], 5.0 - 2.0 * y[rows])
    assert {int(columns[k]) for k in other.selected_} == ACTIVE
    assert other.diagnosis_.hidden_share == pytest.approx(screener.diagnosis_.hidden_share, rel=1e-3)


def test_a_number_that_was_asked_for_and_a_given_exponent_ask_no_rival(seen):
    _, x, y = seen
    for screener in (KrigingScreener(n_features=3), KrigingScreener(eta=2.0)):
        assert "may bend" not in screener.fit(x, y).diagnosis_.verdict


def test_its_inputs_are_stable_under_its_own_rule(seen):
    share = selection_stability(seen[0], resamples=4, rng=np.random.default_rng(1))
    assert share[[2, 5]].min() == 1.0
    assert share[[k for k in range(12) if k not in ACTIVE]].max() <= 0.5


def test_it_is_resolved_at_no_share():
    facts = {"n_runs": 60, "n_inputs": 6, "n_selected": 3, "margin": 9.0, "rest_gain": 0.1, "q2": 0.99}
    found = [
        judge(Evidence(**facts, starts_at_best=5, hidden_share=0.004, is_anova=a)) for a in (False, True)
    ]
    assert [one.state for one in found] == ["resolved", "partly resolved"]
