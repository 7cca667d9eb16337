"""The report of a made-up campaign: what it says, that it is one file, and always the same file."""

import csv
import html
import json
import re
from html.parser import HTMLParser

import numpy as np
import pytest

from tests.browser import needs_browser, visit
from tests.sample_campaign import PATH, RUNS, SELECTED, write_sample
from workbench.errors import StoreError, StudyError
from workbench.report.writing import report_numbers, write_report
from workbench.system.database import connected

WORST_RUN = "002e" * 8


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = write_sample(tmp_path_factory.mktemp("report") / "sample.holdfast")
    write_report(folder)
    return folder


@pytest.fixture
def undrawn(monkeypatch):
    """Drawing is the slow part; tests of words and tables leave it out."""
    monkeypatch.setattr("workbench.report.page.html.draw_svg", lambda draw, **options: "<svg></svg>")


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text()


class Outline(HTMLParser):
    """Open elements balance; ids, links and attributes are collected."""

    VOID = {"meta", "link", "br", "hr", "img", "input", "path", "use"}

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.links, self.styled, self.text = [], [], [], [], []

    def handle_starttag(self, tag, attrs):
        attrs = dict(attrs)
        if "id" in attrs:
            self.ids.append(attrs["id"])
        self.links += [v for k, v in attrs.items() if k in ("href", "src", "xlink:href", "action")]
        if "style" in attrs or any(k.startswith("on") for k in attrs):
            self.styled.append((tag, attrs))
        if tag not in self.VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in self.VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        if tag not in self.VOID:
            assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


@pytest.fixture(scope="module")
def outline(page):
    parser = Outline()
    parser.feed(page)
    assert parser.open == []
    return parser


def test_nothing_is_asked_from_anywhere(page, outline):
    assert outline.links
    assert all(link.startswith("#") for link in outline.links)
    assert not re.search(r"@import|url\((?!#)", page)
    assert "default-src 'none'" in html.unescape(page)


def test_ids_are_unique_and_links_lead_somewhere(outline):
    assert len(outline.ids) == len(set(outline.ids))
    assert {link[1:] for link in outline.links} <= set(outline.ids)


def test_the_policy_needs_no_exception_for_styles_or_handlers(page, outline):
    assert outline.styled == []
    assert "unsafe" not in page


@pytest.mark.slow
def test_same_folder_gives_the_same_bytes(folder, page, tmp_path):
    files = ["report.html", "report.md", *(f"tables/{p.name}" for p in (folder / "tables").glob("*.csv"))]
    before = {name: (folder / name).read_bytes() for name in files}
    write_report(folder)
    assert {name: (folder / name).read_bytes() for name in files} == before
    # another place, written anew: still the same page
    assert write_report(write_sample(tmp_path / "elsewhere.holdfast")).read_text() == page


def test_answers_stand_first_in_plain_sentences(outline):
    text = " ".join(" ".join(outline.text).split())
    first = text[: text.index("Where the worst case lies")]
    assert "How large can y get? y = 13.3125 kN" in first
    assert "Confirmed by a true run: run 47 (002e002e00)" in first
    assert "4 of 20: x12, x4, x20 and x19" in first
    assert "It predicts well." in first
    assert "48 runs, 3 without a value" in first


def test_every_figure_has_a_sentence_and_a_table(page):
    figures = re.findall(r"<figure .*?</figure>", page, re.S)
    assert len(figures) >= 10
    for figure in figures:
        label = re.search(r'aria-label="([^"]{25,})"', figure)
        assert label is not None
        assert re.search(r"<figcaption><strong>.+?</strong> .{30,}</figcaption>", figure, re.S)
        assert figure.count("<tr") >= 2
        assert "<svg" in figure


def test_rejected_step_and_confirming_run_are_marked(page):
    path = re.search(r'<figure id="figure-screening-path">.*?</figure>', page, re.S)[0]
    rows = re.findall(r'<tr class="marked">.*?</tr>', path)
    assert len(rows) == 1
    assert PATH[-1][0] in rows[0]
    assert "<pattern" in path  # hatched
    ranked = re.search(r"<caption>The 10 worst true runs.*?</table>", page, re.S)[0]
    assert re.findall(r'<tr class="marked">.*?</tr>', ranked)[0].count("confirms the worst case") == 1


