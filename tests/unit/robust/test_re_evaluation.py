"""Paired re-evaluation of designs over the uncertainty."""

import numpy as np
import pytest

from workbench.errors import NotEnoughRuns, StudyError
from workbench.robust.re_evaluation import re_evaluate, wilson
from workbench.space.box import Distribution, Parameter, Space

U = Space([Parameter("f", lower=0.0, upper=1.0, unit="N"), Parameter("g", lower=-1.0, upper=1.0)])


def response(x, u):
    return x["k"] * u["f"] + u["g"]


DESIGNS = {"old": {"k": 1.0}, "new": {"k": 0.5}}


def test_statistics_equal_the_closed_forms_within_their_intervals():
    result = re_evaluate(response, DESIGNS, U, samples=2000, seed=3, limit=1.0, nominal={"f": 0.5, "g": 0.0})
    old, new = result.summaries
    assert old.mean == pytest.approx(0.5, abs=1e-2)
    assert new.mean == pytest.approx(0.25, abs=1e-2)
    # k f + g > 1 with f ~ U(0, 1), g ~ U(-1, 1): area of the triangle f > 1 - g over 2 = 1/4 for k = 1
    share, low, high = old.beyond_limit
    assert low < 0.25 < high
    assert share == pytest.approx(0.25, abs=0.03)
    median, low, high = old.quantiles["P50"]
    assert low < 0.5 < high
    assert low < median < high
    assert old.price_of_robustness == pytest.approx(0.25)
    assert new.price_of_robustness == 0.0
    middle, low, high = result.paired["new - old"]
    assert low < -0.25 < high
    # common random numbers: the difference is -f/2, whose spread is far below that of either design
    assert high - low < 0.1 * (old.mean_interval[1] - old.mean_interval[0]) * 5
    assert middle == pytest.approx(-0.25, abs=1e-2)


def test_regret_is_measured_against_the_best_design_of_each_scenario():
    result = re_evaluate(response, DESIGNS, U, samples=200, seed=1)
    regret = result.values[:, 0] - result.values.min(axis=1)
    assert result.summaries[0].largest_regret == pytest.approx(regret.max())
    assert result.summaries[1].largest_regret == 0.0


def test_extra_scenarios_enter_the_worst_and_not_the_mean():
    plain = re_evaluate(response, DESIGNS, U, samples=50, seed=1)
    more = re_evaluate(response, DESIGNS, U, samples=50, seed=1, extra_scenarios=[{"f": 1.0, "g": 1.0}])
    assert more.summaries[0].mean == plain.summaries[0].mean
    assert more.summaries[0].worst == 2.0
    assert more.summaries[0].worst_scenario == {"f": 1.0, "g": 1.0}


def test_draws_follow_the_distributions():
    law = Distribution("norm", {"loc": 10.0, "scale": 2.0})
    space = Space([Parameter("m", lower=0.0, upper=20.0, unit="kg", distribution=law)])
    result = re_evaluate(lambda x, u: u["m"], {"a": {}}, space, samples=2000, seed=0)
    assert result.values.std() == pytest.approx(2.0, rel=0.03)


def test_small_is_bad_turns_worst_and_limit_round():
    result = re_evaluate(response, DESIGNS, U, samples=400, sense="min", limit=-0.5)
    assert result.summaries[0].worst == result.values[:, 0].min()
    assert result.summaries[0].beyond_limit[0] == pytest.approx((result.values[:, 0] < -0.5).mean())


def test_failed_runs_are_counted_and_left_out():
    def brittle(x, u):
        return float("nan") if u["f"] > 0.9 else u["f"]

    result = re_evaluate(brittle, {"a": {}}, U, samples=200, seed=5)
    assert result.summaries[0].failed == 20
    assert result.summaries[0].worst <= 0.9


def test_the_frame_and_the_document_hold_the_same_numbers():
    result = re_evaluate(response, DESIGNS, U, samples=20, seed=2)
    frame, document = result.frame(), result.to_dict()
    assert frame["value: new"].tolist() == document["values"]["new"]
    assert list(frame.columns) == ["f", "g", "value: old", "value: new"]


