"""The section on time histories: bands, worst runs, modes; what cannot be shown is said."""

import sqlite3
from dataclasses import replace

import numpy as np
import pytest

from workbench.histories import stack
from workbench.report.contents import DOCUMENTS
from workbench.report.histories import section as module
from workbench.report.histories.section import histories_section
from workbench.report.page.folder import CampaignFolder
from workbench.report.writing import write_report
from workbench.stages.campaign import Campaign

STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
keep = ["speed"]
[[parameter]]
name = "size"
unit = "kN"
lower = 1
upper = 2
[[parameter]]
name = "rate"
lower = 0
upper = 1
[[response]]
name = "force"
unit = "kN"
reduce = "max"
[evaluate]
engine = "inline"
"""
CODE = """
import numpy as np
def f(size, rate):
    t = np.linspace(0, 1, {samples})
    n = {n}
    return {{"force": (t, size * np.sin(3 * t) + 0.1 * rate * np.cos(20 * t)), "speed": (t[:n], t[:n])}}
"""
N = 24


def made(folder, samples="700", n="700"):
    (folder / "m.py").write_text(CODE.format(samples=samples, n=n))
    (folder / "s.toml").write_text(STUDY)
    rng = np.random.default_rng(1)
    rows = [{"size": float(a), "rate": float(b)} for a, b in rng.uniform([1, 0], [2, 1], (N, 2))]
    with Campaign.from_file(folder / "s.toml") as campaign:
        campaign.evaluate(rows)
    return folder / "s.holdfast"


def section(folder):
    return histories_section(CampaignFolder.opened(folder, documents=DOCUMENTS))


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    return made(tmp_path_factory.mktemp("campaign"))


def test_bands_worst_runs_and_modes(campaign):
    found = section(campaign)
    assert found.sentences[0].startswith("Kept over time: force and speed.")
    tables = {table.id: table for table in found.tables}
    runs = CampaignFolder.opened(campaign, documents=DOCUMENTS).runs.at(range(N))
    t = np.linspace(0, 1, 700)
    whole = np.array(
        [r.inputs["size"] * np.sin(3 * t) + 0.1 * r.inputs["rate"] * np.cos(20 * t) for r in runs]
    )
    for row in tables["bands-force"].rows:
        k = round(row[0] * 699)
        assert row[1:] == pytest.approx(np.quantile(whole[:, k], (0, 0.05, 0.25, 0.5, 0.75, 0.95, 1)))
    assert tables["bands-force"].columns[4].heading == "median [kN]"
    peaks = whole.max(axis=1)
    far = np.argsort(-peaks)[:3]
    assert [row[0] for row in tables["worst-force"].rows] == [runs[k].id for k in far]
    assert [row[2] for row in tables["worst-force"].rows] == pytest.approx(peaks[far])
    assert [row[3] for row in tables["worst-force"].rows] == pytest.approx(t[whole[far].argmax(axis=1)])
    shares = tables["mode-shares-force"].rows
    assert [row[4] for row in shares] == ["size", "rate"]
    assert sum(row[1] for row in shares) == pytest.approx(1)
    assert shares[0][1] > 0.9
    assert "mode-shares-speed" not in tables, "all runs are alike in it"
    assert found.numbers["force"] == {"runs": N, "samples": 700, "shares": [row[1] for row in shares]}


def test_a_large_campaign_thins_the_lines_and_not_the_bands(campaign, monkeypatch):
    before = {table.id: table.rows for table in section(campaign).tables}
    monkeypatch.setattr(module, "LINES", 5)
    monkeypatch.setattr(stack, "BLOCK", 1000)
    found = section(campaign)
    figure = next(block for block in found.blocks if block.id == "bands-force")
    assert "5 of 24 runs are drawn thin" in figure.read_off
    assert {table.id: table.rows for table in found.tables} == before


def test_the_page_has_it_before_the_runs(campaign):
    page = write_report(campaign).read_text()
    assert 0 < page.index(">Over time</h2>") < page.index(">What ran</h2>")
    assert "Modes of force" in page


def test_runs_on_other_times_and_short_runs(tmp_path):
    folder = made(tmp_path, samples="int(300 + 400 * rate)", n="len(t) if size < 1.5 else 5")
    found = section(folder)
    bands = [block for block in found.blocks if block.id == "bands-force"]
    assert "Runs stand on different times; values are on straight lines" in bands[0].read_off
    assert found.numbers["force"]["samples"] == module.SAMPLES


def test_a_run_that_ended_early_does_not_end_the_bands(tmp_path):
    folder = made(tmp_path, n="700 if size < 1.5 else 5")
    tables = {table.id: table for table in section(folder).tables}
    assert tables["bands-speed"].rows[-1][1:] == pytest.approx([1.0] * 7)


def test_what_is_damaged_is_said_and_the_rest_shown(tmp_path):
    folder = made(tmp_path)
    db = sqlite3.connect(folder / "histories.sqlite")
    db.execute("DELETE FROM part WHERE id >> 20 IN (SELECT id FROM history WHERE name = 'speed')")
    db.commit()
    db.close()
    found = section(folder)
    (note,) = (block.text for block in found.blocks if hasattr(block, "level"))
    assert note.startswith("The histories 'speed' are not shown. ")
    assert "bands-force" in {table.id for table in found.tables}


def test_the_worst_runs_are_those_that_the_study_means(campaign):
    folder = CampaignFolder.opened(campaign, documents=DOCUMENTS)
    lowest = sorted(folder.runs, key=lambda run: run.outputs["force"])[:3]
    search = {"worst_case": {"response": "force", "sense": "min"}}
    lock = {"resolved": {"response": [{"name": "force", "unit": "kN", "reduce": "min"}]}}
    for changed in ({"documents": {**folder.documents, **search}}, {"lock": lock}):
        tables = {table.id: table for table in histories_section(replace(folder, **changed)).tables}
        assert tables["worst-force"].title == "Runs with the smallest force"
        assert [row[0] for row in tables["worst-force"].rows] == [run.id for run in lowest]
    assert "Runs with the largest size over time" in {t.title for t in section(campaign).tables}


def test_a_campaign_without_histories_has_no_section(tmp_path):
    (tmp_path / "study.lock.json").write_text("{}")
    assert section(tmp_path) is None
