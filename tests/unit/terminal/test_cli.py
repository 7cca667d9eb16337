"""The command line: what loads, what is printed, and the exit codes 0, 2, 3, 4 and 5."""

import json
import os
import re
import signal
import subprocess
import sys
from importlib.metadata import version

import pytest

HEAVY = {"numpy", "pandas", "xarray", "matplotlib", "sklearn", "scipy", "numba", "pydantic", "jinja2", "doe"}


def holdfast(*arguments, cwd=None):
    """The finished command."""
    return subprocess.run(
        [sys.executable, "-m", "workbench", *map(str, arguments)],
        cwd=cwd,
        capture_output=True,
        text=True,
        timeout=120,
        env={**os.environ, "COLUMNS": "80", "PYTHONPATH": os.getcwd()},
    )


def in_process(*arguments, capsys):
    """Exit code, output and errors of the command, run here: quicker than a new interpreter."""
    from workbench.terminal.cli import main

    before, handler = sys.argv, signal.getsignal(signal.SIGTERM)
    sys.argv = ["holdfast", *map(str, arguments)]
    try:
        main()
        code = 0
    except SystemExit as exc:
        code = exc.code or 0
    finally:
        sys.argv = before
        signal.signal(signal.SIGTERM, handler)
    out, err = capsys.readouterr()
    return code, out, err


STUDY = """
[study]
name = "s"
[model]
kind = "{kind}"
{model}
[[parameter]]
name = "a"
lower = 0
upper = 1
unit = "N"
[[response]]
name = "y"
unit = "mm"
[evaluate]
timeout = 20
{more}
"""


def write_study(folder, *, kind="python", model='function = "m.py:f"', more="", code="def f(a): return a"):
    (folder / "m.py").write_text(code)
    (folder / "s.toml").write_text(STUDY.format(kind=kind, model=model, more=more))
    return folder / "s.toml"


def test_help_loads_nothing_heavy():
    code = (
        "import sys; sys.argv = ['holdfast', '--help']\n"
        "from workbench.terminal.cli import main\n"
        "try: main()\n"
        "except SystemExit: pass\n"
        "print('LOADED', *sys.modules)"
    )
    text = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    head, loaded = text.split("LOADED")
    assert "worst-case" in head
    assert not HEAVY & {name.split(".")[0] for name in loaded.split()}


COMMANDS = ["run", "design", "tell", "screen", "worst-case", "report", "validate", "plan", "doctor", "demo"]


def test_every_command_has_help(capsys):
    code, out, _ = in_process("--help", capsys=capsys)
    assert code == 0
    for command in COMMANDS:
        assert command in out
        code, text, _ = in_process(command, "--help", capsys=capsys)
        assert code == 0
        assert "--json" in text
        assert max(map(len, text.splitlines())) <= 80


def test_one_line_says_what_a_command_does(capsys):
    _, out, _ = in_process("--help", capsys=capsys)
    assert "..." not in out.split("Commands:")[1]
    assert max(map(len, out.splitlines())) <= 80


def test_the_version_is_told(capsys):
    code, out, _ = in_process("--version", capsys=capsys)
    assert (code, out) == (0, f"holdfast {version('holdfast')}\n")


def test_screening_methods_are_listed_with_what_they_cannot_see(tmp_path, capsys):
    code, out, _ = in_process("screen", "--method", "list", capsys=capsys)  # before there is a study
    assert code == 0
    for name in ("default", "sobol", "src", "prcc", "hsic", "morris"):
        assert f"\n{name} " in f"\n{out}"
    assert out.count("cannot see") == out.count("needs ") == 12
    path = write_study(tmp_path)
    code, out, _ = in_process("screen", path, "--method", "list", "--json", capsys=capsys)
    assert [one["name"] for one in json.loads(out)["methods"]][:2] == ["default", "forward"]


def test_all_other_screenings_need_a_study(capsys):
    for words in ((), ("--method", "rivals"), ("--response", "y")):
        code, _, err = in_process("screen", *words, capsys=capsys)
        assert code == 2
        assert "screen needs a study file, such as: holdfast screen study.toml" in err


def test_wrong_usage_is_two():
    done = holdfast("rum")
    assert done.returncode == 2
    assert "No such command 'rum'" in done.stderr
    assert holdfast("run").returncode == 2
    assert "Traceback" not in done.stderr