@pytest.mark.parametrize(
    ("kwargs", "match"),
    [
        ({"designs": {}}, "at least one design"),
        ({"designs": ["a"]}, "designs needs a mapping of names to designs, got list"),
        ({"samples": 5}, "samples needs a whole number of at least 10, got 5"),
        ({"samples": 20.5}, "samples needs a whole number of at least 10, got 20.5"),
        ({"limit": "3"}, "limit needs a finite number, got '3'"),
        ({"evaluators": {}}, "evaluators lacks design 'old'; give one for every design, or none at all"),
        (
            {"constraints": "f <= 1"},
            r"constraints needs a list of conditions, got a text; write \['f <= 1'\]",
        ),
        ({"sense": "up"}, "sense needs 'max' or 'min', got 'up'"),
        (
            {"extra_scenarios": [{"f": 3.0, "g": 0.0}]},
            "scenario 1 of 1 is not in the uncertainty: .*'f' lies",
        ),
        ({"nominal": {"f": 0.5}}, r"missing \['g'\]"),
        ({"limit": float("nan")}, "limit needs a finite number, got nan; leave it out to have no limit"),
        ({"limit": float("inf")}, "limit needs a finite number, got inf"),
    ],
)
def test_bad_input_is_named(kwargs, match):
    arguments = {"designs": DESIGNS, "samples": 20, **kwargs}
    with pytest.raises(StudyError, match=match):
        re_evaluate(response, arguments.pop("designs"), U, **arguments)


def test_an_uncertainty_that_is_no_space_is_named():
    with pytest.raises(StudyError, match="uncertainty needs a Space of parameters, got dict"):
        re_evaluate(response, DESIGNS, {"f": (0, 1)}, samples=20)


def test_a_design_that_always_fails_is_named():
    def broken(x, u):
        raise RuntimeError("no licence\n" + "and a long trace " * 99)

    words = "design 'a' gave a value in 0 of 20 runs; at least 10 are needed. Its last failure: .*no licence$"
    with pytest.raises(NotEnoughRuns, match=words):
        re_evaluate(broken, {"a": {}}, U, samples=20)


def test_wilson_interval_of_nothing_and_of_everything():
    assert wilson(0, 0) == (0.0, 1.0)
    low, high = wilson(20, 20)
    assert high == pytest.approx(1.0)
    assert low == pytest.approx(0.8389, abs=1e-4)  # 20/(20 + 1.96^2)


def test_shares_stay_inside_their_intervals_over_seeds():
    hits = 0
    for seed in range(40):
        result = re_evaluate(response, {"old": {"k": 1.0}}, U, samples=100, seed=seed, limit=1.0)
        _, low, high = result.summaries[0].beyond_limit
        hits += low <= 0.25 <= high
    assert hits >= 36  # 95 % nominal; a Latin hypercube only narrows the spread
    assert np.isfinite(hits)


def test_a_design_that_silences_one_parameter_is_told():
    """The new design does without the force: only g is left to matter."""
    designs = {"old": {"k": 3.0}, "new": {"k": 0.0}}
    result = re_evaluate(response, designs, U, samples=60, seed=2, screened=40, response=None)
    old, new = result.screenings
    assert set(old.selected) == {"f", "g"}
    assert old.appeared == old.vanished == ()
    assert new.selected == ("g",)
    assert new.vanished == ("f",)
    assert new.sentence == "new: g (f no longer matters)"
    assert result.to_dict()["screenings"][1]["vanished"] == ["f"]


def test_integers_and_words_reach_the_model_as_they_are():
    space = Space(
        [
            Parameter("n", kind="integer", lower=0, upper=5),
            Parameter("c", kind="categorical", levels=("x", "y")),
        ]
    )
    result = re_evaluate(
        lambda x, u: [1.0] * u["n"] and u["c"].count("x") + u["n"], {"a": {}}, space, samples=20
    )
    assert {type(row["n"]) for row in result.scenarios} == {int}


def test_runs_that_went_astray_do_not_overflow_the_intervals():
    result = re_evaluate(  # a combination: a response of that size is a failed run
        lambda x, u: {"y": 1e140 * u["f"]},
        DESIGNS,
        U,
        samples=20,
        response=lambda outputs: 1e60 * outputs["y"],
    )
    low, high = result.summaries[0].mean_interval
    assert 0 < low < 0.5e200 < high < 1e200


def test_the_document_names_its_response():
    result = re_evaluate(lambda x, u: {"peak": u["f"]}, {"a": {}}, U, samples=20, response="peak")
    assert result.to_dict()["response"] == "peak"
    assert result.to_dict()["screenings"] == []


def test_screening_more_than_was_drawn_is_refused():
    with pytest.raises(StudyError, match="screened needs 0 or 10 to samples=20, got 30"):
        re_evaluate(response, DESIGNS, U, samples=20, screened=30)
