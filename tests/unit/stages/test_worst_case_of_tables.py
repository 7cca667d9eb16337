"""The stages of a table of runs: what a worst case is stated against, in which words, and which go first."""

import re
from types import SimpleNamespace

import pytest

from workbench.errors import NotEnoughRuns
from workbench.stages import stored_runs
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_all, run_stage
from workbench.terminal.cli import main

STUDY = """
[study]
name = "t"
[model]
kind = "table"
file = "t.csv"
[[parameter]]
name = "a"
lower = 0.0
upper = 1.0
[[response]]
name = "y"
[worst_case]
response = "y"
sense = "{sense}"
budget = 6
"""
LEVELS = [(3 * k % 14 + 0.5) / 14 for k in range(14)]


def written(tmp_path, values, *, sense="max"):
    """The study file of a table of 14 runs with these values."""
    rows = [f"{a},{y}" for a, y in zip(LEVELS, values, strict=True)]
    (tmp_path / "t.csv").write_text("a,y\n" + "\n".join(rows) + "\n")
    (tmp_path / "t.toml").write_text(STUDY.format(sense=sense))
    return tmp_path / "t.toml"


def document_of(tmp_path, values, *, sense="max"):
    """`worst_case.json` of such a study."""
    with Campaign.from_file(written(tmp_path, values, sense=sense)) as campaign:
        return run_all(campaign)["worst_case"]


@pytest.mark.parametrize("sense", ["max", "min"])
@pytest.mark.parametrize("size", ["1e200", "-1e200", "1.1e140", "inf"])
def test_a_row_too_large_to_be_a_value_is_no_known_run(tmp_path, sense, size):
    values = [str(a * a) for a in LEVELS]
    values[5] = size
    document = document_of(tmp_path, values, sense=sense)
    assert -0.1 < document["value"] < 1.1
    assert document["failures"] == {"nonfinite": 1}


SCREENED = '[screen]\nresponse = "y"\n'


@pytest.mark.parametrize("verb", [["worst-case"], ["screen"], ["screen", "--method", "pcc"]])
def test_any_stage_may_be_the_first_to_read_the_table(tmp_path, verb, capsys, monkeypatch):
    study = written(tmp_path, [a * a for a in LEVELS])
    study.write_text(study.read_text() + SCREENED)
    monkeypatch.setattr("sys.argv", ["holdfast", verb[0], str(study), *verb[1:]])
    monkeypatch.setattr("signal.signal", lambda *_: None)  # the handler of the tests stays
    for _ in range(2):
        with pytest.raises(SystemExit) as end:
            main()
        assert end.value.code in (0, None)
    said = capsys.readouterr()
    assert said.err.count("14/14 runs") == 1, "the table is read once"
    with Campaign.from_file(study) as campaign:
        assert campaign.store.counts() == {"ok": 14}
        study.with_name("t.csv").write_text("a,y\n0.1,1\n0.2,2\n0.3,3\n0.4,2\n")
    with Campaign.from_file(study) as campaign:  # another table is read anew
        run_stage(campaign, "screen")
        assert len(campaign.runs()) == 4


QUEUED = """
[study]
name = "q"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0.0
upper = 1.0
[[response]]
name = "y"
[design]
runs = 6
[screen]
response = "y"
[evaluate]
engine = "inline"
"""


def test_a_screening_before_its_runs_says_what_they_wait_for(tmp_path, monkeypatch):
    (tmp_path / "m.py").write_text("def f(a):\n    return a\n")
    (tmp_path / "q.toml").write_text(QUEUED)

    def said():
        with pytest.raises(NotEnoughRuns) as refused:
            run_stage(campaign, "screen")
        return str(refused.value)

    with Campaign.from_file(tmp_path / "q.toml") as campaign:
        assert "0 of 0 runs gave a value, 3 are needed: nothing has been run yet. Run the study" in said()
        campaign.evaluate([{"a": 0.5}])
        campaign.enqueue([{"a": 0.1 * k} for k in range(4)], batch="told")
        assert re.search(
            r"of \d runs gave a value, 3 are needed: 4 runs wait for their answers. Make", said()
        )
        monkeypatch.setattr(stored_runs, "as_of", lambda store: SimpleNamespace(holder="somebody"))
        assert said().endswith(
            "4 runs have no answer yet and are being made. Look again when more have ended"
        )
