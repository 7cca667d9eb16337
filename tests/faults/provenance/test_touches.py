"""What changes nothing of a model is not taken for a change of it.

Each case touches a campaign that holds one run, and opens it again. No model is run.
"""

import os

import pytest

from tests.faults.provenance.small_campaigns import (
    PARAMETERS,
    STATE,
    edit,
    git,
    study_edit,
    variable,
    verdict,
    write,
)


def touched(folder, _patch):
    for path in folder.rglob("*"):
        if path.is_file() and "s.holdfast" not in path.parts and ".git" not in path.parts:
            path.touch()


def moved(folder, _patch):
    (folder.parent / "far" / "away").mkdir(parents=True)
    folder.rename(folder.parent / "far" / "away" / "study")
    return folder.parent / "far" / "away" / "study"


def linked(folder, _patch):
    (folder.parent / "link").symlink_to(folder, target_is_directory=True)
    return folder.parent / "link"


def behind_links(folder, _patch):
    for name in ("helper.py", "table.csv"):
        (folder / name).rename(folder.parent / f"copy of {name}")
        (folder / name).symlink_to(folder.parent / f"copy of {name}")


def renamed(folder, _patch):
    (folder / "unrelated.py").rename(folder / "still_unrelated.py")


def backups(folder, _patch):
    for name in ("m.py~", ".m.py.swp", "#m.py#", "maps/road.dat~", "maps/.road.dat.swp", "maps/road.dat.bak"):
        write(name, "older")(folder, _patch)
    (folder / "maps" / ".#road.dat").symlink_to("somebody@somewhere.1234")


def compiled_python(folder, _patch):
    for name in ("__pycache__/helper.cpython-312.pyc", "maps/__pycache__/x.pyc"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_bytes(b"code")


def reordered(folder, _patch):
    text = (folder / "s.toml").read_text()
    head = '[model]\nkind = "python"\nfunction = "m.py:f"\ngradient = "slope.py:gradient"\n'
    other = '[model]\ngradient = "slope.py:gradient"\nfunction = "m.py:f"\nkind = "python"\n'
    assert head in text
    text = text.replace(head, "").replace(PARAMETERS, "")
    (folder / "s.toml").write_text(text.replace(STATE, "") + PARAMETERS + other + STATE)


def spaced(folder, _patch):
    text = (folder / "s.toml").read_text().replace(" = ", "   =  ").replace("\n", "\n\n")
    (folder / "s.toml").write_text(f"# a remark\n{text}\n")


def other_user(_folder, patch):
    for name in ("USER", "LOGNAME", "USERNAME"):
        patch.setenv(name, "somebody")
    patch.setenv("HOME", "/nowhere")
    patch.setenv("TZ", "Asia/Tokyo")
    patch.setattr(os, "umask", lambda mask: mask)


def other_folder_to_work_in(folder, patch):
    patch.chdir(folder.parent)
    patch.setenv("PWD", str(folder.parent))


def rights(folder, _patch):
    for path in folder.rglob("*.py"):
        path.chmod(0o700)


def committed(folder, _patch):
    (folder / "notes.md").write_text("second\n")
    git(folder, "commit", "-am", "notes")


# what -> kind of campaign, the touch; attributed is allowed where it is said: the commit is written down
TOUCHES = {
    "times of files": ("python", touched),
    "times of decks, scripts and programs": ("command", touched),
    "times of a binary": ("binary", touched),
    "comment": ("python", edit("helper.py", "import deeper", "import deeper  # a word")),
    "comment in a program in Python": ("command", edit("tool.py", "import", "# a word\nimport")),
    "comment in a reader": ("command", edit("post.py", "import", "# a word\nimport")),
    "docstring": ("python", edit("deeper.py", '"""Deep."""', '"""Deeper still."""')),
    "empty lines": ("python", edit("helper.py", "\n", "\n\n\n")),
    "line ends": ("python", edit("helper.py", "\n", "\r\n")),
    "quotes": ("python", edit("slope.py", "'a'", '"a"')),
    "unrelated code": ("python", edit("unrelated.py", "1", "2")),
    "unrelated code in a folder on the path": ("python", edit("shared/lib/unrelated.py", "1", "2")),
    "comment in unrelated code": ("python", write("unrelated.py", "# new\nx = 1\n")),
    "README": ("python", write("README.md", "m.py and table.csv\n")),
    "another study": ("python", write("t.toml", '[study]\nname = "t"\n')),
    "moved folder": ("python", moved),
    "moved folder of a command": ("command", moved),
    "linked folder": ("python", linked),
    "linked helper and data": ("python", behind_links),
    "linked folder of a command": ("command", linked),
    "renamed unrelated file": ("python", renamed),
    "removed unrelated file": ("python", lambda folder, _: (folder / "unrelated.py").unlink()),
    "compiled Python": ("python", compiled_python),
    "backups of editors": ("python", backups),
    "backups in a named folder": ("command", write("mesh/fine.msh~", "0")),
    "order of keys": ("python", reordered),
    "white space of the study": ("python", spaced),
    "white space of the study of a command": ("command", spaced),
    "other user": ("python", other_user),
    "another working folder": ("command", other_folder_to_work_in),
    "rights of files": ("command", rights),
    "number of workers": ("python", study_edit("workers = 1", "workers = 2")),
    "engine": ("python", study_edit('"inline"', '"processes"')),
    "timeout": ("command", study_edit("[evaluate]\n", "[evaluate]\ntimeout = 60.0\n")),
    "tries": ("command", study_edit("[evaluate]\n", "[evaluate]\nretries = 2\n")),
    "what is kept": ("command", study_edit('["*.csv"]', '["*.csv", "*.log"]')),
    "title": ("python", study_edit('name = "s"\n', 'name = "s"\ntitle = "A study"\n')),
    "variable that is not listed": ("python", variable("ANOTHER_OF_TEST", "2")),
    "log of the model": ("command", write("solver.log", "ran")),
    "commit of an unrelated file": ("committed", committed, "attributed"),
    "unrelated file that is not committed": ("committed", write("notes.md", "second\n"), "attributed"),
    "file that git does not follow": ("committed", write("README.md", "m.py\n")),
}


@pytest.mark.parametrize("name", TOUCHES)
def test_no_touch_is_taken_for_a_change(place, monkeypatch, name):
    kind, touch, *allowed = TOUCHES[name]
    folder = place(kind)
    folder = touch(folder, monkeypatch) or folder
    found, text = verdict(folder / "s.toml")
    assert found in (allowed or ["nothing"]), text
