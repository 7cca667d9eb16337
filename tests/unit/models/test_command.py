"""Command models: decks, readers, runs in folders of their own, and the loop of figure 8.26."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

import studies
from studies.adams_loop import solver
from workbench.errors import EvaluationFailed, StudyError
from workbench.models.protocol import History
from workbench.models.readers import read_response
from workbench.models.reading_rules import checked_rule
from workbench.models.template import compiled, format_value
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study

ENERGY = 5e-4  # relative: the speeds are differences of the written angles, coarse where the belt catches
ROW = {"k": 0.1 + 0.2, "n": 3, "road": "flat"}


@pytest.mark.parametrize(
    ("text", "style", "deck"),
    [
        ("K = {{ k }}\n", "jinja", "K = 0.30000000000000004\n"),
        ("{{ k|fmt('%10.3e') }}|{{ n }}|{{ road }}", "jinja", " 3.000e-01|3|flat"),
        ("{% if n > 2 %}{{ 2 * k + 1 }}{% else %}no{% endif %}", "jinja", "1.6"),
        ("{{ (-k)|abs }} { untouched }", "jinja", "0.30000000000000004 { untouched }"),
        (
            "K = {k} {n} {road} \\{k} {not a name} {}",
            "dakota",
            "K = 0.30000000000000004 3 flat {k} {not a name} {}",
        ),
    ],
)
def test_decks(text, style, deck):
    assert compiled(text, list(ROW), style=style, what="deck")(ROW) == deck


@pytest.mark.parametrize(
    ("text", "style", "words"),
    [
        ("{{ kk }}", "jinja", r"deck names 'kk', which is no parameter. Did you mean 'k'\?"),
        (
            "{% if z %}{% endif %}",
            "jinja",
            "deck names 'z', which is no parameter; the parameters are k, n, road",
        ),
        ("a\n{{ k ", "jinja", "deck, line 2: unexpected end of template"),
        ("{kk}", "dakota", r"deck names 'kk', which is no parameter. Did you mean 'k'"),
    ],
)
def test_what_templates_refuse(text, style, words):
    with pytest.raises(StudyError, match=words):
        compiled(text, list(ROW), style=style, what="deck")


def test_formats():
    assert format_value(1234567.0) == "1234567.0"
    with pytest.raises(EvaluationFailed, match=r"format '%s%s' is not of the form '%12.6g'"):
        format_value(1.0, "%s%s")
    with pytest.raises(EvaluationFailed, match="format '%d' does not fit 'flat'"):
        format_value("flat", "%d")
    with pytest.raises(EvaluationFailed, match="deck: ZeroDivisionError"):
        compiled("{{ 1 / (n - 3) }}", list(ROW), style="jinja", what="deck")(ROW)


REQUESTS = """! comment
REQUEST belt
TIME FX FM
0.0 1 2
1.0 -5.5D+00 7

