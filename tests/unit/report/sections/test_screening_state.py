"""The verdict of a screening on the first screen, in the first line and in the findings."""

import json
import re

import pytest

from tests.sample_campaign import write_sample
from workbench.report.lines.screening import screening_lines
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.answers import answer_cards
from workbench.report.sections.findings import _drivers
from workbench.report.sections.screening import screening_section

STATES = {
    "resolved": ("Resolved, down to 0.4 % of the variance.", 0.004, "good"),
    "partly resolved": ("Partly resolved, down to 3.4 % of the variance.", 0.034, "fair"),
    "not resolved": ("Not resolved.", 0.6, "poor"),
}


@pytest.fixture(params=STATES)
def judged(request, tmp_path):
    """A campaign's folder whose screening has one of the states."""
    path = write_sample(tmp_path / "sample.holdfast", q2=0.95)
    file = path / "screening.json"
    document = json.loads(file.read_text()) | {
        "state": request.param,
        "hidden_share": STATES[request.param][1],
    }
    file.write_text(json.dumps(document))
    return (
        request.param,
        CampaignFolder.opened(
            path, documents=["design", "screening", "worst_case", "layout", "robust", "robust_layout"]
        ),
        document,
    )


def test_the_state_stands_on_the_first_screen_and_nothing_green_over_it(judged):
    state, folder, _ = judged
    cards = answer_cards(folder)
    (card,) = [c for c in cards if c.section == "screening"]
    sentence, _, level = STATES[state]
    assert card.detail.startswith(sentence)
    assert card.level == level
    assert screening_section(folder).blocks[0].level == level
    (trust,) = [c for c in cards if c.section == "fit"]
    assert (trust.level == "good") == (state == "resolved")
    if state == "not resolved":
        assert cards[0] is card
        assert "is not resolved" in trust.detail


def test_the_state_stands_in_the_first_line(judged):
    state, _, document = judged
    first = screening_lines(document)[0]
    assert first.startswith("Screening of y [kN]: " + state)
    assert first.endswith("(forward)")


def test_no_effect_is_denied_where_one_may_hide(judged):
    state, folder, _ = judged
    (text,) = _drivers(folder)
    said = {
        "resolved": "Of the variance less than 0.4 % is due to any of",
        "partly resolved": "Effects of up to 3.4 % of the variance may hide in",
        "not resolved": "effects may hide in",
    }[state]
    assert said in text
    assert "No effect" not in text


def test_an_open_parameter_is_named_beside_the_drivers_with_the_most_it_can_do(judged):
    _, folder, document = judged
    names = document["selected"][:2]
    diagnosis = {**document["diagnosis"], "open": names, "open_share": 0.215}
    (folder.path / "screening.json").write_text(json.dumps({**document, "diagnosis": diagnosis}))
    again = CampaignFolder.opened(folder.path, documents=folder.documents)
    said = f"Whether {' and '.join(names)} act is open: each at most 22 % of the variance."
    (card,) = [c for c in answer_cards(again) if c.section == "screening"]
    assert said in card.detail
    assert said in _drivers(again)[0]
    assert "is open" not in _drivers(folder)[0]


def test_a_parameter_at_the_border_of_the_list_is_named_beside_the_drivers(judged):
    _, folder, document = judged
    name = document["selected"][-1]
    diagnosis = {**document["diagnosis"], "border": [name]}
    (folder.path / "screening.json").write_text(json.dumps({**document, "diagnosis": diagnosis}))
    again = CampaignFolder.opened(folder.path, documents=folder.documents)
    said = f"{name} lies at the border of 1 % of the variance: listed, or not, by chance."
    (card,) = [c for c in answer_cards(again) if c.section == "screening"]
    assert said in card.detail
    assert said in _drivers(again)[0]
    assert "at the border" not in _drivers(folder)[0]


def test_parameters_listed_apart_are_neither_drivers_nor_denied(judged):
    _, folder, document = judged
    rest = [name for name in document["ranking"] if name not in document["selected"]]
    changed = {**document, "minor": rest[:1]}
    (folder.path / "screening.json").write_text(json.dumps(changed))
    again = CampaignFolder.opened(folder.path, documents=folder.documents)
    said = f"Listed apart, estimated below 1 % of the variance: {rest[0]}."
    (card,) = [c for c in answer_cards(again) if c.section == "screening"]
    assert said in card.detail
    (text,) = _drivers(again)
    assert said in text
    assert rest[0] not in re.findall(r"\w+", text.split(said)[1])
    assert said in screening_section(again).sentences
    assert f"acts, below 1 % of the variance: {rest[0]}" in screening_lines(changed)


def changed_folder(folder, document, **changes):
    (folder.path / "screening.json").write_text(json.dumps({**document, **changes}))
    return CampaignFolder.opened(folder.path, documents=folder.documents)


def test_nothing_found_is_no_sign_that_nothing_acts(judged):
    state, folder, document = judged
    again = changed_folder(folder, document, selected=[], advice="add runs (twice as many); look again")
    total = len(document["ranking"])
    (card,) = [c for c in answer_cards(again) if c.section == "screening"]
    section = screening_section(again)
    if state == "not resolved":
        assert card.answer == f"not known: none of {total} stands out from noise"
        assert "That is no sign that none acts." in card.detail
        assert card.detail.endswith("To do: add runs (twice as many).")
        assert section.sentences[0].endswith("which matter is not known.")
        assert _drivers(again)[0].startswith(f"None of {total} uncertain parameters stands out from noise")
    else:
        assert card.answer == f"0 of {total}: none"
        assert section.sentences[0].startswith(f"Of {total} parameters 0 matter for y")


def test_parameters_matter_only_as_far_as_the_verdict_says(judged):
    state, folder, document = judged
    said = screening_section(folder).sentences[0]
    assert ("stand out for" if state == "not resolved" else "matter for") in said
    alone = changed_folder(folder, document, selected=document["selected"][:1])
    assert ("1 stands out for" in screening_section(alone).sentences[0]) == (state == "not resolved")


def test_the_card_says_by_which_scale(judged):
    _, folder, document = judged
    scale = "a power of the response (Box-Cox) (left unexplained of left-out runs: none 9 %, box-cox 1 %)"
    (card,) = [
        c for c in answer_cards(changed_folder(folder, document, scale=scale)) if c.section == "screening"
    ]
    assert "Screened by a power of the response (Box-Cox). " in card.detail
