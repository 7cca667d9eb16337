"""Changes of a model are refused, read anew, run anew or attributed, as they deserve.

Each case changes one thing of a campaign that holds one run, and opens it again. No model is run.
"""

import os
import platform
import subprocess

import pytest

from tests.faults.provenance.small_campaigns import edit, study_edit, variable, verdict, write


def patched(target, value):
    return lambda _folder, patch: patch.setattr(target, value)


def grown(name):
    def change(folder, _patch):
        with open(folder / name, "ab") as file:
            file.write(b"\0")

    return change


def other_library(folder, _patch):
    (folder / "part.c").write_text("int part(void) { return 1; }\n")
    subprocess.run(["cc", "-shared", "-fPIC", "-o", "libpart.so", "part.c"], cwd=folder, check=True)


def retargeted(folder, _patch):
    (folder / "other.csv").write_text("3,4\n")
    (folder / "table.csv").unlink()
    (folder / "table.csv").symlink_to("other.csv")


def linked_helper(more):
    """The helper as a link to a copy elsewhere that is longer by `more`."""

    def change(folder, _patch):
        (folder.parent / "copy.py").write_text((folder / "helper.py").read_text() + more)
        (folder / "helper.py").unlink()
        (folder / "helper.py").symlink_to(folder.parent / "copy.py")

    return change


def same_size_and_time(folder, _patch):
    """As `cp -p` and archives leave it: only the content is another."""
    old = os.stat(folder / "table.csv")
    (folder / "table.csv").write_text("1,3\n")
    os.utime(folder / "table.csv", ns=(old.st_atime_ns, old.st_mtime_ns))


def of_package(name):
    return "9.9" if name == "numpy" else "1.0"


CODE, FILE, DATA = "code {} changed", "file {} changed", "data {} changed"
# what -> kind of campaign, the change, the verdict, words that tell what it was
CHANGES = {
    "function": ("python", edit("m.py", "+ scale", "- scale"), "refused", CODE.format("m.py")),
    "helper": ("python", edit("helper.py", "times *", "-times *"), "refused", CODE.format("helper.py")),
    "keyword default": ("python", edit("helper.py", "times=2", "times=3"), "refused", "helper.py changed"),
    "helper of helper": (
        "python",
        edit("deeper.py", "return a", "return -a"),
        "refused",
        "deeper.py changed",
    ),
    "module of a package": ("python", edit("pkg/constants.py", "3.0", "4.0"), "refused", "pkg/constants.py"),
    "code of a package": ("python", write("pkg/__init__.py", "import os\n"), "refused", "pkg/__init__.py"),
    "module in a folder on the path": (
        "python",
        edit("shared/lib/on_path.py", "too", "too as t"),
        "refused",
        CODE.format("shared/lib/on_path.py"),
    ),
    "what such a module imports": (
        "python",
        edit("shared/lib/on_path_too.py", "1", "2"),
        "refused",
        CODE.format("shared/lib/on_path_too.py"),
    ),
    "gradient": ("python", edit("slope.py", "2.0", "2.5"), "refused", CODE.format("slope.py")),
    "data file opened": ("python", edit("table.csv", "1,2", "1,3"), "refused", DATA.format("table.csv")),
    "data file named by parts": ("python", edit("data/gain.toml", "1.5", "1.6"), "refused", "data/gain.toml"),
    "data file of equal size and time": ("python", same_size_and_time, "refused", "data table.csv changed"),
    "symbolic link to other data": ("python", retargeted, "refused", "table.csv"),
    "helper behind a symbolic link": ("python", linked_helper("x = 1\n"), "refused", "helper.py"),
    "listed file": ("python", edit("maps/road.dat", "0 0", "0 1"), "refused", FILE.format("maps/road.dat")),
    "new listed file": ("python", write("maps/new.dat", "1"), "refused", "file maps/new.dat is new"),
    "removed helper": (
        "python",
        lambda folder, _: (folder / "deeper.py").unlink(),
        "refused",
        "code deeper.py is gone",
    ),
    "a module that was not there": ("python", write("extra.py", "x = 1\n"), "refused", "extra.py is new"),
    "a module before an installed one": (
        "python",
        write("numpy.py", "x = 1\n"),
        "refused",
        "numpy.py is new",
    ),
    "other function": ("python", study_edit("m.py:f", "m.py:g"), "another run", ""),
    "version": ("python", study_edit("[model]\n", '[model]\nversion = "2"\n'), "another run", ""),
    "listed variable": (
        "python",
        variable("GAIN_OF_TEST", "2"),
        "refused",
        "environment GAIN_OF_TEST changed",
    ),
    "package version": (
        "python",
        patched("workbench.provenance.state.version", of_package),
        "attributed",
        '"package numpy": "9.9"',
    ),
    "Python version": (
        "python",
        lambda _, patch: patch.setattr(platform, "python_version", lambda: "3.99"),
        "attributed",
        '"python": "3.99"',
    ),
    "processor": (
        "python",
        patched("workbench.provenance.state._processor", lambda: "another one"),
        "attributed",
        "another one",
    ),
    "template": ("command", edit("deck.tpl", "k =", "m ="), "refused", FILE.format("deck.tpl")),
    "file that a deck includes": ("command", edit("part.inc", "1", "2"), "refused", FILE.format("part.inc")),
    "wrapper script": ("command", edit("wrapper.sh", "exec", "nice"), "refused", FILE.format("wrapper.sh")),
    "script": ("command", edit("solver.py", ".run()", ".run"), "refused", CODE.format("solver.py")),
    "module of a script": (
        "command",
        edit("solver_parts.py", "pass", "return"),
        "refused",
        "solver_parts.py",
    ),
    "program in Python": ("command", edit("tool.py", "import", "import os,"), "refused", "code tool.py"),
    "module of a program": ("command", edit("tool_parts.py", "1", "2"), "refused", "code tool_parts.py"),
    "file in a named folder": ("command", edit("mesh/fine.msh", "1", "2"), "refused", "file mesh/fine.msh"),
    "interpreter flag": ("command", study_edit('"-E"', '"-O"'), "another run", ""),
    "argument": ("command", study_edit('"{a}"', '"{b}"'), "another run", ""),
    "variable of the command": ("command", study_edit('THREADS = "1"', 'THREADS = "2"'), "another run", ""),
    "reader": ("command", edit("post.py", "return", "return -"), "another reading", ""),
    "module of a reader": ("command", edit("post_parts.py", "1.0", "2.0"), "another reading", ""),
    "options of a reader": ("command", study_edit('"h" }', '"t" }'), "another reading", ""),
    "reducer": ("command", study_edit('"max"', '"min"'), "another reading", ""),
    "response": (
        "command",
        study_edit('[[response]]\nname = "h"', '[[response]]\nname = "g"'),
        "another reading",
        "",
    ),
    "binary": ("binary", grown("solver"), "refused", "program solver changed"),
    "shared library": ("binary", other_library, "refused", "library libpart.so changed"),
    "unit": ("fmu", write("unit.fmu", "PK unit 2"), "refused", FILE.format("unit.fmu")),
    "time of a unit": ("fmu", study_edit("stop_time = 1.0", "stop_time = 2.0"), "another run", ""),
    "table of runs": ("table", edit("runs.csv", "2.0", "2.5"), "another run", ""),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_is_met_as_it_deserves(place, monkeypatch, name):
    kind, change, expected, words = CHANGES[name]
    folder = place(kind)
    change(folder, monkeypatch)
    found, text = verdict(folder / "s.toml")
    assert found == expected
    assert words in text
