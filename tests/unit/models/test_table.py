"""Columns of a table that no study reads are named where they hold numbers."""

from workbench.campaign.telling import tell_csv
from workbench.models.table import ignored_columns, ignored_sentence
from workbench.report.lines.design import design_lines
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage

STUDY = """
[study]
name = "s"
[model]
{model}
[[parameter]]
name = "a"
lower = 0
upper = 9
[[response]]
name = "y"
"""


def test_only_columns_of_numbers_that_nobody_reads_are_ignored_ones():
    header = ["a", "t", "who", "empty", "mixed"]
    lines = [(2, ["1", "2", "me", "", "3"]), (3, ["2", "", "you", "", "high"])]
    assert ignored_columns(header, lines, {"a"}) == ["t"]
    assert ignored_sentence(["t", "u"], "r.csv") == (
        "the columns t, u of r.csv hold numbers and are not used: neither parameters nor responses"
    )


def test_the_terminal_names_them(tmp_path):
    rows = ["1,20,3,x,1", "2,21,4.5,y,2", "4,22,5,z,3"]
    (tmp_path / "runs.csv").write_text("\n".join(["a,temperature,F [N],who,speed", *rows]))
    path = tmp_path / "s.toml"
    path.write_text(STUDY.format(model='kind = "table"\nfile = "runs.csv"\ncolumns = { y = "F [N]" }'))
    with Campaign.from_file(path) as campaign:
        document = run_stage(campaign, "design")
    assert document["ignored_columns"] == ["temperature", "speed"]
    said = " ".join(design_lines(document))
    assert "the columns temperature, speed of runs.csv hold numbers and are not used" in said
    assert max(map(len, design_lines(document))) < 80


def test_told_results_name_theirs(tmp_path):
    path = tmp_path / "s.toml"
    path.write_text(STUDY.format(model='kind = "ask"') + '[worst_case]\nresponse = "y"\nbudget = 9\n')
    (tmp_path / "told.csv").write_text("a,y,speed,error\n1,2,7,\n")
    with Campaign.from_file(path) as campaign:
        assert tell_csv(campaign, tmp_path / "told.csv").ignored == ("speed",)
