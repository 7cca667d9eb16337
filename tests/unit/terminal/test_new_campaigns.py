"""A campaign that cannot run its model is refused before its folder is made."""

import re

import pytest

from tests.unit.terminal.test_cli import in_process
from workbench.terminal.shared import opened_campaign

STUDY = """
[study]
name = "s"
[model]
{model}
[[parameter]]
name = "a"
lower = 0
upper = 1
[[response]]
name = "y"
{read}
[design]
runs = 4
[worst_case]
response = "y"
budget = 8
"""
MODELS = {
    "no file": ('kind = "python"\nfunction = "gone.py:f"', "line 6: no file .*gone.py: function 'gone.py:f'"),
    "no module": ('kind = "python"\nfunction = "gone_module:f"', "line 6: no module 'gone_module'"),
    "no program": ('kind = "command"\ncommand = ["./gone", "{a}"]', "line 6: .*gone"),
    "no table": ('kind = "table"\nfile = "gone.csv"', "line 6: .*gone.csv"),
}


def written(folder, model):
    read = 'read = { kind = "csv", file = "out.csv", column = "y" }' if "command" in model else ""
    (folder / "s.toml").write_text(STUDY.format(model=model, read=read))
    return folder / "s.toml"


@pytest.mark.parametrize("command", ["run", "worst-case"])
@pytest.mark.parametrize("what", MODELS)
def test_a_model_that_cannot_be_opened_is_refused_before_anything_is_made(what, command, tmp_path, capsys):
    model, said = MODELS[what]
    path = written(tmp_path, model)
    code, out, err = in_process(command, path, capsys=capsys)
    assert (code, out) == (2, "")
    assert re.search(said, err)
    assert [p.name for p in tmp_path.iterdir()] == ["s.toml"]
    assert in_process("validate", path, capsys=capsys) == (2, "", err)


def test_a_design_waits_for_no_model(tmp_path, capsys):
    path = written(tmp_path, MODELS["no file"][0])
    assert in_process("design", path, capsys=capsys)[0] == 0
    assert (tmp_path / "s.holdfast" / "design.json").exists()


def test_a_cluster_may_have_a_model_that_is_not_here(tmp_path):
    path = written(tmp_path, MODELS["no file"][0])
    path.write_text(path.read_text() + '[evaluate]\nengine = "dask"\n')
    with opened_campaign(path, None, runs_model=True) as campaign:
        assert campaign.folder.exists()
    path = path.rename(tmp_path / "other.toml")
    with opened_campaign(path, None, dask="tcp://there:1", runs_model=True) as campaign:
        assert campaign.folder.exists()


def test_points_of_a_file_that_lie_outside_are_refused_by_validate(tmp_path, capsys):
    path = written(tmp_path, 'kind = "ask"')
    (tmp_path / "points.csv").write_text("a\n0.5\n0.25\n3\n")
    text = path.read_text().replace("runs = 4", 'kind = "table"\nfile = "points.csv"')
    path.write_text(text)
    code, _, err = in_process("validate", path, capsys=capsys)
    assert code == 2
    assert "points.csv, row 3 below the header: parameter 'a' lies between 0 and 1, got 3. Mend it" in err
    path.write_text(text.replace("[worst_case]", "runs = 2\n[worst_case]"))
    assert in_process("validate", path, capsys=capsys)[0] == 0


COUNTED = """
from pathlib import Path

def f(a):
    with open(Path(__file__).with_name("calls"), "a") as file:
        file.write("x")
    return a
"""
LATE = {
    "enclosure": ('enclosure = "gone.py:g"', r"line 19: \[worst_case\] enclosure: no file .*gone.py"),
    "method": ('[screen]\nresponse = "y"\nmethod = "magic"', "line 21: .*magic"),
    "layout": ('[layout]\nproblem = "gone.py:g"', "line 20: .*gone.py"),
    "layout method": ('[layout]\nproblem = "gone.py:g"\nmethod = "magic"', "line 21: .*magic"),
    "robust layout": (
        '[robust_layout]\nmodel = "gone.py:g"\nnominal = { a = 0.5 }',
        "line 20: .*gone.py",
    ),
}


@pytest.fixture
def late(tmp_path):
    """A study whose late stage `more` cannot be walked; it counts its runs in the file `calls`."""
    (tmp_path / "m.py").write_text(COUNTED)

    def of(more):
        path = written(tmp_path, 'kind = "python"\nfunction = "m.py:f"')
        path.write_text(path.read_text() + more + "\n")
        return path

    return of


@pytest.mark.parametrize("what", LATE)
def test_a_late_stage_that_cannot_be_walked_is_refused_before_a_run(what, late, tmp_path, capsys):
    more, said = LATE[what]
    path = late(more)
    code, out, err = in_process("run", path, capsys=capsys)
    assert (code, out) == (2, "")
    assert re.search(said, err)
    assert sorted(p.name for p in tmp_path.iterdir() if p.suffix) == ["m.py", "s.toml"]
    assert not (tmp_path / "calls").exists()
    assert in_process("validate", path, capsys=capsys) == (2, "", err)


def test_a_stage_that_joins_later_is_checked_before_its_first_run(late, tmp_path, capsys):
    path = late("")
    assert in_process("design", path, capsys=capsys)[0] == 0
    assert (tmp_path / "s.holdfast" / "runs.sqlite").exists()
    more, said = LATE["enclosure"]
    late(more)
    code, _, err = in_process("run", path, capsys=capsys)
    assert code == 2
    assert re.search(said, err)
    assert not (tmp_path / "calls").exists()


def test_a_study_with_nothing_to_run_is_refused_as_by_validate(late, tmp_path, capsys):
    path = late('[screen]\nresponse = "y"')
    path.write_text(path.read_text().replace("[design]\nruns = 4\n", ""))
    code, _, err = in_process("run", path, capsys=capsys)
    assert code == 2
    assert "the study has no [design] table, so there is nothing to run" in err
    assert not (tmp_path / "s.holdfast").exists()
