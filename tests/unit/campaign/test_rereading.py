"""A run is a simulation and a reading: other readings of stored runs cost no run."""

import sqlite3
import sys
import zipfile
from pathlib import Path

import pytest

from workbench.campaign.permissions import Permissions
from workbench.campaign.rereading import kept_archive
from workbench.campaign.rescue.merging import merged
from workbench.campaign.view import CampaignView
from workbench.errors import StudyError
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study
from workbench.terminal.showing import run_document, run_lines

HEAD = """
[study]
name = "s"
[[parameter]]
name = "a"
lower = 0
upper = 1
[evaluate]
engine = "inline"
"""
PYTHON = """
def f(a):
    with open("{calls}", "a") as file:
        file.write("x")
    return {{"y": 2 * a, "z": a - 1, "h": ([0, 1, 2], [a, -3 * a, a])}}
"""
ROWS = [{"a": 0.25}, {"a": 0.5}, {"a": 1.0}]
SOLVER = """
import sys
a = float(sys.argv[1])
open("calls.txt", "a")
open("{calls}", "a").write("x")
open("out.csv", "w").write("t,f,g\\n" + "".join(f"{{k}},{{a * k}},{{-k}}\\n" for k in range(500)))
open("log.txt", "w").write(f"end = {{3 * a}}\\nenergy = {{7 * a}}\\n")
"""


class Place:
    """A study in a folder, rewritten at will, whose model counts its runs."""

    def __init__(self, folder, kind):
        self.folder, self.calls = folder, folder / "calls"
        self.calls.write_text("")
        if kind == "python":
            (folder / "m.py").write_text(PYTHON.format(calls=self.calls))
            self.model = '[model]\nkind = "python"\nfunction = "m.py:f"\n'
        else:
            (folder / "solver.py").write_text(SOLVER.format(calls=self.calls))
            self.model = '[model]\nkind = "command"\ncommand = ["{python}", "{study}/solver.py", "{a}"]\n'

    def values(self, *responses, more="", permissions=None, rows=ROWS):
        text = HEAD + self.model + more + "".join(f"[[response]]\n{r}\n" for r in responses)
        (self.folder / "s.toml").write_text(text)
        with Campaign.from_file(self.folder / "s.toml", permissions=permissions) as campaign:
            return [dict(row.outputs) for row in campaign.evaluate(rows)]

    @property
    def runs(self):
        return len(self.calls.read_text())


@pytest.fixture
def python(tmp_path):
    return Place(tmp_path, "python")


@pytest.fixture
def command(tmp_path):
    return Place(tmp_path, "command")


def test_a_new_response_is_read_from_what_the_function_returned(python):
    assert python.values('name = "y"') == [{"y": 0.5}, {"y": 1.0}, {"y": 2.0}]
    both = python.values('name = "y"', 'name = "z"')
    assert both == [{"y": 0.5, "z": -0.75}, {"y": 1.0, "z": -0.5}, {"y": 2.0, "z": 0.0}]
    assert python.values('name = "z"') == [{"z": -0.75}, {"z": -0.5}, {"z": 0.0}]
    assert python.values('name = "y"') == [{"y": 0.5}, {"y": 1.0}, {"y": 2.0}]
    assert python.runs == 3


def test_the_one_number_of_a_function_may_be_renamed(python):
    code = PYTHON.format(calls=python.calls)
    (python.folder / "m.py").write_text(code[: code.index("return")] + "return 4 * a")
    assert python.values('name = "y"', rows=ROWS[:1]) == [{"y": 1.0}]
    assert python.values('name = "force"', rows=ROWS[:1]) == [{"force": 1.0}]
    assert python.runs == 1


def test_another_reducer_reads_the_stored_history(python):
    assert python.values('name = "h"\nreduce = "max"')[1] == {"h": 0.5}
    assert python.values('name = "h"\nreduce = "min"')[1] == {"h": -1.5}
    assert python.values('name = "h"\nreduce = "at"\nat = 0.5')[1] == {"h": -0.5}
    assert python.runs == 3


