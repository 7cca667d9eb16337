"""The scale on which a response is screened, chosen by leave-one-out on its own scale."""

import re
from dataclasses import replace

import numpy as np
import pytest

from surrogates import KrigingScreener, choose_scale, left_out_share, on_scale


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
