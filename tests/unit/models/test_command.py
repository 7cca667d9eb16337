"""Command models: runs in folders of their own, and the loop of figure 8.26."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

import studies
from studies.adams_loop import solver
from workbench.campaign.results.failures import failure_document, failure_lines
from workbench.errors import StudyError
from workbench.models.opening import open_model
from workbench.models.template import compiled
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study

ENERGY = 5e-4  # relative: the speeds are differences of the written angles, coarse where the belt catches

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


@pytest.mark.parametrize(("more", "threads"), [("", 0.0), ('environment = { OMP_NUM_THREADS = "4" }', 4.0)])
def test_threads_that_holdfast_sets_for_itself_do_not_reach_a_program(tmp_path, monkeypatch, more, threads):
    monkeypatch.setenv("OMP_NUM_THREADS", "1")
    monkeypatch.setenv("HOLDFAST_SET_THREADS", "OMP_NUM_THREADS")
    code = (
        "import json, os\n"
        "y = float(os.environ.get('OMP_NUM_THREADS', 0)) + 10 * ('HOLDFAST_SET_THREADS' in os.environ)\n"
        "open('out.json', 'w').write(json.dumps({'y': y}))"
    )
    with open_study(tmp_path, ["{python}", "{study}/solve.py", "{a}"], more, code) as campaign:
        assert campaign.evaluate([{"a": 3.0}])[0].outputs == {"y": threads}


@pytest.mark.parametrize(
    ("command", "more", "words"),
    [
        (
            ["./solve.py", "{a}"],
            "",
            r"line 6: './solve.py' is looked for in the folder of each run, where it is not; write "
            r"'{study}/solve.py' for the one beside the study file, or have it copied by files = \['solve.p",
        ),
        (["solve.py", "{a}"], "", "line 6: no program 'solve.py'; give its path, '{study}/...' for one bes"),
        (["sh", "solve.py", "{a}"], "", "line 6: 'solve.py' is looked for in the folder of each run"),
        (
            ["{study}/solve.py", "{a}"],
            "",
            "solve.py' may not be executed; allow it by `chmod .x`, or begin the",
        ),
        (["./solve.py", "{a}"], 'files = ["solve.py"]', "'./solve.py' may not be executed; allow it"),
        (["no_such_program_at_all"], "", "line 6: no program 'no_such_program_at_all'; give its path"),
        (
            ["{python}", "{b}"],
            "",
            r"line 6: command argument '{b}' holds {b}, which stands for nothing; known are {study}, {pyth",
        ),
        (["{python}", "{dd.in}"], "", r"argument '{dd.in}' holds {dd.in}, which stands for nothing"),
        (["{python}", "-k{ a }"], "", r"argument '-k{ a }' holds { a }, which stands for nothing"),
        (["{python}", "{a:.3f}"], "", r"argument '{a:.3f}' holds {a:.3f}, which stands for nothing"),
        (
            ["{python}", "-u", "{study}/gone.py", "{a}"],
            "",
            "line 6: no file .*gone.py, which the command names as '{study}/gone.py'",
        ),
        (["{python}"], 'files = ["gone.txt"]', "line 7: no file .*gone.txt to copy"),
        (["{python}"], 'templates = [{ from = "gone", to = "x" }]', "line 7: template gone cannot be read"),
        (
            ["{python}"],
            'templates = [{ from = "bad.tmpl", to = "x" }]',
            "s.toml, line 7: template bad.tmpl names 'z'",
        ),
        (
            ["{python}"],
            '[[model.templates]]\nfrom = "good.tmpl"\nto = "y"\n'
            '[[model.templates]]\nfrom = "bad.tmpl"\nto = "x"',
            "s.toml, line 10: template bad.tmpl names 'z'",
        ),
    ],
)
def test_commands_that_cannot_run_are_refused_before_any_run(tmp_path, command, more, words):
    (tmp_path / "good.tmpl").write_text("{{ a }}")
    (tmp_path / "bad.tmpl").write_text("{{ z }}")
    with open_study(tmp_path, command, more) as campaign, pytest.raises(StudyError, match=words):
        campaign.evaluate([{"a": 3.0}])


@pytest.mark.parametrize(
    ("command", "more", "words"),
    [
        (["true"], "", r"no {{ a }} in a template \(there is none\), no {a} in an argument of the command"),
        (
            ["true"],
            'templates = [{ from = "in.tmpl", to = "in.txt" }]',
            r"no {{ a }} in a template \(in.tmpl\), no {a} in an argument",
        ),
    ],
)
def test_a_parameter_that_never_reaches_the_solver_is_refused(tmp_path, command, more, words):
    (tmp_path / "in.tmpl").write_text("stiffness 12.5 {# {{ a }} #}")
    found = rf"s.toml, line \d+: parameter 'a' never reaches the solver: {words}"
    with open_study(tmp_path, command, more) as campaign, pytest.raises(StudyError, match=found):
        campaign.evaluate([{"a": 3.0}])
    two = (tmp_path / "s.toml").read_text() + '[[parameter]]\nname = "b"\nlower = 0\nupper = 1\n'
    (tmp_path / "s.toml").write_text(two)
    with pytest.raises(StudyError, match="parameters 'a', 'b' never reach the solver"):
        open_model(load_study(tmp_path / "s.toml").spec(version="1"))


@pytest.mark.parametrize("deck", ["{% if a > 2 %}stiff{% else %}soft{% endif %}", "{{ a * 2 }}"])
def test_a_parameter_that_decides_or_is_reckoned_with_reaches_the_solver(tmp_path, deck):
    (tmp_path / "in.tmpl").write_text(deck)
    write = 'import json; open("out.json", "w").write(json.dumps({"y": len(open("in.txt").read())}))'
    more = 'templates = [{ from = "in.tmpl", to = "in.txt" }]'
    with open_study(tmp_path, ["{python}", "{study}/solve.py"], more, write) as campaign:
        assert campaign.evaluate([{"a": 3.0}])[0].status == "ok"


def test_the_beginning_of_a_name_and_braces_of_others_stand_in_arguments(tmp_path):
    (tmp_path / "mesh.node").write_text("")
    write = 'import sys; open("out.json", "w").write(sys.argv[1])'
    command = ["{python}", "{study}/solve.py", '{"y": {a}}', "{study}/mesh", "{2,3}", "{study}/runs/*"]
    with open_study(tmp_path, command, solver=write) as campaign:
        assert campaign.evaluate([{"a": 3.0}])[0].outputs == {"y": 3.0}


def test_a_parameter_may_have_a_letter_of_any_alphabet(tmp_path):
    write = 'import sys; open("out.json", "w").write(open("in.txt").read() + sys.argv[1] + "}")'
    (tmp_path / "in.tmpl").write_text('{"y": 1{θ}')
    more = 'templates = [{ from = "in.tmpl", to = "in.txt", style = "dakota" }]'
    with open_study(tmp_path, ["{python}", "{study}/solve.py", "{θ}"], more, write) as campaign:
        text = campaign.study.text.replace('name = "a"', 'name = "θ"\nkind = "integer"')
    (tmp_path / "s.toml").write_text(text)
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        assert campaign.evaluate([{"θ": 7}])[0].outputs == {"y": 177.0}


def test_a_function_that_reads_results_is_looked_for_before_any_run(tmp_path):
    with open_study(tmp_path, ["{python}", "{study}/solve.py", "{a}"]) as campaign:
        study = campaign.study
    text = study.text.replace(
        'kind = "json", file = "out.json", key = "y"', 'kind = "python", function = "post.py:y"'
    )
    (tmp_path / "s.toml").write_text(text)
    with pytest.raises(
        StudyError, match=r"line 14: no file .*post.py: function 'post.py:y' is looked up beside"
    ):
        open_model(load_study(tmp_path / "s.toml").spec(version="1"))


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
    with pytest.raises(StudyError, match="the source of the model changed after 1 run "):
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


LATE = """
import sys, time
a = float(sys.argv[1])
print("reading deck of", a)
print("x" * 9000)
print("*** ERROR: step", 7 * a, "did not converge")
print("see the manual", flush=True)
if a > 5: time.sleep(600)
sys.exit(3)
"""


def test_failures_are_told_by_the_solvers_own_words(tmp_path):
    (tmp_path / "solve.py").write_text(LATE)
    text = STUDY.format(command=json.dumps(["{python}", "{study}/solve.py", "{a}"]), more="")
    (tmp_path / "s.toml").write_text(text.replace("timeout = 5.0", "timeout = 1.0\nworkers = 2"))
    with Campaign.from_file(tmp_path / "s.toml") as campaign:
        rows = campaign.evaluate([{"a": float(k)} for k in (1, 2, 9)])
        document = failure_document(campaign.runs(), campaign.study.space)
        late = rows[-1]
        assert late.status == "timeout"
        assert late.error == f"no answer within 1 s (kept in work/{late.key})"
        assert (campaign.folder / "work" / late.key / "output.log").exists()
        for row in rows:
            assert row.log.startswith("reading deck of"), "the beginning of the log"
            assert "bytes are left out" in row.log
            assert row.log.endswith("see the manual"), "and its end"
            assert len(row.log) < 6000
    assert list(document["errors"].values()) == [2, 1]
    first, second = document["errors"]
    assert re.fullmatch(r"python\S* ended with exit code 3: \*\*\* ERROR: step … did not converge", first)
    assert second.startswith("no answer within 1 s: *** ERROR: step 63.0")
    assert rows[1].as_outcome().error.endswith("exit code 3: *** ERROR: step 14.0 did not converge")


CRASHES = """
import sys
a = float(sys.argv[1])
print("contact of the wheels is solved by Lemke's method, which takes its time and prints very long lines")
if a < 2: raise ValueError(f"negative load {a}")
print("licence is used up")
sys.exit(9)
"""


def test_a_missing_or_broken_script_is_told_by_its_last_telling_line(tmp_path):
    with open_study(tmp_path, ["{python}", "{study}/solve.py", "{a}"], solver=CRASHES) as campaign:
        campaign.evaluate([{"a": float(k)} for k in range(3)])
        document = failure_document(campaign.runs(), campaign.study.space)
        lines = failure_lines(document)
        key = campaign.runs()[0].key
    assert list(document["errors"].values()) == [2, 1]
    crashed, refused = document["errors"]
    assert crashed.endswith("ended with exit code 1: ValueError: negative load …")
    assert refused.endswith("ended with exit code 9: licence is used up")
    assert f"    kept in work/{key}" in lines
    (tmp_path / "s").mkdir()
    with open_study(tmp_path / "s", ["{python}", "nobody.py", "{a}"]) as campaign:
        campaign.evaluate([{"a": 0.0}])
        (cause,) = failure_document(campaign.runs(), campaign.study.space)["errors"]
    assert re.search(r"exit code 2: .*can't open file", cause)


def test_a_script_that_is_copied_or_made_is_run_in_the_folder_of_the_run(tmp_path):
    write = '#!/bin/sh\necho "{\\"y\\": $1}" > out.json\n'
    (tmp_path / "deck.sh").write_text(write)
    for command, more in (
        (["./solve.py", "{a}"], 'files = ["solve.py"]'),
        (["sh", "solve.py", "{a}"], 'files = ["solve.py"]'),
        (["sh", "deck.sh", "{a}"], 'templates = [{ from = "deck.sh", to = "deck.sh" }]\nversion = "2"'),
    ):
        campaign = open_study(tmp_path, command, more, write)
        (tmp_path / "solve.py").chmod(0o755)
        with campaign:
            assert campaign.evaluate([{"a": 3.0}])[0].outputs == {"y": 3.0}
        shutil.rmtree(tmp_path / "s.holdfast")
