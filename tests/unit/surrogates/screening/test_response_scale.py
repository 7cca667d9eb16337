"""The scale on which a response is screened, chosen by leave-one-out on its own scale."""

import re
from dataclasses import replace

import numpy as np
import pytest

from surrogates import KrigingScreener, choose_scale, judged_on_response, left_out_share, on_scale
from surrogates.screening.response_scale import response_shares
from surrogates.screening.verdict import judge


def points(seed=0):
    return np.random.default_rng([3, seed]).random((40, 5))


def test_decades_ask_for_the_logarithm_and_smooth_responses_for_none():
    x = points()
    smooth = 5.0 + np.sin(3 * x[:, 0]) + x[:, 1]
    alone = choose_scale(KrigingScreener(), x, smooth)
    assert alone.scale == "none"
    assert list(alone.unexplained) == ["none"]  # nothing to gain elsewhere
    assert re.fullmatch(r"the response itself leaves \S+ % of left-out runs unexplained", alone.reason)
    wide = np.exp(5 * x[:, 0] + 2 * np.sin(4 * x[:, 3]))
    choice = choose_scale(KrigingScreener(), x, wide)
    assert choice.scale == "log"
    assert choice.unexplained["log"] < 0.1 * choice.unexplained["none"]
    assert "on the response's own scale: none" in choice.reason


def test_a_response_that_is_not_positive_has_no_logarithm():
    x = points()
    assert "log" not in choose_scale(KrigingScreener(), x, x[:, 0] - 0.5).unexplained
    with pytest.raises(ValueError, match="logarithm needs responses above 0, got -1"):
        on_scale([-1.0, 2.0], "log")
    with pytest.raises(ValueError, match="scale needs one of none, log, ranks, box-cox, yeo-johnson, got"):
        on_scale([1.0, 2.0], "sqrt")


def test_a_response_that_changes_sign_is_offered_the_power_of_yeo_and_johnson():
    x = points()
    found = choose_scale(KrigingScreener(), x, np.sinh(4 * (x[:, 0] + x[:, 1] - 1.0)))
    assert set(found.unexplained) == {"none", "ranks", "yeo-johnson"}


def test_a_power_has_to_be_clearly_better_than_the_simple_scales():
    x = points(2)
    quick = 1.0 / (0.15 + 0.5 * x[:, 0] + 0.35 * x[:, 3])  # a line on the scale of power -1
    choice = choose_scale(KrigingScreener(), x, quick)
    best = min(choice.unexplained[scale] for scale in ("none", "log", "ranks"))
    assert choice.unexplained["box-cox"] < 0.8 * best
    assert choice.scale == "box-cox"


def test_what_a_logarithm_folds_away_may_hide_on_the_scale_of_the_response():
    x = np.random.default_rng(5).random((60, 4))
    noise = 0.4 * np.random.default_rng(6).standard_normal(60)
    y = np.exp(6 * x[:, 0] + noise)  # a large value is a factor of 1.5 either way
    screener = KrigingScreener().fit(x, on_scale(y, "log"))
    folded = screener.diagnosis_.hidden_share
    own = left_out_share(screener, x, y, "log")
    assert own.upper > own.unexplained > 2 * folded
    before = screener.diagnosis_
    after = screener.allow_for(own).diagnosis_
    assert after.hidden_share == own.upper
    assert after.q2 == 1.0 - own.unexplained < before.q2
    assert f"Q2 = {after.q2:.2f} only" in after.verdict
    kept = screener.allow_for(replace(own, upper=folded)).diagnosis_
    assert kept is after  # it takes nothing back


def folded(n=50):
    """An input with 0.6 % of the logarithm's variance and 2.5 % of the response's."""
    x = np.random.default_rng(8).random((n, 5))
    return x, np.exp(6 * x[:, 3] + 0.45 * x[:, 1])