def test_histories_are_shown_joined_and_taken_along(python):
    response = 'name = "h"\nunit = "N"\nreduce = "max"'
    python.values(response)
    folder = python.folder / "s.holdfast"
    with CampaignView.opened(load_study(python.folder / "s.toml")) as view:
        found = run_document(view, "2")
    assert found["histories"] == {"h": {"unit": "N", "samples": 3, "from": 0.0, "to": 2.0}}
    assert "  h [N]: 3 samples from 0 to 2" in run_lines(found)
    text = (python.folder / "s.toml").read_text()
    with Campaign.from_file(python.folder / "s.toml", folder=python.folder / "other") as campaign:
        assert merged(campaign, folder).joined == 3
        assert campaign.history(campaign.runs()[1].key)["h"].values.tolist() == [0.5, -1.5, 0.5]
    more = '[[parameter]]\nname = "b"\nlower = 0\nupper = 1\nbaseline = 0.5\n'
    (python.folder / "s.toml").write_text(text.replace("[evaluate]", f"{more}[evaluate]"))
    allowed = Permissions(at_baseline=True, same_model=True)
    with Campaign.from_file(python.folder / "s.toml", permissions=allowed) as campaign:
        runs = [row for row in campaign.runs() if row.inputs == {"a": 1.0, "b": 0.5}]
        assert [campaign.history(row.key)["h"].values.tolist() for row in runs] == [[1.0, -3.0, 1.0]]


def test_a_history_that_is_damaged_is_not_read(python):
    python.values('name = "h"\nreduce = "max"')
    db = sqlite3.connect(python.folder / "s.holdfast" / "histories.sqlite")
    db.execute("DELETE FROM part")
    db.commit()
    db.close()
    with pytest.raises(
        StudyError, match=r"'h' cannot be read from 3 .* is damaged: part 0 of 'h' .* missing"
    ):
        python.values('name = "h"\nreduce = "min"')
    assert python.values('name = "h"\nreduce = "max"')[1] == {"h": 0.5}


def test_a_history_becomes_a_response_where_it_was_kept(python):
    python.values('name = "y"')
    words = (
        r"response 'h' cannot be read from 3 stored runs of s.holdfast: its time history was not kept. "
        r"--run-again makes the 3 stored runs anew"
    )
    with pytest.raises(StudyError, match=words):
        python.values('name = "y"', 'name = "h"\nreduce = "max"')
    assert python.values('name = "y"')[0] == {"y": 0.5}, "a refusal changes nothing"
    found = python.values('name = "y"', 'name = "h"\nreduce = "max"', permissions=Permissions(run_again=True))
    assert found[2] == {"y": 2.0, "h": 1.0}
    assert python.runs == 6
    fresh = Place(python.folder, "python")
    fresh.values('name = "y"', more='keep = ["h"]\nversion = "2"\n')
    assert fresh.values('name = "h"\nreduce = "min"', more='keep = ["h"]\nversion = "2"\n')[2] == {"h": -3.0}
    assert fresh.runs == 3


def test_a_run_that_lacked_a_response_is_read_when_it_is_taken_out(python):
    assert python.values('name = "y"', 'name = "other"') == [{}, {}, {}]
    assert python.values('name = "y"') == [{"y": 0.5}, {"y": 1.0}, {"y": 2.0}]
    assert python.runs == 3


FORCE = 'name = "force"\nreduce = "max"\nread = {{ kind = "csv", file = "out.csv", column = "{column}" }}'
END = 'name = "end"\nread = { kind = "regex", file = "log.txt", pattern = "end = (\\\\S+)" }'
ENERGY = 'name = "energy"\nread = { kind = "regex", file = "log.txt", pattern = "energy = (\\\\S+)" }'


def test_files_that_were_read_are_kept_and_read_again(command):
    force = FORCE.format(column="f")
    assert command.values(force, END)[1] == {"force": 249.5, "end": 1.5}
    assert command.values(force, END, ENERGY)[1] == {"force": 249.5, "end": 1.5, "energy": 3.5}
    assert command.values(FORCE.format(column="g"), ENERGY)[1] == {"force": 0.0, "energy": 3.5}
    assert command.values(force.replace("max", "mean"))[2] == {"force": 249.5}
    assert command.values(force, END)[1] == {"force": 249.5, "end": 1.5}
    assert command.runs == 3


def test_a_reading_that_the_files_do_not_hold_changes_nothing(command):
    force = FORCE.format(column="f")
    command.values(force)
    with pytest.raises(StudyError, match=r"'force' cannot be read from 3 .*no column 'q'; it has t, f, g"):
        command.values(FORCE.format(column="q"))
    assert command.values(force)[1] == {"force": 249.5}
    assert command.runs == 3


def test_nothing_is_kept_where_nothing_is_asked_for(command):
    command.values(END, more="keep = []\n")
    assert not (command.folder / "s.holdfast" / "kept").exists()
    with pytest.raises(StudyError, match=r"'energy' cannot be read from 3 .*: its files were not kept"):
        command.values(END, ENERGY, more="keep = []\n")