def test_a_wrong_file_is_two_with_its_line(tmp_path, capsys):
    path = write_study(tmp_path, more="[worst_case]\nresponse = 'y'\nbudgt = 3")
    code, out, err = in_process("run", path, capsys=capsys)
    assert code == 2
    assert err == "holdfast: s.toml, line 19: unknown key worst_case.budgt. Did you mean 'budget'?\n"
    code, out, err = in_process("run", path, "--json", capsys=capsys)
    assert (code, json.loads(out)["exit_code"]) == (2, 2)


@pytest.mark.parametrize("command", [["validate"], ["run"]])
def test_a_function_that_does_not_exist_is_two(tmp_path, capsys, command):
    path = write_study(tmp_path, model='function = "m.py:g"', more='[design]\nkind = "table"\nfile = "p.csv"')
    (tmp_path / "p.csv").write_text("a\n0\n0.5\n1\n")
    code, _, err = in_process(*command, path, capsys=capsys)
    assert code == 2
    assert "function 'm.py:g': m.py has no 'g'" in err
    assert "Traceback" not in err


def test_design_tell_and_plan_on_a_model_of_somebody_else(tmp_path, capsys):
    (tmp_path / "p.csv").write_text("a\n0\n0.5\n1\n")
    path = write_study(tmp_path, kind="ask", model="", more='[design]\nkind = "table"\nfile = "p.csv"')
    code, out, err = in_process("design", path, "--csv", tmp_path / "ask.csv", capsys=capsys)
    assert (code, out.splitlines()[0]) == (0, "3 runs of 1 parameter (table), 3 without an answer")
    rows = (tmp_path / "ask.csv").read_text().splitlines()
    (tmp_path / "done.csv").write_text(
        "\n".join([rows[0], *(f"{row}{k}.5" for k, row in enumerate(rows[1:3]))])
    )
    code, out, err = in_process("run", path, capsys=capsys)
    assert code == 4
    assert "3 runs wait for their results" in err
    code, out, err = in_process("tell", path, tmp_path / "done.csv", "--json", capsys=capsys)
    assert (code, json.loads(out)["waiting"]) == (0, 1)
    code, out, err = in_process("plan", path, capsys=capsys)
    assert code == 0
    assert "2 ok, 1 queued" in out
    code, out, err = in_process("plan", path, "--json", capsys=capsys)
    assert json.loads(out)["stored"] == {"ok": 2, "queued": 1}


def answered(path):
    """Fill the empty responses of a CSV of asked rows: y = a (1 - a)."""
    head, *rows = path.read_text().splitlines()
    assert head == "key,a,y"
    values = [float(row.split(",")[1]) for row in rows]
    path.write_text("\n".join([head, *(f"{r}{a * (1 - a)}" for r, a in zip(rows, values, strict=True))]))
    return len(rows)


def test_a_search_asks_somebody_else_without_a_design(tmp_path, capsys):
    path = write_study(tmp_path, kind="ask", model="", more='[worst_case]\nresponse = "y"\nbudget = 5')
    code, out, _ = in_process("design", path, capsys=capsys)
    assert code == 0
    assert f"no run waits for its result; `holdfast run {path}` goes on" in out
    csv, asked = tmp_path / "ask.csv", 0
    for _ in range(5):
        code, out, err = in_process("run", path, capsys=capsys)
        if code == 0:
            break
        assert (code, "`holdfast design` lists them" in err) == (4, True)
        code, out, _ = in_process("design", path, "--csv", csv, capsys=capsys)
        assert code == 0
        assert re.search(r"^[0-9a-f]{10}  a = \S+$", out, re.MULTILINE)
        assert f"`holdfast tell {path} {csv}` and `holdfast run {path}`" in out
        asked += answered(csv)
        code, out, _ = in_process("tell", path, csv, capsys=capsys)
        assert (code, out.endswith("0 failed; 0 still wait\n")) == (0, True)
    assert code == 0
    assert "Worst case (largest y): 0.25" in out
    assert asked <= 5


def test_rows_that_a_search_waits_for_stand_behind_those_of_the_design(tmp_path, capsys):
    more = '[design]\nkind = "sobol"\nruns = 4\n[worst_case]\nresponse = "y"\nbudget = 2'
    path = write_study(tmp_path, kind="ask", model="", more=more)
    csv = tmp_path / "ask.csv"
    for count in (4, 1):
        code, out, _ = in_process("design", path, "--csv", csv, capsys=capsys)
        assert (code, f"4 runs of 1 parameter (sobol), {count} without an answer" in out) == (0, True)
        assert answered(csv) == count
        assert in_process("tell", path, csv, capsys=capsys)[0] == 0
        code, _, err = in_process("run", path, capsys=capsys)
        assert (code, "1 run waits for its result" in err) == (4, True)


