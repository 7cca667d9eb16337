"""The cards of the first screen: none is green over an open loop, a search alone or a worse run."""

import json

import pytest

from tests.sample_campaign import write_loop, write_sample
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.answers import answer_cards

DOCUMENTS = ["design", "screening", "worst_case", "layout", "robust", "robust_layout"]
OPEN = {"closed": False, "verdict": "amber", "reasons": ["the loop is not closed"], "may_exceed": 0.043}


def cards_with(tmp_path, *, loop=None, **of_the_worst):
    path = write_sample(tmp_path / "sample.holdfast", q2=0.95)
    write_loop(path)
    worst = json.loads((path / "worst_case.json").read_text()) | of_the_worst
    (path / "worst_case.json").write_text(json.dumps(worst))
    if loop is not None:
        kept = {"response": worst["response"], "layouts": {}, **loop}
        (path / "robust_layout.json").write_text(json.dumps(kept))
    found = answer_cards(CampaignFolder.opened(path, documents=DOCUMENTS))
    return {card.section: card for card in found}, worst


def test_no_card_on_a_layout_is_green_over_an_open_loop(tmp_path):
    before, _ = cards_with(tmp_path / "without")
    after, _ = cards_with(tmp_path / "open", loop=OPEN)
    closed, _ = cards_with(tmp_path / "closed", loop={**OPEN, "closed": True, "verdict": "green"})
    assert before["layout"].level == "good"
    for section in ("layout", "robust"):
        assert before[section] == closed[section]
        assert after[section].level == "fair"
        assert after[section].detail.startswith(before[section].detail)
        assert (
            "But the loop is not closed. Another attack may find 4.3\N{NO-BREAK SPACE}% more."
            in after[section].detail
        )


@pytest.mark.parametrize(
    ("grade", "level"), [("proved", "good"), ("attacked", "good"), ("searched", "plain")]
)
def test_a_worst_case_is_green_by_proof_or_attack_alone(tmp_path, grade, level):
    cards, _ = cards_with(tmp_path, grade=grade, grade_sentence=f"{grade.capitalize()}: so it is.")
    assert cards["worst-case"].level == level
    assert f"{grade.capitalize()}: so it is." in cards["worst-case"].detail


@pytest.mark.parametrize(("factor", "is_beyond"), [(1.02, True), (0.98, False)])
def test_a_worse_run_of_the_loop_without_layout_is_named(tmp_path, factor, is_beyond):
    value = cards_with(tmp_path / "first")[1]["value"]
    bare = {"verdict": "green", "layouts": {"none": {"worst": factor * value}}}
    cards, _ = cards_with(tmp_path / "second", loop=bare, grade="attacked")
    assert ("without a layout went to" in cards["worst-case"].detail) == is_beyond
    assert cards["worst-case"].level == ("fair" if is_beyond else "good")
