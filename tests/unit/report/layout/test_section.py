"""The report after a layout: drawing, re-evaluation, motion, and the viewer in a browser."""

import json
import re

import numpy as np
import pytest

from tests.browser import needs_browser, print_pdf, visit
from tests.sample_campaign import write_loop, write_sample
from workbench.motion.frames import Motion
from workbench.report.layout.section import improvement_sentence
from workbench.report.writing import report_numbers, write_report

LARGEST_PAGE = 1_500_000  # bytes


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = write_sample(tmp_path_factory.mktemp("loop") / "sample.holdfast")
    write_loop(folder)
    write_report(folder)
    return folder


@pytest.fixture(scope="module")
def page(folder):
    return (folder / "report.html").read_text()


def text_of(page):
    return " ".join(
        re.sub(r"<[^>]+>", " ", re.sub(r"<(svg|script|style).*?</\1>", " ", page, flags=re.S)).split()
    )


@pytest.mark.slow
def test_the_page_stays_small(page):
    assert len(page.encode()) < LARGEST_PAGE


def test_cards_of_the_loop(page):
    text = text_of(page)
    assert "Which layout holds fast in it? worst y 4.14412 kN That is 33.2 % below the best trivial" in text
    assert "Does it hold over the whole uncertainty? after: 10.0865 kN at worst" in text