def test_many_asked_rows_are_not_all_listed(tmp_path, capsys):
    path = write_study(tmp_path, kind="ask", model="", more='[design]\nkind = "sobol"\nruns = 32')
    code, out, _ = in_process("design", path, capsys=capsys)
    assert code == 0
    assert "and 12 more" in out
    assert f"`holdfast design {path} --csv ask.csv` writes them with all digits;" in out


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("ask", "the study asks for no runs: give it a [design] table for points to run, or a"),
        ("python", "the study has no [design] table; add one, such as [design] runs = 50"),
    ],
)
def test_a_design_that_nobody_described(tmp_path, capsys, kind, words):
    path = write_study(tmp_path, kind=kind, model="" if kind == "ask" else 'function = "m.py:f"')
    code, _, err = in_process("design", path, capsys=capsys)
    assert (code, words in err) == (2, True)


def test_without_a_design_nothing_is_compared_or_drawn(tmp_path, capsys):
    path = write_study(tmp_path, kind="ask", model="", more='[worst_case]\nresponse = "y"')
    for option in (["--compare", "lhs"], ["--quality"]):
        code, _, err = in_process("design", path, *option, capsys=capsys)
        assert (code, "--quality and --compare look at a design; give the study a [design]" in err) == (
            2,
            True,
        )


def test_design_tells_its_quality_and_compares(tmp_path, capsys):
    (tmp_path / "m.py").write_text("def f(**k):\n    return 0.0\n")
    path = tmp_path / "study.toml"
    parameters = "".join(f'[[parameter]]\nname = "p{k}"\nlower = 0\nupper = 1\n' for k in range(3))
    path.write_text(
        '[study]\nname = "q"\n[model]\nkind = "python"\nfunction = "m.py:f"\n'
        f'{parameters}[[response]]\nname = "y"\n[design]\nkind = "optimised_lhs"\nruns = 12\n'
    )
    code, out, _ = in_process("design", path, "--quality", capsys=capsys)
    assert code == 0
    assert re.search(r"phi p +better than 100 % +\d", out)
    assert re.search(r"wd2 +better than", out)
    assert max(map(len, out.splitlines())) <= 80 + len(str(tmp_path)) + 40
    assert (tmp_path / "study.holdfast" / "design_quality.png").read_bytes()[:4] == b"\x89PNG"
    code, out, _ = in_process("design", path, "--compare", "lhs,ihs", capsys=capsys)
    assert code == 0
    assert re.search(r"design quality +optimised_lhs +lhs +ihs", out)
    assert re.search(r"min distance +0\.\d+ \(100 %\) +0\.\d+ \(\d+ %\)", out)
    code, _, err = in_process("design", path, "--compare", "lhx", capsys=capsys)
    assert code == 2
    assert "design kind needs one of lhs, optimised_lhs" in err


def test_a_store_that_cannot_be_used_is_five(tmp_path, capsys):
    path = write_study(tmp_path)
    (tmp_path / "s.holdfast").write_text("in the way")
    code, _, err = in_process("design", path, capsys=capsys)
    assert code == 5
    assert "cannot make the folder" in err


def test_validate_says_what_it_found(tmp_path, capsys):
    path = write_study(tmp_path, more='[design]\nkind = "sobol"\nruns = 4')
    code, out, _ = in_process("validate", path, capsys=capsys)
    assert (code, out) == (0, "s.toml is valid: 1 parameter, 1 response, model python, stages design\n")
    code, out, _ = in_process("validate", path, "--json", capsys=capsys)
    assert json.loads(out)["design"] == {"kind": "sobol", "runs": 4}
    code, out, _ = in_process("validate", "--schema", capsys=capsys)
    assert "parameter" in json.loads(out)["required"]
    code, _, err = in_process("validate", capsys=capsys)
    assert code == 2
    assert "give a study file, or --schema" in err


def test_doctor_examines_the_installation(tmp_path):
    done = holdfast("doctor", "--json", cwd=tmp_path)
    found = json.loads(done.stdout)
    assert done.returncode == 0, found
    assert found["healthy"] is True
    assert {c["check"] for c in found["checks"]} == {"versions", "names", "workers", "store", "extras"}


