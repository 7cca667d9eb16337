"""What contradicts itself or a known run is refused before it is written."""

import pytest

from workbench.report.claims import (
    Claim,
    Contradiction,
    known_values,
    refuse_contradictions,
    robust_claims,
    robust_layout_claims,
    worst_case_claims,
)
from workbench.search.evidence.attack.share import counted_share

WORST = {
    "response": "y", "unit": "m", "sense": "max", "value": 2.0, "confirmed": True, "run_key": "b",
    "evaluations": 1, "failures": {"failed": 1},
    "history": [
        {"run_key": "b", "iteration": 0, "status": "ok", "value": 2.0, "best": 2.0},
        {"run_key": "d", "iteration": 1, "status": "failed", "value": None, "best": 2.0},
    ],
}  # fmt: skip
LOOP = {
    "unit": "m", "attack": {"runs": 1500}, "tolerance": 0.02, "bound": 1.0, "worst": 1.015, "closed": True,
    "verdict": "green", "reasons": [], "broken_by_samples": False,
    "other_starts": {"worst": 1.01, "apart": 0.01, "agrees": True, "starts": ["second start"]},
    "optimiser": {"converged": False, "kkt": 0.01, "allowed": 0.02},
    "layouts": {
        "robust": {"values": [1.0, 0.4], "worst": 1.015}, "uniform": {"values": [1.2, None], "worst": 1.2},
    },
    "robust": "robust",
    "rounds": [{"bound": 0.8, "worst": 1.0, "gap": 0.25}, {"bound": 1.0, "worst": 0.9, "gap": 0.0}],
}  # fmt: skip


def claim(**changes):
    (found,) = worst_case_claims({**WORST, **changes}, is_runnable=True)
    return found


@pytest.mark.parametrize(("sense", "beyond"), [("max", 2.1), ("min", 1.9)])
def test_a_known_run_beyond_the_worst_case_is_refused(sense, beyond):
    said = claim(sense=sense)
    refuse_contradictions(said, [("a", 2.0), ("b", 4.0 - beyond)])
    with pytest.raises(Contradiction, match=f"2 m by a run, is not written: the known run c gave {beyond}"):
        refuse_contradictions(said, [("a", 2.0), ("c", beyond)])


def test_a_value_without_a_unit_is_told_without_one():
    with pytest.raises(
        Contradiction, match=r"y, 2 by a run, is not written: the known run c gave 3\. Please"
    ):
        refuse_contradictions(claim(unit="1"), [("c", 3.0)])


def test_values_that_differ_little_are_told_apart():
    said = Claim(subject="the worst case of y", value=1e9, unit="m", sense="max", kind="run")
    with pytest.raises(Contradiction, match=r"y, 1000000000 m by a run, .* run c gave 1000000001.5 m"):
        refuse_contradictions(said, [("c", 1e9 + 1.5)])


@pytest.mark.parametrize(("sense", "wrong"), [("max", 1.9), ("min", 2.1)])
def test_a_bound_on_the_wrong_side_is_refused(sense, wrong):
    refuse_contradictions(claim(sense=sense, gap={"upper": 2.0}), [])
    refuse_contradictions(claim(sense=sense, gap={"upper": None}), [])
    with pytest.raises(Contradiction, match=f"its bound {wrong} lies on the wrong side"):
        refuse_contradictions(claim(sense=sense, gap={"upper": wrong}), [])