REQUEST head
TIME DX
0.0 3
"""

READ = [
    ({"kind": "json", "key": "a.0.b"}, '{"a": [{"b": 3.5}]}', False, 3.5),
    ({"kind": "json", "key": "h"}, '{"h": {"time": [0, 1], "values": [2, 3]}}', True, ([0, 1], [2, 3])),
    ({"kind": "csv", "column": "F"}, "t,F\n0.5,3\n", False, 3.0),
    ({"kind": "csv", "column": "F"}, "t, F\n0,3\n1,4\n", True, History([0.0, 1.0], [3.0, 4.0])),
    ({"kind": "csv", "column": "t", "time": "F"}, "t,F\n0,3\n1,4\n", True, History([3.0, 4.0], [0.0, 1.0])),
    ({"kind": "columns", "column": 2, "skip": 1}, "a header\n 0 7.5\n", False, 7.5),
    ({"kind": "columns", "column": 2, "time": 1}, "0 7\n1 8\n", True, History([0.0, 1.0], [7.0, 8.0])),
    ({"kind": "columns", "characters": [3, 6]}, "ab12.5cd\n", False, 12.5),
    (
        {"kind": "columns", "characters": [2, 3], "time_characters": [1, 1]},
        "011\n122",
        True,
        History([0, 1], [11, 22]),
    ),
    ({"kind": "columns", "characters": [2, 3]}, "011\n122\n", True, History([0, 1], [11, 22])),
    ({"kind": "regex", "pattern": r"peak = (\S+)"}, "peak = 1\npeak = 2e3\n", False, 2000.0),
    ({"kind": "regex", "pattern": r"peak = (\S+)", "which": "first"}, "peak = 1\npeak = 2\n", False, 1.0),
    ({"kind": "request", "request": "belt", "column": "FX"}, REQUESTS, True, History([0, 1], [1, -5.5])),
    ({"kind": "request", "request": "head", "column": "DX"}, REQUESTS, False, 3.0),
]  # fmt: skip


@pytest.mark.parametrize(("rule", "text", "history", "found"), READ)
def test_readers(tmp_path, rule, text, history, found):
    (tmp_path / "out").write_text(text)
    got = read_response({**rule, "file": "out"}, tmp_path, tmp_path, history=history)
    assert (tuple(got) if isinstance(found, tuple) else got) == found


WRONG = [
    ({"kind": "json", "key": "a.c"}, '{"a": {"b": 1}}', False, r"out has no 'a.c' \(at 'c'\)"),
    ({"kind": "json", "key": "a"}, "{", False, "out is not JSON"),
    ({"kind": "json", "key": "a"}, "[" * 100_000, False, "out is not JSON"),
    ({"kind": "csv", "column": "F"}, "t,G\n0,1\n", False, "out has no column 'F'; it has t, G"),
    ({"kind": "csv", "column": "F"}, "t,F\n0,1\n1,2\n", False, "out holds 2 values; say which with reduce"),
    ({"kind": "csv", "column": "F"}, "t,F\n0\n", True, "a row of 1 cells under 2 columns; was it cut off"),
    ({"kind": "csv", "column": "F"}, "t,F\n0,abc\n", True, "out: 'abc' is no number"),
    ({"kind": "csv", "column": "F"}, "", True, "out is empty"),
    ({"kind": "columns", "column": 3}, "1 2\n", False, "out has lines without a column 3"),
    ({"kind": "columns", "characters": [9, 12]}, "1 2\n", False, "out: '' is no number"),
    ({"kind": "regex", "pattern": "peak (.*)"}, "nothing", False, "out: nothing matches 'peak "),
    (
        {"kind": "request", "request": "x", "column": "y"},
        REQUESTS,
        True,
        "has no request 'x'; it has belt, head",
    ),
    (
        {"kind": "request", "request": "q", "column": "y"},
        "REQUEST q\nFX\n",
        True,
        "names that begins with TIME",
    ),
]


@pytest.mark.parametrize(("rule", "text", "history", "words"), WRONG)
def test_readers_say_what_is_wrong(tmp_path, rule, text, history, words):
    (tmp_path / "out").write_text(text)
    with pytest.raises(EvaluationFailed, match=words):
        read_response({**rule, "file": "out"}, tmp_path, tmp_path, history=history)


def test_readers_and_files_that_are_none(tmp_path, monkeypatch):
    rule = {"kind": "json", "key": "a", "file": "out"}
    with pytest.raises(EvaluationFailed, match="the run left no result file out"):
        read_response(rule, tmp_path, tmp_path, history=False)
    (tmp_path / "out").write_bytes(bytes(range(256)))
    with pytest.raises(EvaluationFailed, match="the result file out is not text"):
        read_response(rule, tmp_path, tmp_path, history=False)
    monkeypatch.setattr("workbench.models.readers.LARGEST", 10)
    with pytest.raises(EvaluationFailed, match="has 256 bytes or is no file; at most 10 are read"):
        read_response(rule, tmp_path, tmp_path, history=False)


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ({"kind": "json", "file": "o"}, "read of kind 'json' needs key; its keys are file, key"),
        ({"kind": "json", "file": "o", "key": "a", "column": 3}, "takes no column"),
        ({"kind": "columns", "file": "o"}, "needs column or characters"),
        ({"kind": "columns", "file": "o", "characters": [3, 1]}, r"needs first and last, such as \[11, 22\]"),
        (
            {"kind": "columns", "file": "o", "column": "F"},
            "column is the number of a column, from 1, got 'F'",
        ),
        ({"kind": "csv", "file": "o", "column": 3}, "column is the name of a column, got 3"),
        ({"kind": "regex", "file": "o", "pattern": "("}, "unterminated subpattern|missing"),
    ],
)
def test_rules_are_checked_with_the_study(rule, words):
    with pytest.raises(StudyError, match=words):
        checked_rule("y", rule, reduced=False)
    with pytest.raises(StudyError, match="finds one number; leave reduce out"):
        checked_rule("y", {"kind": "regex", "file": "o", "pattern": "a"}, reduced=True)


STUDY = """
[study]
name = "s"
[model]
kind = "command"
command = {command}
{more}
[[parameter]]
name = "a"
lower = 0
upper = 10
[[response]]
name = "y"
read = {{ kind = "json", file = "out.json", key = "y" }}
[evaluate]
timeout = 5.0
"""
SOLVER = """
import json, os, signal, subprocess, sys, time
a = float(open("in.txt").read()) if len(sys.argv) < 2 else float(sys.argv[1])
print("solving", a)
if a == 1: sys.exit(4)
if a == 2: os.kill(os.getpid(), signal.SIGSEGV)
if a == 3: sys.exit(0)
if a == 4: subprocess.Popen(["sleep", "500"])
open("out.json", "w").write(json.dumps({"y": a * a}))
"""


def open_study(folder, command, more="", solver=SOLVER):
    (folder / "solve.py").write_text(solver)
    (folder / "s.toml").write_text(STUDY.format(command=json.dumps(command), more=more))
    return Campaign.from_file(folder / "s.toml")


def test_a_command_is_run_in_a_folder_of_its_own(tmp_path):
    with open_study(tmp_path, ["{python}", "{study}/solve.py", "{a}"]) as campaign:
        rows = campaign.evaluate([{"a": float(k)} for k in range(6)])
        work = campaign.folder / "work"
        assert sorted(p.name for p in work.iterdir()) == sorted(
            rows[k].key for k in (1, 2, 3)
        )  # kept on failure
    assert [row.status for row in rows] == ["ok", "failed", "killed", "failed", "ok", "ok"]
    assert [row.outputs.get("y") for row in rows] == [0.0, None, None, None, 16.0, 25.0]
    python = Path(rows[1].error.split()[0]).name
    assert rows[1].error == f"{python} ended with exit code 4 (kept in work/{rows[1].key})"
    assert rows[1].log == "solving 1.0"
    assert "was ended by signal 11" in rows[2].error
    assert "the run left no result file out.json" in rows[3].error


def test_several_commands_share_decks_files_and_environment(tmp_path):
    (tmp_path / "in.tmpl").write_text("{{ a }}")
    (tmp_path / "factor.txt").write_text("7")
    more = (
        'templates = [{ from = "in.tmpl", to = "sub/in.txt" }]\nfiles = ["factor.txt"]\n'
        'environment = { OFFSET = "100" }\n'
    )
    code = (
        "import json, os\n"
        "y = float(open('sub/in.txt').read()) * float(open('factor.txt').read())\n"
        "y += float(os.environ['OFFSET'])\n"
        "open('half.json', 'w').write(json.dumps({'y': y}))"
    )
    commands = [["{python}", "{study}/solve.py"], ["cp", "half.json", "out.json"]]
    with open_study(tmp_path, commands, more, code) as campaign:
        assert campaign.evaluate([{"a": 3.0}])[0].outputs == {"y": 121.0}


@pytest.mark.parametrize(
    ("command", "more", "words"),
    [
        (["no_such_program_at_all"], "", "no program 'no_such_program_at_all'; give its path"),
        (["{python}", "{b}"], "", "command argument '{b}' names 'b', which is no parameter, study or python"),
        (["{python}"], 'files = ["gone.txt"]', "no file .*gone.txt to copy"),
        (["{python}"], 'templates = [{ from = "gone", to = "x" }]', "template gone cannot be read"),
        (["{python}"], 'templates = [{ from = "bad.tmpl", to = "x" }]', "template bad.tmpl names 'z'"),
    ],
)
def test_commands_that_cannot_run_are_refused_before_any_run(tmp_path, command, more, words):
    (tmp_path / "bad.tmpl").write_text("{{ z }}")
    with open_study(tmp_path, command, more) as campaign, pytest.raises(StudyError, match=words):
        campaign.evaluate([{"a": 3.0}])


def test_reading_rules_belong_to_commands(tmp_path):
    text = STUDY.format(command='["true"]', more="").replace("read = {", "reed = {")
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(StudyError, match=r"unknown key response\[1\].reed. Did you mean 'read'"):
        load_study(tmp_path / "s.toml")
    text = "\n".join(
        line for line in STUDY.format(command='["true"]', more="").splitlines() if "read" not in line
    )
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(StudyError, match="read goes with model kind 'command', which needs it"):
        load_study(tmp_path / "s.toml")
    text = STUDY.format(command='["true"]', more='templates = [{ frm = "a", to = "b" }]')
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(StudyError, match=r"unknown key model.templates\[1\].frm. Did you mean 'from'"):
        load_study(tmp_path / "s.toml")


def test_a_changed_deck_is_a_changed_model(tmp_path):
    (tmp_path / "in.tmpl").write_text("{{ a }}")
    more = 'templates = [{ from = "in.tmpl", to = "in.txt" }]'
    with open_study(tmp_path, ["{python}", "{study}/solve.py"], more) as campaign:
        campaign.evaluate([{"a": 5.0}])
    (tmp_path / "in.tmpl").write_text("{{ 2 * a }}")
    with pytest.raises(StudyError, match="the source of the model changed after 1 runs"):
        Campaign.from_file(tmp_path / "s.toml")


@pytest.fixture
def loop(tmp_path):
    """The shipped example, copied."""
    here = Path(studies.__file__).parent / "adams_loop"
    shutil.copytree(here, tmp_path / "loop", ignore=shutil.ignore_patterns("*.holdfast", "__pycache__"))
    return tmp_path / "loop" / "loop.toml"


def test_the_loop_of_figure_8_26(loop):
    with Campaign.from_file(loop, workers=1) as campaign:
        space = campaign.study.space
        points = [np.full(5, 0.5), [0.5, 0.5, 0.5, 1, 1], [0.5, 0.5, 1, 0.5, 0.5]]
        rows = campaign.evaluate(space.rows(np.vstack(points)))
        assert [row.status for row in rows] == ["ok"] * 3
        middle, slack, stiff = (row.outputs for row in rows)
        assert (
            slack["excursion"] > middle["excursion"] > stiff["excursion"]
        )  # a stiffer belt without slack holds
        data = campaign.history(rows[0].key)
        assert data["excursion"].sizes == {"time_excursion": 501}
        assert float(data["excursion"].max()) == rows[0].outputs["excursion"]
        assert data["force"].attrs["units"] == "N"
        assert not list((campaign.folder / "work").iterdir())


def test_the_stand_in_solver_conserves_energy():
    text = (Path(solver.__file__).parent / "deck.adm.tmpl").read_text()
    row = {"hip": 100.0, "neck": 60.0, "belt": 30000.0, "slack": 0.02, "peak": 100.0}
    deck = solver.parse(compiled(text, list(row), style="jinja", what="deck")(row))
    for part in ("HIP", "NECK", "CHEST"):
        deck[part]["C"] = 0.0
    deck["RUN"].update(STEPS=4000, END=2.0)
    rows = np.array(solver.motion(deck))
    t, a, b = rows[:, 0], rows[:, 1], rows[:, 2]
    va, vb = np.gradient(a, t), np.gradient(b, t)
    m1, l1, m2, l2 = 35.0, 0.55, 5.5, 0.28
    kinetic = 0.5 * (m1 * l1**2 / 3 + m2 * l1**2) * va**2 + m2 * l2**2 / 6 * vb**2
    kinetic += 0.5 * m2 * l1 * l2 * np.cos(a - b) * va * vb
    potential = 9.81 * ((m1 / 2 + m2) * l1 * np.cos(a) + 0.5 * m2 * l2 * np.cos(b))
    potential += 50 * a**2 + 30 * (b - a) ** 2 + 15000 * np.maximum(0.4 * np.sin(a) - 0.02, 0) ** 2
    energy = (kinetic + potential)[t > 0.1][:-1]  # after the pulse
    assert np.ptp(energy) < ENERGY * energy.mean()


def test_the_stand_in_solver_refuses_wrong_decks():
    with pytest.raises(SystemExit, match="line 1 is no statement: nonsense"):
        solver.parse("nonsense")
    with pytest.raises(SystemExit, match=r"the deck lacks TORSO.MASS"):
        solver.parse("PART/ TORSO, LENGTH = 3\nEND")