def test_what_stands_apart_does_so_for_its_share_of_the_response():
    x, y = folded()
    on_log = KrigingScreener().fit(x, on_scale(y, "log"))
    assert (on_log.selected_.tolist(), on_log.minor_.tolist()) == ([3], [1])
    judged = judged_on_response(on_log, x, y, "log")
    assert judged is on_log
    assert (judged.selected_.tolist(), judged.minor_.tolist()) == ([3, 1], [])
    facts = judged.diagnosis_
    assert facts.resolved
    assert facts.minor == ()
    assert "listed apart" not in facts.verdict
    assert "listed apart" not in judged.judgement("abcde").verdict
    # E y^2 / Var y of exp(6 u) times 0.45^2/12, the relative variance by the weak one
    square, mean = np.expm1(12) / 12, np.expm1(6) / 6
    exact = 0.45**2 / 12 * square / (square - mean**2)
    weak = next(share for share in facts.shares if share.column == 1)
    assert weak.mean == pytest.approx(exact, rel=0.1)
    assert weak.lower < exact < weak.upper


def test_shares_of_the_response_do_not_depend_on_its_unit_or_on_how_it_is_turned():
    x, y = folded()

    def means(values):
        fitted = KrigingScreener().fit(x, on_scale(values, "log"))
        return [share.mean for share in response_shares(fitted, x, values, "log")]

    np.testing.assert_allclose(means(1000.0 * y), means(y), rtol=1e-4)
    # 1/y: the logarithm turned round
    inverse = means(1.0 / y)
    assert inverse[1] > 0.9
    assert inverse[0] == pytest.approx(means(y)[0], rel=0.3)


def test_the_response_itself_is_judged_as_it_was():
    x, y = folded()
    screener = KrigingScreener().fit(x, on_scale(y, "none"))
    before = screener.diagnosis_
    assert judged_on_response(screener, x, y, "none").diagnosis_ is before
    assert before.shares_of == "response"


def test_ranks_keep_their_shares_and_say_whose_they_are():
    x, y = folded()
    screener = KrigingScreener().fit(x, on_scale(y, "ranks"))
    before = screener.diagnosis_
    after = judged_on_response(screener, x, y, "ranks").diagnosis_
    assert (after.shares, after.hidden_share) == (before.shares, before.hidden_share)
    assert after.shares_of == "ranks"
    assert after.own_unexplained == left_out_share(screener, x, y, "ranks").unexplained > 0.0
    assert "shares are of the ranks" in after.verdict
    assert "of the variance of the ranks" in screener.judgement("abcde").verdict


def test_shares_of_groups_labels_and_many_runs():
    rng = np.random.default_rng(4)
    x = np.column_stack([rng.random((320, 4)), rng.integers(0, 3, 320)])
    y = np.exp(2 * x[:, 0] + 2 * x[:, 1] + np.array([0.0, 0.5, 2.0])[x[:, 4].astype(int)])
    screener = KrigingScreener(categorical=[4], groups=[[0, 1]], n_starts=8).fit(x, on_scale(y, "log"))
    shares = {share.column: share for share in response_shares(screener, x, y, "log")}
    assert set(shares) == {0, 1, 4}
    assert shares[0].mean == shares[1].mean  # a group has one share
    assert 0.3 < shares[4].mean < 0.9


def test_a_number_of_inputs_that_was_asked_for_is_given():
    x, y = folded()
    screener = KrigingScreener(n_features=1).fit(x, on_scale(y, "log"))
    assert judged_on_response(screener, x, y, "log").selected_.tolist() == [3]


def test_an_open_input_may_do_what_it_does_to_the_response():
    x = np.random.default_rng(12).random((40, 6))
    y = np.exp(6 * x[:, 3] + 0.45 * x[:, 1])
    screener = KrigingScreener().fit(x, on_scale(y, "log"))
    opened = replace(screener._plain, open=(1,), open_share=0.004)
    assert judge(opened).state == "resolved"
    shares = response_shares(screener, x, y, "log")
    upper = next(share.upper for share in shares if share.column == 1)
    known = opened.with_open(shares)
    assert known.open_share == upper > 0.01
    assert judge(known).state == "partly resolved"
    # one that hardly matters changes nothing
    weak = [replace(share, mean=0.004, upper=0.02) for share in shares]
    assert opened.with_open(weak) is opened