def test_layout_that_is_no_better_says_so(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.report.page.html.draw_svg", lambda draw, **options: "<svg></svg>")
    copy = write_sample(tmp_path / "s.holdfast")
    layout = json.loads((folder / "layout.json").read_text())
    layout["baselines"]["uniform"] = 3.0
    (copy / "layout.json").write_text(json.dumps(layout))
    assert "That is no better than the uniform layout (3)." in text_of(write_report(copy).read_text())


def test_many_scenarios_are_folded(folder, tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.report.page.html.draw_svg", lambda draw, **options: "<svg></svg>")
    copy = write_sample(tmp_path / "s.holdfast")
    layout = json.loads((folder / "layout.json").read_text())
    for count, folded in ((8, False), (9, True)):
        layout["scenarios"] = [{"name": f"case {k}", "value": k, "parameters": {}} for k in range(count)]
        (copy / "layout.json").write_text(json.dumps(layout))
        page = write_report(copy).read_text()
        assert (f"<summary>The layout in each of its scenarios ({count} rows)</summary>" in page) == folded
        assert f">case {count - 1}<" in page


def test_kinds_of_members_are_told_apart_without_colour(page):
    drawing = re.search(r'<figure id="figure-layout-drawing">.*?</figure>', page, re.S)[0]
    assert "stroke-dasharray" in drawing
    assert "a retractor dashes" in drawing


def test_failed_scenarios_are_counted(page):
    text = text_of(page)
    assert "for every design: 1 of 200 scenarios, in which a run gave no value (before 0, after 1)." in text
    assert "After gave no value in 1 of 200 scenarios, and fails where before is bad." in text
    assert "are not failures; they were run for no design: before 0, after 7." in text
    assert "failed (95 % interval)" in text
    assert "Worst of 199 scenarios; with before it was" in text
    assert "Runs failed and may hide something worse." in text
    assert "0.5 % (0.0 to 3.0 %)" in text
    assert "The numbers of this figure (199 rows)" in page


def test_the_price_of_robustness_is_told_with_the_nominal_scenario(page, folder):
    text = text_of(page)
    assert "Price of robustness, the distance to the best design at nominal: before 0.3 kN (it gives" in text
    assert "The nominal scenario" in text
    assert report_numbers(folder)["sections"]["robust"]["nominal"] == {"x12": 0.25}


def test_numbers_of_the_loop(folder):
    sections = report_numbers(folder)["sections"]
    assert sections["layout"]["baselines"] == {"uniform": 7.9, "nominal-only": 6.2}
    assert sections["robust"]["summaries"][1]["failed"] == 1
    assert sections["motion"]["frames"] == 76


def test_motion_in_the_page_is_the_motion_of_the_folder(page, folder):
    document = json.loads(re.search(r'id="viewer-data">(.*?)</script>', page, re.S)[1])
    motion = Motion.from_dict(document)
    assert motion.runs[0].poses.shape == (76, 10, 7)
    kept = Motion.from_dict(json.loads((folder / "motion.json").read_text()))
    np.testing.assert_array_equal(motion.runs[1].poses, kept.runs[1].poses)
    stills = re.findall(r'<div class="stills">(.*?)</div>', page, re.S)
    assert [row.count('src="data:image/png;base64,') for row in stills] == [4, 4]  # a row for each run


def test_a_study_without_a_layout_does_not_miss_one(tmp_path, monkeypatch):
    monkeypatch.setattr("workbench.report.page.html.draw_svg", lambda draw, **options: "<svg></svg>")
    folder = write_sample(tmp_path / "s.holdfast")
    assert "holdfast layout" not in write_report(folder).read_text()
    lock = json.loads((folder / "study.lock.json").read_text())
    lock["resolved"]["layout"] = {"method": "gsao"}
    (folder / "study.lock.json").write_text(json.dumps(lock))
    assert "<li>The layout: <code>holdfast layout</code> writes it.</li>" in write_report(folder).read_text()


def probed(folder, tmp_path, script):
    """The page with a script at its end that writes what it found; the policy is left out for that."""
    page = (folder / "report.html").read_text()
    page = re.sub(r'<meta http-equiv="Content-Security-Policy"[^>]*>', "", page)
    probe = f'<pre id="found"></pre><script>document.getElementById("found").textContent = {script}</script>'
    (tmp_path / "probe.html").write_text(page.replace("</body>", f"{probe}</body>"))
    return tmp_path / "probe.html"


def found(seen):
    return json.loads(re.search(r'<pre id="found">(.*?)</pre>', seen.dom, re.S)[1])


def place(cursor):
    return float(re.fullmatch(r"translateX\((.*)cqw\)", cursor)[1])


@pytest.mark.browser
@needs_browser
def test_the_viewer_draws_and_the_cursor_follows(folder, tmp_path):
    script = "JSON.stringify([holdfast.viewer, ...[0, 60, 0].map((i) => holdfast.viewer.probe(i))])"
    seen = visit(probed(folder, tmp_path, script), gl=True)
    assert seen.console == []
    viewer, first, later, again = found(seen)
    assert (viewer["ready"], viewer["frames"], viewer["bodies"]) == (True, 76, [10, 10])
    assert viewer["members"] == [0, 5]
    assert first["drawn"] == again["drawn"]
    for a, b in zip(first["drawn"], later["drawn"], strict=True):
        assert a["hash"] != b["hash"]
        assert a["colours"] > 400  # edges are blended by the browser, beyond this buffer
    assert place(later["cursor"]) > place(first["cursor"])
    assert first["draws"] > 2 * 19  # ground, shadows and bodies of both runs


@pytest.mark.browser
@needs_browser
def test_without_webgl_a_sentence_points_to_the_stills(folder, tmp_path):
    page = probed(folder, tmp_path, "JSON.stringify(holdfast.viewer)")
    page.write_text(page.read_text().replace('getContext("webgl2"', 'getContext("none"'))
    seen = visit(page)
    assert seen.console == []
    assert found(seen) == {"ready": False}
    assert "offers no WebGL2" in seen.dom


@pytest.mark.browser
@needs_browser
@pytest.mark.parametrize("width", [1280, 400])
def test_the_whole_page_opens_in_silence_and_fits(folder, tmp_path, width):
    seen = visit(folder / "report.html", width=width, gl=True)
    assert seen.console == []
    assert seen.asked == []
    # Chromium's window is at least 500 wide; a frame is as narrow as a phone
    frame = tmp_path / "frame.html"
    inner = probed(folder, tmp_path, "document.documentElement.scrollWidth - innerWidth")
    inner.write_text(inner.read_text().replace('id="found"', 'id="found-inside"').replace(
        'getElementById("found").textContent =', 'getElementById("found-inside"); parent.postMessage('
    ).replace("innerWidth</script>", "innerWidth, '*')</script>"))  # fmt: skip
    frame.write_text(
        f'<pre id="found"></pre><iframe src="probe.html" width="{width}" height="800"></iframe><script>'
        "onmessage = (e) => { document.getElementById('found').textContent = e.data }</script>"
    )
    assert found(visit(frame)) == 0  # nothing is wider than the window


@pytest.mark.browser
@needs_browser
def test_it_prints(folder, tmp_path):
    pdf = tmp_path / "report.pdf"
    print_pdf(folder / "report.html", pdf)
    content = pdf.read_bytes()
    assert content.startswith(b"%PDF")
    assert (
        content.count(b"/Type /Page\n") + content.count(b"/Type /Page ") + content.count(b"/Type/Page/") >= 3
    )


@pytest.mark.parametrize(
    ("value", "uniform", "said"),
    [
        (3.0, 4.0, "That is 25.0 % below the best trivial layout (uniform, 4)."),
        (4.0, 4.0, "That is no better than the uniform layout (4)."),
        (-2.0, -1.0, "That is 1 below the best trivial layout (uniform, -1)."),
        (-2.0, 0.0, "That is 2 below the best trivial layout (uniform, 0)."),
        (-1.0, -2.0, "That is no better than the uniform layout (-2)."),
    ],
)
def test_a_gain_is_a_share_of_positive_numbers_only(value, uniform, said):
    """The card of a layout that is better was green while its sentence called it no better."""
    assert improvement_sentence({"value": value, "baselines": {"uniform": uniform}}) == said
