"""The cards of the first screen: none is green over an open loop, a search alone or a worse run."""

import json
import re

import pytest

from tests.sample_campaign import write_loop, write_sample
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.answers import answer_cards, question
from workbench.report.worst_case.section import worst_case_section
from workbench.report.worst_case.worse_runs import worse_run

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


def test_a_study_without_a_screening_does_not_ask_which_parameters_drive_it(tmp_path):
    path = write_sample(tmp_path / "sample.holdfast")
    asked = CampaignFolder.opened(path, documents=DOCUMENTS)
    assert question(asked).startswith("Which of the ")
    assert "drive y, and how large can it get?" in question(asked)
    (table,) = [b for b in worst_case_section(asked).blocks if getattr(b, "id", "") == "worst-case"]
    assert table.columns[-1].name == "selected by screening"
    (path / "screening.json").unlink()
    plain = CampaignFolder.opened(path, documents=DOCUMENTS)
    plain.lock.get("resolved", {}).pop("screen", None)
    count = len(plain.parameters)
    assert question(plain) == f"How large can y get over the {count} uncertain parameters?"
    (table,) = [b for b in worst_case_section(plain).blocks if getattr(b, "id", "") == "worst-case"]
    assert [column.name for column in table.columns][-1] == "place in its range"
    assert all(len(row) == len(table.columns) for row in table.rows)
    plain.documents["worst_case"] = None
    assert question(plain) == f"What do the {count} uncertain parameters do to y?"
    plain.lock.setdefault("resolved", {})["screen"] = {"response": "y"}
    assert question(plain) == f"Which of the {count} uncertain parameters drive y?"


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


def test_the_green_card_of_a_closed_loop_says_how_it_was_attacked(tmp_path):
    said = "1516 true runs of an adversary found nothing more than 0.4 % above the bound: the loop is closed."
    closed = {**OPEN, "closed": True, "verdict": "green", "status": said}
    after, _ = cards_with(tmp_path / "closed", loop=closed)
    still, _ = cards_with(tmp_path / "open", loop={**OPEN, "status": said})
    assert after["robust"].detail.endswith(said.replace(" %", "\N{NO-BREAK SPACE}%"))
    assert "true runs of an adversary" not in still["robust"].detail


@pytest.mark.parametrize(
    ("grade", "level"), [("proved", "good"), ("attacked", "good"), ("searched", "plain")]
)
def test_a_worst_case_is_green_by_proof_or_attack_alone(tmp_path, grade, level):
    cards, _ = cards_with(tmp_path, grade=grade, grade_sentence=f"{grade.capitalize()}: so it is.")
    assert cards["worst-case"].level == level
    assert f"{grade.capitalize()}: so it is." in cards["worst-case"].detail


@pytest.mark.parametrize(("factor", "is_beyond"), [(1.02, True), (1 + 1e-13, False), (0.98, False)])
def test_a_worse_run_of_the_loop_without_layout_is_named(tmp_path, factor, is_beyond):
    value = cards_with(tmp_path / "first")[1]["value"]
    bare = {"verdict": "green", "layouts": {"none": {"worst": factor * value}}}
    cards, _ = cards_with(tmp_path / "second", loop=bare, grade="attacked")
    assert ("without a layout went to" in cards["worst-case"].detail) == is_beyond
    assert cards["worst-case"].level == ("fair" if is_beyond else "good")


def opened(tmp_path, **documents):
    """A sample folder whose documents are changed by functions of themselves."""
    path = write_sample(tmp_path / "sample.holdfast", q2=0.95)
    write_loop(path)
    for name, change in documents.items():
        place = path / f"{name}.json"
        document = json.loads(place.read_text())
        change(document)
        place.write_text(json.dumps(document))
    return CampaignFolder.opened(path, documents=DOCUMENTS)


def card_of(folder, section):
    return next(card for card in answer_cards(folder) if card.section == section)


@pytest.mark.parametrize("sense", ["max", "min"])
def test_a_worse_run_of_a_later_stage_is_named_and_takes_the_green_away(tmp_path, sense):
    def milder(worst):
        worst |= {"sense": sense, "value": 0.0, "grade": "attacked", "border": None}

    folder = opened(tmp_path, worst_case=milder)
    values = folder.runs.values("y")[folder.runs.with_status("ok")]
    value, key = worse_run(folder, folder["worst_case"])
    assert value == (values.max() if sense == "max" else values.min())
    card = card_of(folder, "worst-case")
    assert f"A run that came after the search went to {value:.4g}"[:44] in card.detail
    assert folder.run_name(key) in card.detail
    assert card.level == "fair"


def test_a_worst_case_that_no_run_goes_beyond_stays_green(tmp_path):
    folder = opened(tmp_path, worst_case=lambda worst: worst.update(value=1e6, grade="attacked"))
    assert worse_run(folder, folder["worst_case"]) is None
    assert card_of(folder, "worst-case").level == "good"


def test_runs_outside_the_bounds_or_the_limits_and_noisy_ones_are_no_worse_runs(tmp_path):
    mild = opened(tmp_path / "mild", worst_case=lambda worst: worst.update(value=0.0))
    assert worse_run(mild, mild["worst_case"]) is not None
    assert worse_run(mild, {**mild["worst_case"], "mean": 0.0}) is None
    held = {**mild["worst_case"], "within": {"y": [None, 0.0]}}
    assert worse_run(mild, held) is None

    def narrow(lock):
        for parameter in lock["resolved"]["parameter"]:
            parameter |= {"lower": 0.49, "upper": 0.5}

    narrowed = opened(
        tmp_path / "narrow", worst_case=lambda worst: worst.update(value=0.0), **{"study.lock": narrow}
    )
    assert worse_run(narrowed, narrowed["worst_case"]) is None