ATTACKED = {
    "grade": "attacked",
    "attack": {
        "runs": 300, "excess": 0.0, "largest": 1.9, "climbs": 5, "arrived": 3,
        "share": counted_share(0, 75).to_dict(), "failing": counted_share(2, 75).to_dict(),
    },
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (None, "called attacked without a run of an attack"),
        ({"runs": 0}, "called attacked without a run of an attack"),
        ({"excess": 0.2, "largest": 2.2}, "called attacked although its attack found 2.2"),
        ({"arrived": 1}, "called attacked although 1 of 5 climbs arrived there"),
        (
            {"share": {**counted_share(0, 75).to_dict(), "high": 0.01}},
            "its attack share says 0 to 0.01 where 0 of 75 make 0 to 0.0392",
        ),
        ({"failing": {**counted_share(2, 75).to_dict(), "hits": 3}}, "its attack failing says"),
    ],
)
def test_what_an_attacked_worst_case_may_not_say(changes, said):
    refuse_contradictions(claim(**ATTACKED), [])
    attack = None if changes is None else {**ATTACKED["attack"], **changes}
    wrong = claim(grade="attacked", attack=attack)
    with pytest.raises(Contradiction, match=said):
        refuse_contradictions(wrong, [])


def test_a_searched_worst_case_may_have_an_attack_that_does_not_count():
    refuse_contradictions(claim(grade="searched", attack={**ATTACKED["attack"], "arrived": 0}), [])


def test_every_response_of_a_search_makes_a_claim():
    document = {**WORST, "others": [{**WORST, "response": "z", "confirmed": False, "sense": "min"}]}
    first, second = worst_case_claims(document, is_runnable=False)
    assert (first.kind, second.kind) == ("run", "prediction")
    assert second.subject == "the worst case of z"


def test_rounding_is_no_contradiction():
    refuse_contradictions(claim(), [("a", 2.0 * (1 + 1e-12))])
    assert claim().beyond(2.0) < 0 < claim().beyond(2.0 + 1e-6)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"attack": None}, "called closed without an attack that it withstood"),
        (
            {"worst": 1.03, "layouts": {"robust": {"values": [1.0], "worst": 1.03}}},
            "called closed without an attack that it withstood",
        ),
        ({"attack": {"share": {"hits": 1, "draws": 9, "low": 0.0, "high": 0.1}}}, "its attack share says"),
        ({"reasons": ["starts disagree"]}, "its verdict is green although starts disagree"),
        ({"broken_by_samples": True}, "closed although a sample of the uncertainty lies beyond its bound"),
        ({"closed": False}, "its verdict is green although its loop is not closed"),
        ({"other_starts": None}, "its verdict is green although no other start was tried"),
        (
            {"other_starts": {"agrees": False, "apart": 0.08}},
            "its verdict is green although other starts came no nearer to it than 8 %",
        ),
        (
            {"other_starts": {"agrees": True, "apart": 0.08}},
            "its verdict is green although other starts came no nearer to it than 8 %",
        ),
        (
            {"optimiser": {"converged": False, "kkt": 0.3, "allowed": 0.02}},
            "green although its optimiser stopped at its limit before the first-order condition held",
        ),
        (
            {"optimiser": {"converged": True, "kkt": None, "allowed": 0.02}},
            "green although its optimiser ended before the first-order condition held",
        ),
        (
            {"layouts": {**LOOP["layouts"], "uniform": {"values": [0.9, 0.8], "worst": 0.9}}},
            "the layout 'uniform' is better over the cases",
        ),
        (
            {"rounds": [{"bound": 0.8, "worst": 1.0, "gap": 0.2}]},
            "round 1 says a gap of 20 % where 1 instead of 0.8 is 25 %",
        ),
        (
            {"layouts": {**LOOP["layouts"], "uniform": {"values": [1.3, None], "worst": 1.2}}},
            "the layout 'uniform' reached 1.3 where its worst is called 1.2",
        ),
        ({"worst": 1.01}, "its layout 'robust' has a worst case of 1.015 in the table"),
    ],
)
def test_what_a_robust_layout_may_not_say(changes, said):
    (fine,) = robust_layout_claims(LOOP)
    refuse_contradictions(fine, [("a", 1.01)])
    (wrong,) = robust_layout_claims({**LOOP, **changes})
    with pytest.raises(Contradiction, match=said):
        refuse_contradictions(wrong, [])
    assert isinstance(wrong, Claim)


