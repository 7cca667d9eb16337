"""Columns of a table that no study reads, and what is told of runs made elsewhere."""

import pytest

from workbench.campaign.telling import tell_csv
from workbench.errors import StudyError
from workbench.models.table import ignored_columns, ignored_sentence
from workbench.report.lines.design import design_lines
from workbench.stages.campaign import Campaign
from workbench.stages.design import queue_design
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


ASKED = """
[[parameter]]
name = "road"
kind = "categorical"
levels = ["flat", "bump"]
[design]
runs = 8
"""


@pytest.fixture
def asked(tmp_path):
    """A campaign with eight rows that wait, and a function that tells it a file of these lines."""
    path = tmp_path / "s.toml"
    path.write_text(STUDY.format(model='kind = "ask"') + ASKED)
    with Campaign.from_file(path) as campaign:
        queue_design(campaign, run_stage(campaign, "design"))

        def told(*lines):
            (tmp_path / "told.csv").write_text("\n".join(lines))
            return tell_csv(campaign, tmp_path / "told.csv")

        yield campaign, told


def test_told_values_that_are_none_count_as_failed(asked):
    campaign, told = asked
    keys = [run.key for run in campaign.ask()]
    found = told(
        "key,y", *(f"{k},{y}" for k, y in zip(keys, ("1.5D+00", "NaN", "1e400", "-inf"), strict=False))
    )
    assert (found.answered, found.failed) == (4, 3)
    assert campaign.store.counts() == {"ok": 1, "nonfinite": 3, "queued": 4}


def test_a_key_beside_the_parameters_of_another_run_is_refused(asked):
    campaign, told = asked
    first, second, *_ = campaign.ask()
    a, road = first.parameters["a"], first.parameters["road"]
    other = "bump" if road == "flat" else "flat"
    with pytest.raises(
        StudyError, match=rf"told.csv, line 2: the run of this key was asked for with a = {a}, "
    ):
        told("key,a,y", f"{first.key},{second.parameters['a']},3")
    with pytest.raises(
        StudyError, match=rf"asked for with road = {road}, got {other}. Give the result of that"
    ):
        told("key,a,road,y", f"{first.key},{a},{other},3")
    assert told("key,a,road,y", f"{first.key},{a + 0.005},{road},3", f"{second.key},,,4").answered == 2


def test_what_is_told_of_a_short_key_and_of_other_separators(asked):
    campaign, told = asked
    key = campaign.ask()[0].key
    with pytest.raises(
        StudyError, match=r"was asked for, which `holdfast design --csv` writes whole; leave the"
    ):
        told("key,y", f"{key[:10]},3")
    with pytest.raises(StudyError, match=r"told.csv separates its columns by ';', a table does so by commas"):
        told("key;y", f"{key};3")