def test_a_damaged_store_is_examined_mended_and_joined(tmp_path, capsys):
    from workbench.stages.campaign import Campaign

    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    for folder, runs in ((ours, 4), (theirs, 8)):
        folder.mkdir()
        with Campaign.from_file(write_study(folder, more='engine = "inline"')) as campaign:
            campaign.evaluate([{"a": 1 / (k + 3)} for k in range(runs)])
    study, store = ours / "s.toml", ours / "s.holdfast" / "runs.sqlite"
    code, out, _ = in_process("merge", study, theirs / "s.holdfast", "--json", capsys=capsys)
    assert code == 0
    found = json.loads(out)
    assert (found["joined"], found["same"]) == (4, 4)
    code, out, _ = in_process("doctor", "--store", study, capsys=capsys)
    assert (code, out.count("BAD")) == (0, 0)
    assert "ok   checksums   8 runs and " in out
    data = bytearray(store.read_bytes())
    at = data.rindex(b'{"a": ')
    data[at + 8] ^= 1
    store.write_bytes(data)
    code, out, _ = in_process("doctor", "--store", ours / "s.holdfast", "--json", capsys=capsys)
    (state,) = json.loads(out)
    assert (code, state["sound"]) == (5, False)
    code, out, _ = in_process("doctor", "--store", study, capsys=capsys)
    assert "BAD  to recover  7 answered runs are whole, 1 damaged; `holdfast recover` saves\n" in out
    assert all(len(line) <= 80 for line in out.splitlines()[1:])  # the first is the path
    place = tmp_path / "out"
    code, _, err = in_process("export", study, "--output", place, capsys=capsys)
    assert code == 5
    assert "is damaged: run " in err
    assert "Free space" not in err  # the disk is not to blame
    code, _, err = in_process("design", study, capsys=capsys)
    assert code == 5
    assert "not as they were stored: 1 row of evaluation" in err
    for verb in ("failures", "watch", "plan"):
        options = ["--once"] if verb == "watch" else []
        assert "Traceback" not in in_process(verb, study, *options, capsys=capsys)[2]
    code, out, _ = in_process("recover", study, capsys=capsys)
    assert code == 0
    assert "each as its checksum says" in out
    code, out, _ = in_process("doctor", "--store", study, capsys=capsys)
    assert (code, out.count("BAD")) == (0, 0)
    with Campaign.from_file(study) as campaign:
        assert len(campaign.runs()) == 7


@pytest.mark.parametrize("verb", ["failures", "export", "report", "plan"])
def test_a_look_at_a_folder_without_a_campaign_makes_none(tmp_path, capsys, verb):
    study, folder = write_study(tmp_path), tmp_path / "mistyped"
    code, _, err = in_process(verb, study, "--folder", folder, capsys=capsys)
    assert not folder.exists()
    if verb != "plan":  # which tells what would be done
        assert code == 5
        assert f"no database {folder / 'runs.sqlite'}; `holdfast run` makes it" in err


def test_a_file_has_long_lines_whole(tmp_path, capsys):
    study = write_study(tmp_path)
    folder = tmp_path / ("long" * 20)
    assert in_process("design", study, "--folder", folder, capsys=capsys)[0] == 2
    _, out, _ = in_process("plan", study, "--folder", folder, capsys=capsys)
    assert f"stored in {folder}: none" in out.splitlines()


def test_a_refusal_stays_within_the_columns_of_a_terminal(tmp_path, capsys, monkeypatch):
    study = write_study(tmp_path)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "60")
    code, _, err = in_process("show", study, "99", "--folder", "mistyped", capsys=capsys)
    assert code == 5
    first, *rest = err.splitlines()
    assert first.startswith("holdfast: no database mistyped/runs.sqlite;")
    assert all(line.startswith("  ") for line in rest)
    assert rest
    assert max(map(len, err.splitlines())) <= 60


LONG = """def f(a):
    if a > 0.5:
        raise ValueError("the solver lost its way between the third and the fourth step of the second stage")
    return 3 * a
"""


def test_what_is_printed_stays_within_80_columns(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    more = 'engine = "inline"\n[design]\nkind = "lhs"\nruns = 12\n[screen]\nresponse = "y"'
    study = write_study(tmp_path, code=LONG, more=more)
    verbs = [("run",), ("plan",), ("failures",), ("show", 12), ("screen",), ("screen", "--method", "src")]
    for verb, *words in verbs:
        code, out, err = in_process(verb, study, *words, capsys=capsys)
        assert code in (0, 3), err
        for line in out.splitlines():
            assert len(line) <= 80 or len(max(line.split(), key=len)) > 70, line
