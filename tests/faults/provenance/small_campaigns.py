"""Small campaigns of every kind of model with one stored run, and what opening one makes of that run."""

import shutil
import subprocess

import pytest

from workbench.errors import StudyError
from workbench.stages.campaign import Campaign

ROW = {"a": 0.5, "b": 1.0}
PARAMETERS = (
    '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n[[parameter]]\nname = "b"\nlower = 0\nupper = 2\n'
)
END = '[evaluate]\nengine = "inline"\nworkers = 1\n'
STATE = '[model.state]\ninclude = ["maps/*"]\nenvironment = ["GAIN_OF_TEST"]\n'
PYTHON = {
    "m.py": "import pathlib, sys\nsys.path.insert(0, str(pathlib.Path(__file__).parent / 'shared' / 'lib'))\n"
    "import on_path\nimport helper\nfrom pkg.inner import scale\nimport numpy\nimport extra\n"
    'HERE = pathlib.Path(__file__).parent\ntable = open(HERE / "table.csv").read()\n'
    'gains = (HERE / "data" / "gain.toml").read_text()\n'
    "def f(a, b):\n    return helper.twice(a) + scale(b)\n",
    "slope.py": "def gradient(a, b):\n    return {'a': 2.0, 'b': 3.0}\n",
    "helper.py": "import deeper\ndef twice(a, *, times=2):\n    return times * deeper.same(a)\n",
    "deeper.py": '"""Deep."""\ndef same(a):\n    return a\n',
    "pkg/__init__.py": "",
    "pkg/inner.py": "from . import constants\ndef scale(b):\n    return constants.SCALE * b\n",
    "pkg/constants.py": "SCALE = 3.0\n",
    "shared/lib/on_path.py": "import on_path_too\n",
    "shared/lib/on_path_too.py": "x = 1\n",
    "shared/lib/unrelated.py": "x = 1\n",
    "table.csv": "1,2\n",
    "data/gain.toml": "gain = 1.5\n",
    "maps/road.dat": "0 0\n",
    "unrelated.py": "x = 1\n",
    "notes.md": "first\n",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "m.py:f"\n'
    'gradient = "slope.py:gradient"\n' + STATE + PARAMETERS + '[[response]]\nname = "y"\n' + END,
}
COMMAND = {
    "solver.py": "import solver_parts\nsolver_parts.run()\n",
    "solver_parts.py": "def run():\n    pass\n",
    "wrapper.sh": '#!/bin/sh\nexec "$@"\n',
    "tool.py": "#!/usr/bin/env python3\nimport tool_parts\n",
    "tool_parts.py": "x = 1\n",
    "deck.tpl": "k = {{ a }}\n.include part.inc\n",
    "part.inc": "m = 1\n",
    "maps/road.dat": "0 0\n",
    "mesh/fine.msh": "1\n",
    "post.py": "import post_parts\ndef peak(work):\n"
    "    return post_parts.ONE + float((work / 'o.csv').read_text()[4])\n",
    "post_parts.py": "ONE = 1.0\n",
    "unrelated.py": "x = 1\n",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "command"\n'
    'command = [["{python}", "-E", "{study}/solver.py", "{a}"], ["sh", "{study}/wrapper.sh"], '
    '["{study}/tool.py", "--mesh={study}/mesh"]]\nfiles = ["part.inc"]\nkeep = ["*.csv"]\n'
    'templates = [{ from = "deck.tpl", to = "deck.txt" }]\nenvironment = { THREADS = "1" }\n'
    + STATE
    + PARAMETERS
    + '[[response]]\nname = "p"\nread = { kind = "python", function = "post.py:peak" }\n'
    '[[response]]\nname = "h"\nreduce = "max"\nread = { kind = "csv", file = "o.csv", column = "h" }\n' + END,
}
FMU = {
    "unit.fmu": "PK unit 1",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "fmu"\nfile = "unit.fmu"\nstop_time = 1.0\n'
    + PARAMETERS
    + '[[response]]\nname = "y"\n'
    + END,
}
TABLE = {
    "runs.csv": "a,b,y\n0.5,1.0,2.0\n0.25,1.0,3.0\n",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "table"\nfile = "runs.csv"\n'
    + PARAMETERS
    + '[[response]]\nname = "y"\n'
    + END,
}
BINARY = {
    "part.c": "int part(void) { return 0; }\n",
    "main.c": "int part(void);\nint main(void) { return part(); }\n",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "command"\ncommand = ["{study}/solver", "{a}"]\n'
    + PARAMETERS
    + '[[response]]\nname = "y"\nread = { kind = "json", file = "o.json", key = "y" }\n'
    + END,
}
KINDS = {
    "python": PYTHON,
    "command": COMMAND,
    "fmu": FMU,
    "table": TABLE,
    "binary": BINARY,
    "committed": PYTHON,
}
OLD = 1e9  # s since 1970: files that have been there for a while


def compiled(folder):
    """A program and the shared library that it is linked with."""
    if shutil.which("cc") is None:
        pytest.skip("needs a C compiler")
    for words in (
        ["-shared", "-fPIC", "-o", "libpart.so", "part.c"],
        ["-o", "solver", "main.c", "libpart.so"],
    ):
        subprocess.run(["cc", "-Wl,-rpath,$ORIGIN", *words], cwd=folder, check=True)


def git(folder, *words):
    who = ["-c", "user.name=n", "-c", "user.email=n@example.com"]
    subprocess.run(["git", "-C", str(folder), *who, *words], check=True, capture_output=True)


def verdict(study):
    """What opening the campaign makes of its one run, and in which words."""
    try:
        with Campaign.from_file(study) as campaign:
            found = campaign.store.select(
                "SELECT state, reading FROM evaluation WHERE key = ?", [campaign.key(ROW)]
            )
            if not found:
                return "another run", ""
            ((state, reading),) = found
            if reading != 1:
                return "another reading", ""
            now = campaign.store.state_now
            contents = dict(campaign.store.select("SELECT id, content FROM model_state"))
            return ("nothing", "") if state == now else ("attributed", contents[now])
    except StudyError as exc:
        is_counted = "changed after 1 run was stored in s.holdfast" in str(exc)
        return "refused" if is_counted else "refused without the number of runs", str(exc)


def edit(name, old, new):
    def change(folder, _patch):
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new))

    return change


def study_edit(old, new):
    return edit("s.toml", old, new)


def write(name, text):
    def change(folder, _patch):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())

    return change


def variable(name, value):
    return lambda _folder, patch: patch.setenv(name, value)