def test_numbers_carry_the_run_keys(folder):
    numbers = report_numbers(folder)
    worst = numbers["sections"]["worst-case"]
    assert (worst["value"], worst["run_key"], worst["confirmed"]) == (13.3125, WORST_RUN, True)
    assert numbers["sections"]["screening"]["selected"] == SELECTED
    assert numbers["sections"]["runs"]["counts"] == {
        "failed": 1,
        "nonfinite": 1,
        "ok": RUNS + 5,
        "timeout": 1,
    }
    json.dumps(numbers, allow_nan=False)


def test_tables_hold_full_precision(folder):
    with (folder / "tables" / "search.csv").open() as file:
        table = list(csv.DictReader(file))
    history = json.loads((folder / "worst_case.json").read_text())["history"]
    for row, h in zip(table, history, strict=True):
        assert row["y [kN]"] == ("" if h["value"] is None else repr(h["value"]))


@pytest.mark.usefixtures("undrawn")
def test_tables_of_an_older_report_go(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    (folder / "tables").mkdir()
    (folder / "tables" / "stale.csv").write_text("x\n")
    write_report(folder)
    assert not (folder / "tables" / "stale.csv").exists()


def test_markdown_says_the_same(folder):
    text = (folder / "report.md").read_text()
    assert text.startswith("# sample\n")
    assert "y = 13.3125 kN" in text
    assert "| **1** | **run 47 (002e002e00)** |" in text


@pytest.mark.usefixtures("undrawn")
def test_a_poor_fit_is_said_in_red_before_the_answers(tmp_path):
    page = write_report(write_sample(tmp_path / "s.holdfast", q2=0.31)).read_text()
    assert page.index('class="banner"') < page.index('class="cards"')
    assert "predicts runs that it has not seen poorly" in page


@pytest.mark.usefixtures("undrawn")
def test_an_unconfirmed_extreme_is_never_called_found(tmp_path):
    page = write_report(write_sample(tmp_path / "s.holdfast", confirmed=False)).read_text()
    assert "Surrogate only, unconfirmed" in page
    assert "nothing was searched" in page
    assert "How it was found" not in page
    assert page.count("runs given is") >= 2  # on the card and in the section: the worst run that exists
    assert "confirmed by a true run" not in page.lower().replace("unconfirmed", "")


@pytest.mark.parametrize(
    ("document", "title", "command"),
    [
        ("screening.json", "Main effects", "holdfast screen"),
        ("worst_case.json", "The worst case", "holdfast worst-case"),
        ("design.json", "The design", "holdfast design"),
        ("runs.sqlite", "What ran", "holdfast run"),
    ],
)
@pytest.mark.usefixtures("undrawn")
def test_a_missing_stage_is_named_with_its_command(tmp_path, document, title, command):
    folder = write_sample(tmp_path / "s.holdfast")
    (folder / document).unlink()
    page = write_report(folder).read_text()
    assert f"<li>{title}: <code>{command}</code> writes it.</li>" in page


@pytest.mark.usefixtures("undrawn")
def test_all_runs_failed(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast", failures=5)
    for name in ("screening.json", "worst_case.json"):
        (folder / name).unlink()
    assert "45 gave a value" not in write_report(folder).read_text()


@pytest.mark.usefixtures("undrawn")
def test_text_from_a_study_cannot_become_markup(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    lock = json.loads((folder / "study.lock.json").read_text())
    lock["resolved"]["study"]["name"] = "<script>alert(1)</script>"
    (folder / "study.lock.json").write_text(json.dumps(lock))
    page = write_report(folder).read_text()
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert(1)" in page


def test_a_folder_that_is_no_campaign(tmp_path):
    with pytest.raises(StudyError, match="is not the folder of a campaign"):
        write_report(tmp_path)


def test_a_document_that_is_not_json(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    (folder / "worst_case.json").write_text("{")
    with pytest.raises(StoreError, match=r"cannot read .*worst_case.json"):
        write_report(folder)
    (folder / "worst_case.json").write_text("[]")
    with pytest.raises(StoreError, match="holds list, not a document"):
        write_report(folder)


def test_a_document_that_lacks_a_key(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    (folder / "worst_case.json").write_text('{"response": "y"}')
    with pytest.raises(StoreError, match=r"'The worst case' cannot be made .* `holdfast worst-case` writes"):
        write_report(folder)


@pytest.mark.usefixtures("undrawn")
def test_documents_about_other_parameters_are_left_out(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    lock = json.loads((folder / "study.lock.json").read_text())
    lock["resolved"]["parameter"][0]["name"] = "renamed"
    (folder / "study.lock.json").write_text(json.dumps(lock))
    write_report(folder)
    page = (folder / "report.md").read_text()
    assert "*The worst case*: not there; `holdfast worst-case` writes it." in page
    assert "*Which parameters matter*: not there" in page


def test_a_database_that_is_none(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    (folder / "runs.sqlite").write_bytes(b"not a database, but long enough to be looked at" * 50)
    with pytest.raises(StoreError, match=r"runs.sqlite is damaged"):
        write_report(folder)


def test_failures_are_counted_and_placed(folder):
    with (folder / "tables" / "failures.csv").open() as file:
        table = list(csv.DictReader(file))
    assert [row["status"] for row in table] == ["failed", "timeout", "nonfinite"]
    with (folder / "tables" / "failure-messages.csv").open() as file:
        assert {row["message"] for row in csv.DictReader(file)} == {
            "ZeroDivisionError: division by zero", "no result after 5 s", "response 'y' is nan",
        }  # fmt: skip
    assert np.isfinite([[float(row[name]) for name in list(row)[3:]] for row in table]).all()


@pytest.mark.usefixtures("undrawn")
def test_failures_of_a_command_are_grouped_by_the_words_of_its_solver(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast")
    db = connected(folder / "runs.sqlite")
    words = "solver ended with exit code 3 (kept in work/{}ab)"
    db.executemany(
        "UPDATE evaluation SET status = 'failed', outputs = NULL, error = ?, log = ? WHERE id = ?",
        [
            (words.format(k), f"step {k}\n*** ERROR: no convergence at t = 0.{k} s\nbye", 4 + k)
            for k in range(3)
        ],
    )
    db.commit()
    db.close()
    write_report(folder)
    with (folder / "tables" / "failure-messages.csv").open() as file:
        first = next(csv.DictReader(file))
    assert (first["status"], first["runs"], first["first run"]) == ("failed", "3", "4")
    assert first["message"] == "solver ended with exit code 3: *** ERROR: no convergence at t = … s"


@pytest.mark.browser
@needs_browser
@pytest.mark.parametrize("width", [1280, 400])
def test_a_browser_opens_it_without_a_message_or_a_request(folder, width):
    seen = visit(folder / "report.html", width=width)
    assert seen.console == []
    assert seen.asked == []
    assert "95 % band" in seen.dom  # the profiler has run


@pytest.mark.usefixtures("undrawn")
def test_a_surrogate_s_extreme_has_no_confirming_run(tmp_path):
    folder = write_sample(tmp_path / "s.holdfast", confirmed=False)
    worst = json.loads((folder / "worst_case.json").read_text())
    worst["run_key"] = worst["history"][3]["run_key"]  # the worst of the given runs
    (folder / "worst_case.json").write_text(json.dumps(worst))
    assert "confirms the worst case" not in write_report(folder).read_text()


def test_columns_that_say_nothing_are_left_out(folder):
    header = (folder / "tables" / "worst-case.csv").read_text().splitlines()[0]
    assert header == "parameter,worst value,lower,upper,place in its range,selected by screening"
    assert "baseline" not in (folder / "tables" / "parameters.csv").read_text()


@pytest.mark.usefixtures("undrawn")
def test_a_selection_that_predicts_badly_is_not_called_complete(tmp_path):
    page = write_report(write_sample(tmp_path / "s.holdfast", q2=0.6)).read_text()
    assert "The selected ones alone predict 60\xa0% of the variance: others may matter too." in page
    page = write_report(write_sample(tmp_path / "s.holdfast", q2=0.9)).read_text()
    assert "others may matter too" not in page