PEAK = 'name = "peak"\nread = { kind = "python", function = "post.py:peak" }'
POST = "import factor_of_post\ndef peak(work):\n"
POST += "    return factor_of_post.F * float((work / 'log.txt').read_text()[6:10])\n"


@pytest.fixture
def reader(command, monkeypatch):
    """Writes a reader, and forgets the module behind it as a new process would."""

    def write(post=POST, factor=1.0):
        monkeypatch.delitem(sys.modules, "factor_of_post", raising=False)
        (command.folder / "post.py").write_text(post)
        (command.folder / "factor_of_post.py").write_text(f"F = {factor}\n")

    monkeypatch.syspath_prepend(command.folder)
    write()
    return write


def test_an_edited_reader_reads_stored_runs_again(command, reader):
    assert command.values(PEAK)[2] == {"peak": 3.0}
    reader(POST.replace("return ", "return 10 + "))
    assert command.values(PEAK)[2] == {"peak": 13.0}
    reader(factor=-1.0)
    assert command.values(PEAK)[2] == {"peak": -3.0}
    reader()
    with Campaign.from_file(command.folder / "s.toml") as campaign:
        found = campaign.reread(every=True)
        assert [row.outputs["peak"] for row in campaign.runs()] == [0.75, 1.5, 3.0]
    assert (found.read, found.looked_at) == (3, 3)
    assert command.runs == 3


def test_an_edited_reader_of_histories_replaces_them(command, reader):
    history = PEAK + '\nreduce = "max"'
    reader("def peak(work):\n    return [0, 1], [1, 2]\n")
    assert command.values(history)[0] == {"peak": 2.0}
    reader("def peak(work):\n    return [0, 1], [5, 7]\n")
    assert command.values(history)[0] == {"peak": 7.0}
    with Campaign.from_file(command.folder / "s.toml") as campaign:
        stored = campaign.history(campaign.key(ROWS[0]))
        assert stored["peak"].values.tolist() == [5.0, 7.0]
    assert command.values(history.replace("max", "min"))[0] == {"peak": 5.0}
    assert command.runs == 3


def test_an_edited_reader_without_files_is_refused_with_the_number_of_runs(command, reader):
    nothing = "keep = []\n"
    command.values(PEAK, more=nothing)
    reader(POST.replace("return ", "return 1 * "))
    words = (
        r"'peak' cannot be read from 3 stored runs of s.holdfast: the code of its reader post.py:peak "
        r"changed, and its files were not kept. --same-model keeps what was read .*--run-again makes the 3"
    )
    with pytest.raises(StudyError, match=words):
        command.values(PEAK, more=nothing)
    vouched = Permissions(same_model=True)
    assert command.values(PEAK, more=nothing, permissions=vouched)[2] == {"peak": 3.0}
    assert command.values(PEAK, more=nothing)[2] == {"peak": 3.0}, "once said, it is known"
    assert command.runs == 3
    reader(factor=2.0)
    again = Permissions(run_again=True)
    assert command.values(PEAK, more=nothing, permissions=again)[2] == {"peak": 6.0}
    assert command.runs == 6


def test_a_reader_that_fails_is_refused_and_changes_nothing(command, reader):
    command.values(PEAK)
    reader("def peak(work):\n    return {}['force']\n")
    with pytest.raises(StudyError, match=r"'peak' cannot be read from 3 .*: KeyError: 'force'. --run-again"):
        command.values(PEAK)
    reader("def other(work):\n    return 1.0\n")
    with pytest.raises(StudyError, match=r"'peak' cannot be read from 3 .*post.py has no 'peak'"):
        command.values(PEAK)
    reader()
    assert command.values(PEAK)[2] == {"peak": 3.0}


def test_runs_that_a_reader_failed_at_are_read_when_it_is_mended(command, reader):
    reader("def peak(work):\n    raise ZeroDivisionError('a slip')\n")
    assert command.values(PEAK) == [{}, {}, {}]
    reader()
    assert command.values(PEAK) == [{"peak": 0.75}, {"peak": 1.5}, {"peak": 3.0}]
    assert command.runs == 3


def test_what_a_failed_command_left_is_never_read(command):
    with (command.folder / "solver.py").open("a") as file:
        file.write("sys.exit(1 if a > 0.4 else 0)\n")
    assert command.values(END) == [{"end": 0.75}, {}, {}]
    assert command.values(END, ENERGY) == [{"end": 0.75, "energy": 1.75}, {}, {}]