def test_a_worst_case_at_a_border_of_failures_is_not_green(tmp_path):
    def borders(worst):
        said = {"borders": True, "is_answer": False, "sentence": "It borders on failures."}
        worst |= {"value": 1e6, "grade": "attacked", "border": said}

    assert card_of(opened(tmp_path, worst_case=borders), "worst-case").level == "plain"


def test_a_failed_run_that_is_the_worst_case_is_named_with_its_place(tmp_path):
    def fails(worst):
        ends = {name: value if isinstance(value, str) else 0.0 for name, value in worst["parameters"].items()}
        key = worst["history"][0]["run_key"]
        said = {"is_answer": True, "sentence": "The worst case fails.", "parameters": ends, "run_key": key}
        worst |= {"value": 1e6, "border": said}

    folder = opened(tmp_path, worst_case=fails)
    border = folder["worst_case"]["border"]
    name = folder.run_name(border["run_key"])
    card = card_of(folder, "worst-case")
    assert card.answer.startswith(f"{name.capitalize()} fails; of the others: ")
    assert card.level == "fair"
    confirming = folder.run_name(folder["worst_case"]["run_key"])
    assert f"The worst that gave a value: {confirming}, after " in card.detail
    assert "Confirmed" not in card.detail
    section = worst_case_section(folder)
    assert section.sentences[0] == f"The worst case is {name}, which failed; the table shows where it lies."
    assert " of the runs that gave a value is " in section.sentences[1]
    place = section.blocks[0]
    assert [c.name for c in place.columns][1:3] == ["the failed run", "the worst that gave a value"]
    rows = {row[0]: row[1:3] for row in place.rows}
    own = folder["worst_case"]["parameters"]
    assert rows == {name: (border["parameters"][name], own[name]) for name in rows}
    (ranked,) = [block for block in section.blocks if getattr(block, "id", "") == "worst-runs"]
    notes = {row[2] for row in ranked.rows}
    assert notes == {"", "the worst that gave a value"}
    assert "confirming run" not in str(section.blocks)


def test_a_worst_case_that_was_known_before_the_search_is_said_to_be(tmp_path):
    def known(worst):
        given = next(h for h in worst["history"] if h["run_key"] == worst["run_key"])
        given["iteration"] = 0

    detail = card_of(opened(tmp_path / "a", worst_case=known), "worst-case").detail
    assert re.search(r"^Confirmed by a true run: .*, known before the \d+ runs of the search\.", detail)
    found = card_of(opened(tmp_path / "b"), "worst-case").detail
    assert re.search(r"^Confirmed by a true run: .*, after \d+ runs of the search\.", found)


@pytest.mark.parametrize(("share", "level"), [(0.0, "good"), (0.01, "fair")])
def test_designs_that_exceed_their_limit_do_not_hold(tmp_path, share, level):
    def beyond(robust):
        robust["left_out"] = 0
        robust["summaries"][-1]["beyond_limit"] = [share, 0.0, 0.1]

    assert card_of(opened(tmp_path, robust=beyond), "robust").level == level


def test_the_worst_of_a_design_is_that_of_all_its_runs(tmp_path):
    def hidden(robust):
        robust["summaries"][-1]["worst_run"] = 999.0  # where the other design gave no value

    card = card_of(opened(tmp_path, robust=hidden), "robust")
    assert card.answer.startswith("after: 999")
    assert card.level == "poor"


@pytest.mark.parametrize(("upper", "holds"), [(0.1, False), (1e6, True)])
def test_a_bound_that_a_later_run_broke_is_not_said(tmp_path, upper, holds):
    def bounded(worst):
        worst |= {"value": 0.0, "gap": {"upper": upper, "sentence": "At most so much worse."}}

    folder = opened(tmp_path, worst_case=bounded)
    section = worst_case_section(folder).sentences
    assert any(said.startswith("A run that came after the search went to ") for said in section)
    for said in (" ".join(section), card_of(folder, "worst-case").detail):
        assert ("At most so much worse." in said) == holds
        assert ("stated by the search, does not hold." in said) != holds


@pytest.mark.parametrize(("failures", "said"), [(3, "3 gave no value, and where they lie"), (1, "1 gave no")])
def test_the_card_of_the_runs_says_how_many_gave_no_value_and_where_that_is_told(tmp_path, failures, said):
    path = write_sample(tmp_path / "sample.holdfast", failures=failures)
    (card,) = [
        c for c in answer_cards(CampaignFolder.opened(path, documents=DOCUMENTS)) if c.section == "runs"
    ]
    assert card.answer == f"48 runs, {failures} without a value"
    assert card.detail.startswith(f'The section "What ran" says why {said}')
    assert "further true runs" not in card.detail


def test_the_card_of_the_runs_counts_those_of_a_loop_apart(tmp_path):
    cards, _ = cards_with(tmp_path, loop={**OPEN, "runs": {"ok": 7780, "timeout": 5}})
    assert cards["runs"].detail.endswith("The robust loop made 7785 further true runs, of layouts.")


@pytest.mark.parametrize(("selected", "said"), [(19, "The other one was not"), (18, "The other 2 were not")])
def test_what_was_not_selected_is_counted_in_a_sentence(tmp_path, selected, said):
    path = write_sample(tmp_path / "sample.holdfast", q2=0.95)
    screening = json.loads((path / "screening.json").read_text())
    screening |= {"selected": screening["ranking"][:selected], "minor": []}
    (path / "screening.json").write_text(json.dumps(screening))
    cards = answer_cards(CampaignFolder.opened(path, documents=DOCUMENTS))
    assert any(f"{said} selected." in card.detail for card in cards)