def test_an_amber_verdict_may_have_what_a_green_one_may_not():
    doubts = {"verdict": "amber", "reasons": ["starts disagree"], "closed": False, "other_starts": None}
    refuse_contradictions(*robust_layout_claims({**LOOP, **doubts}), [])


def test_a_prediction_has_no_place_where_the_model_can_be_run():
    predicted = {**WORST, "confirmed": False, "run_key": ""}
    (of_a_table,) = worst_case_claims(predicted, is_runnable=False)
    refuse_contradictions(of_a_table, [("a", 1.9)])
    (wrong,) = worst_case_claims(predicted, is_runnable=True)
    with pytest.raises(Contradiction, match="by a prediction, is not written: the model can be run there"):
        refuse_contradictions(wrong, [])
    (wrong,) = worst_case_claims({**predicted, **ATTACKED}, is_runnable=False)
    with pytest.raises(Contradiction, match="it is called attacked without a run"):
        refuse_contradictions(wrong, [])


COMPARED = {
    "designs": ["a", "b"], "sense": "max", "unit": "m", "limit": 2.0, "drawn": 4, "left_out": 1,
    "values": {"a": [1.0, 2.5, 3.0, None, 9.0], "b": [1.0, 1.5, 2.0, 4.0, 1.0]},
    "paired": {"b - a": [-2 / 3, -1.3, 0.0]},
    "summaries": [
        {
            "design": "a", "worst_run": 9.0, "beyond_limit": [2 / 3, 0.2, 0.9], "mean": 6.5 / 3, "worst": 9.0,
            "largest_regret": 8.0, "mean_regret": 2.5, "failed": 1, "failed_share": [0.25, 0.1, 0.7],
            "quantiles": {"P5": [1.15, None, 2.5], "P50": [2.5, None, None], "P95": [2.95, 1.0, None]},
            "beyond_or_failed": [0.75, 0.3, 0.9], "nominal": 1.2, "price_of_robustness": 0.2,
        },
        {
            "design": "b", "worst_run": 4.0, "beyond_limit": [0.0, 0.0, 0.6], "mean": 1.5, "worst": 2.0,
            "largest_regret": 0.0, "mean_regret": 0.0, "failed": 0, "failed_share": [0.0, 0.0, 0.5],
            "quantiles": {"P5": [1.05, None, 1.5], "P50": [1.5, None, None], "P95": [1.95, 1.0, None]},
            "beyond_or_failed": [0.25, 0.1, 0.7], "nominal": 1.0, "price_of_robustness": 0.0,
        },
    ],
}  # fmt: skip


def changed(**numbers):
    """The comparison with other numbers of its first design."""
    first, second = COMPARED["summaries"]
    return {**COMPARED, "summaries": [{**first, **numbers}, second]}


def test_designs_claim_the_worst_of_all_their_runs():
    first, second = robust_claims(COMPARED)
    refuse_contradictions(first, known_values(COMPARED, "a"))
    refuse_contradictions(second, known_values(COMPARED, "b"))
    mild = changed(worst_run=3.0)
    with pytest.raises(Contradiction, match=r"design 'a', 3 m by a run, .* run in scenario 5 gave 9 m"):
        refuse_contradictions(robust_claims(mild)[0], known_values(mild, "a"))