def test_another_reader_of_histories_leaves_none_of_the_former(command):
    command.values(FORCE.format(column="f"))
    assert command.values(FORCE.format(column="g"))[1] == {"force": 0.0}
    assert command.values(FORCE.format(column="g").replace("max", "min"))[1] == {"force": -499.0}
    with Campaign.from_file(command.folder / "s.toml") as campaign:
        stored = campaign.history(campaign.key(ROWS[1]))
        assert stored["force"].values[-1] == -499.0


def test_stores_that_did_not_know_the_code_of_readers_are_taken_as_they_are(command, reader, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr("workbench.campaign.runs.readings_now", lambda readings, *_, **__: readings)
        command.values(PEAK, more="keep = []\n")
    assert command.values(PEAK, more="keep = []\n")[2] == {"peak": 3.0}
    reader(factor=2.0)
    with pytest.raises(StudyError, match="cannot be read from 3 stored runs"):
        command.values(PEAK, more="keep = []\n")


def test_files_that_only_a_function_reads_are_kept_whole_or_not_at_all(command, reader):
    command.values(END, PEAK, rows=ROWS[:1])
    (archive,) = (command.folder / "s.holdfast" / "kept").iterdir()
    with zipfile.ZipFile(archive) as content:
        assert set(content.namelist()) == {"calls.txt", "log.txt", "out.csv", "output.log"}
    with (command.folder / "solver.py").open("a") as file:
        file.write("import random\nopen('big', 'wb').write(random.randbytes(200_000))\n")
    command.values(END, PEAK, rows=ROWS[:1], more='version = "2"\n')
    (other,) = (path for path in (command.folder / "s.holdfast" / "kept").iterdir() if path != archive)
    with zipfile.ZipFile(other) as content:
        assert content.namelist() == ["log.txt"]


def test_the_files_of_a_version_3_store_follow_its_runs(tmp_path):
    here = Path(__file__).parents[2] / "faults" / "campaign"
    place = tmp_path / "s.holdfast"
    (place / "work" / "68d0763dec0e2e1b3697598a9fda8b12").mkdir(parents=True)
    db = sqlite3.connect(place / "runs.sqlite")
    db.executescript((here / "store_v3.sql").read_text())
    db.close()
    text = """
[study]
name = "s"
[model]
kind = "command"
command = ["{python}", "{study}/sol.py", "{a}", "{b}"]
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "force"
reduce = "min"
read = { kind = "csv", file = "out.csv", column = "f" }
[[response]]
name = "end"
read = { kind = "regex", file = "log.txt", pattern = "end = (\\\\S+)" }
"""
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(StudyError, match="'force' cannot be read from 1 stored run "):
        Campaign.from_file(tmp_path / "s.toml")
    (tmp_path / "s.toml").write_text(text.replace('"min"', '"max"'))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        assert campaign.evaluate([{"a": 0.25, "b": 0.5}])[0].outputs == {"force": 0.0, "end": 0.75}
    (tmp_path / "s.toml").write_text(text)
    with Campaign.from_file(tmp_path / "s.toml", permissions=Permissions(run_again=True)) as campaign:
        rows = campaign.runs()
        assert [(row.status, row.inputs["a"]) for row in rows] == [
            ("queued", 0.75),
            ("failed", 0.95),
            ("ok", 0.25),
            ("queued", 0.5),
        ]
        assert rows[2].outputs == {"force": -7.0, "end": 0.75}
        assert all(campaign.key(row.inputs) == row.key for row in rows)
        assert (place / "work" / rows[1].key).is_dir()
        assert [[a[2] for a in campaign.store.attempts(rows[k].key)] for k in (0, 2)] == [
            ["other reading"]
        ] * 2


def test_archives_are_the_same_bytes_and_keep_to_their_limit(command):
    command.values(END, rows=ROWS[:1], more='keep = ["*.csv", "log.txt"]\nkeep_limit = "0.1 kB"\n')
    (archive,) = (command.folder / "s.holdfast" / "kept").iterdir()
    key = archive.stem
    with zipfile.ZipFile(archive) as content:
        assert content.namelist() == ["log.txt"], "the smaller one alone fits"
    before = archive.read_bytes()
    assert kept_archive(command.folder / "s.holdfast", key) == archive
    archive.unlink()
    command.values(
        END, rows=ROWS[:1], more='version = "2"\nkeep = ["*.csv", "log.txt"]\nkeep_limit = "0.1 kB"\n'
    )
    (again,) = (command.folder / "s.holdfast" / "kept").iterdir()
    assert again.read_bytes() == before
