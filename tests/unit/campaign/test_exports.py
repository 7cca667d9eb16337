"""Exports: cells that a spreadsheet would compute."""

import csv

from workbench.campaign.exports import write_all
from workbench.campaign.rescue.stock import exported_rows
from workbench.report.page.blocks import Column, Table
from workbench.report.page.markdown import csv_text
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign

WORDS = ["=1+1", "-x", "'tis", "steel", "steel"]
QUOTED = ["'=1+1", "'-x", "'tis", "steel", "steel"]
SPACE = Space(
    [Parameter("a", lower=-1, upper=1), Parameter("word", levels=tuple(WORDS[:4]), kind="categorical")]
)


def cells(path):
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def test_texts_that_begin_a_formula_are_quoted(tmp_path):
    with Campaign.of(lambda a, word: a, SPACE, folder=tmp_path / "c") as campaign:
        for a, word in zip((-0.5, 0.5, 0.25, 0.0), WORDS[:4], strict=True):
            campaign.tell(None, a, parameters={"a": a, "word": word})
        campaign.tell(None, failure="@SUM(A1) is no number", parameters={"a": 1.0, "word": "steel"})
        write_all(campaign, folder=tmp_path)
        rows = cells(tmp_path / "runs.csv")
        assert [row["word"] for row in rows] == QUOTED
        assert rows[0]["a"] == "-0.5", "a number is a number"
        assert rows[-1]["error"] == "'@SUM(A1) is no number"
        saved = exported_rows(tmp_path, SPACE, ["y"], model=campaign.spec.identity, version="1")
        assert [dict(row.inputs)["word"] for row in saved] == WORDS
        assert saved[-1].error == "@SUM(A1) is no number"
        write_all(campaign, folder=tmp_path, raw=True)
        assert [row["word"] for row in cells(tmp_path / "runs.csv")] == WORDS


def test_tables_of_the_report_are_quoted_too():
    table = Table(id="t", title="t", columns=[Column(name="name"), Column(name="y")], rows=[("=cmd()", -1.5)])
    assert csv_text(table).splitlines()[1] == "'=cmd(),-1.5"