@pytest.mark.parametrize(
    ("share", "said"),
    [
        ([1 / 3, 0.2, 0.9], "33.3 % are said to lie beyond 2 where 2 of 3 do"),
        ([2 / 3, 0.7, 0.9], "its share 0.667 lies outside of its interval 0.7 to 0.9"),
    ],
)
def test_a_share_beyond_the_limit_is_that_of_the_values(share, said):
    wrong = changed(beyond_limit=share)
    with pytest.raises(Contradiction, match=said):
        refuse_contradictions(robust_claims(wrong)[0], [])


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        ({"mean": 2.2}, "its mean is said to be 2.2 where its values make 2.16667"),
        ({"worst": 3.0}, "its worst value met is said to be 3 where its values make 9"),
        ({"largest_regret": 1.0}, "its largest regret is said to be 1 where its values make 8"),
        ({"mean_regret": 1.0}, "its mean regret is said to be 1 where its values make 2.5"),
        ({"failed": 0}, "its number of failures is said to be 0 where its values make 1"),
        (
            {"failed_share": [0.5, 0.1, 0.7]},
            "its share of failures is said to be 0.5 where its values make 0.25",
        ),
        (
            {"beyond_or_failed": [0.5, 0.3, 0.9]},
            "beyond the limit or failed is said to be 0.5 where .* make 0.75",
        ),
        ({"price_of_robustness": 0.0}, "its price of robustness is said to be 0 where its values make 0.2"),
        (
            {"quantiles": {**COMPARED["summaries"][0]["quantiles"], "P95": [2.9, 1.0, None]}},
            "its quantile P95 is said to be 2.9 where its values make 2.95",
        ),
    ],
)
def test_a_number_of_a_design_is_that_of_its_values(numbers, said):
    with pytest.raises(Contradiction, match=said):
        refuse_contradictions(robust_claims(changed(**numbers))[0], [])


def test_differences_and_scenarios_left_out_are_those_of_the_values():
    apart = robust_claims({**COMPARED, "paired": {"b - a": [0.1, 0.0, 0.2]}})[1]
    with pytest.raises(
        Contradiction, match=r"mean difference to 'a' is said to be 0\.1 where .* make -0\.666667"
    ):
        refuse_contradictions(apart, [])
    with pytest.raises(Contradiction, match="0 scenarios are said to be left out where 1 are"):
        refuse_contradictions(robust_claims({**COMPARED, "left_out": 0})[0], [])


LOOK = {"runs": 1, "upper": 2.4}


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"evaluations": 2}, "2 runs are said to have been made where 1 are listed"),
        ({"failures": {}}, r"its runs without a value are {} and the list has {'failed': 1}"),
        ({"run_key": "c"}, "no run of that key and value is listed"),
        ({"value": 2.1}, "no run of that key and value is listed"),
        ({"mean": 2.0, "interval": [2.1, 2.2]}, "its mean lies outside of its interval"),
        ({"gap_history": [{**LOOK, "upper": 1.9}]}, "after 1 runs the bound 1.9 stood below a run, 2"),
        (
            {"gap_history": [LOOK, {"runs": 2, "upper": 2.3}], "gap": {"upper": 2.2}},
            "its gaps end at the bound 2.3 and 2.2 is stated",
        ),
    ],
)
def test_a_worst_case_is_that_of_its_own_list_of_runs(changes, said):
    looks = [LOOK, {"runs": 2, "upper": 2.2}]
    refuse_contradictions(claim(gap_history=looks, gap={"upper": 2.2}), [])
    with pytest.raises(Contradiction, match=said):
        refuse_contradictions(claim(**changes), [])


def test_what_withstood_an_attack_may_stand_above_the_best_by_less_than_half_of_the_tolerance():
    better = {**LOOP["layouts"], "round 3": {"values": [0.992, None], "worst": 1.0}}
    refuse_contradictions(*robust_layout_claims({**LOOP, "layouts": better}), [])
    unattacked = {"attack": None, "closed": False, "verdict": "amber", "reasons": ["no attack"]}
    broken = {"worst": 1.2, "closed": False, "verdict": "amber", "reasons": ["broken"]}
    for doubts in (unattacked, broken):
        (wrong,) = robust_layout_claims({**LOOP, **doubts, "layouts": better})
        with pytest.raises(Contradiction, match="the layout 'round 3' is better over the cases known"):
            refuse_contradictions(wrong, [])


def test_what_withstood_an_attack_may_not_stand_further_above_the_best():
    better = {**LOOP["layouts"], "round 3": {"values": [0.985, None], "worst": 1.0}}
    with pytest.raises(Contradiction, match="the layout 'round 3' is better over the cases known"):
        refuse_contradictions(*robust_layout_claims({**LOOP, "layouts": better}), [])
