"""The state of a model: what is noticed, what is no change, and what a person may answer."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

from workbench.campaign.permissions import Permissions
from workbench.errors import StudyError
from workbench.provenance.content import ContentCache
from workbench.provenance.state import model_state
from workbench.stages.campaign import Campaign
from workbench.study.loading import load_study

FILES = {
    "m.py": "from pathlib import Path\nimport helper\nfrom pkg.inner import scale\n"
    "HERE = Path(__file__).parent\n"
    'def f(a):\n    gain = float((HERE / "data" / "gain.txt").read_text())\n'
    '    (HERE / "trace.log").write_text("ran")\n    return gain * scale(helper.twice(a))\n',
    "helper.py": "import deeper\ndef twice(a):\n    return 2 * deeper.same(a)\n",
    "deeper.py": "def same(a):\n    return a\n",
    "pkg/__init__.py": "",
    "pkg/inner.py": "from . import constants\ndef scale(a):\n    return constants.SCALE * a\n",
    "pkg/constants.py": "SCALE = 3.0\n",
    "unrelated.py": "x = 1\n",
    "data/gain.txt": "1.5",
    "listed.dat": "1",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "m.py:f"\n'
    'state = { include = ["*.dat"], environment = ["GAIN_OF_TEST"] }\n'
    '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n[[response]]\nname = "y"\n'
    '[evaluate]\nengine = "inline"\n',
}


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.setenv("GAIN_OF_TEST", "1")
    for name, text in FILES.items():
        path = tmp_path / "study" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return tmp_path / "study"


def state(place, cache=None):
    study = load_study(place / "s.toml")
    return model_state(study.spec(version="1"), study.model["state"], cache=ContentCache(cache))


CHANGES = {
    "m.py": ("gain *", "2 * gain *"),
    "helper.py": ("2 *", "3 *"),
    "deeper.py": ("return a", "return -a"),
    "pkg/inner.py": ("SCALE * a", "SCALE + a"),
    "pkg/constants.py": ("3.0", "4.0"),
    "data/gain.txt": ("1.5", "1.6"),
    "listed.dat": ("1", "2"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_change_of_anything_behind_the_function_is_noticed(place, name):
    before = state(place)
    path = place / name
    path.write_text(path.read_text().replace(*CHANGES[name]))
    after = state(place)
    assert after.digest != before.digest
    changed = [key for key in after.decides if after.decides[key] != before.decides.get(key)]
    assert [key.partition(" ")[2] for key in changed] == [name]


def test_a_listed_variable_of_the_environment_is_noticed(place, monkeypatch):
    before = state(place)
    monkeypatch.setenv("GAIN_OF_TEST", "2")
    assert state(place).digest != before.digest


HARMLESS = {
    "touched": lambda place: (place / "helper.py").touch(),
    "comment": lambda place: (place / "helper.py").write_text(
        FILES["helper.py"] + "# a word, and an empty line\n\n"
    ),
    "docstring": lambda place: (place / "deeper.py").write_text('"""What it is."""\n' + FILES["deeper.py"]),
    "unrelated file": lambda place: (place / "unrelated.py").write_text("x = 2\n"),
    "what the model writes": lambda place: (place / "trace.log").write_text("other"),
    "another file": lambda place: (place / "notes.md").write_text("m.py"),
}


@pytest.mark.parametrize("name", HARMLESS)
def test_no_false_alarm(place, name):
    (place / "trace.log").write_text("ran")
    before = state(place)
    HARMLESS[name](place)
    assert state(place).digest == before.digest


def test_a_moved_folder_is_the_same_model(place, tmp_path):
    before = state(place)
    shutil.copytree(place, tmp_path / "elsewhere")
    assert state(tmp_path / "elsewhere").digest == before.digest


def test_excluded_files_are_no_part_of_the_state(place):
    text = (place / "s.toml").read_text()
    (place / "s.toml").write_text(text.replace("state = {", 'state = { exclude = ["pkg/*"],'))
    assert not any("pkg" in name for name in state(place).decides)
    assert any("helper.py" in name for name in state(place).decides)


def test_files_are_read_once(place, tmp_path, monkeypatch):
    for name in FILES:
        os.utime(place / name, (1e9, 1e9))
    before = state(place, tmp_path / "cache.json")

    def read(path):
        raise AssertionError(f"{path} was read again")

    from workbench.provenance import closure

    read.__name__ = "read_code"
    monkeypatch.setattr(closure, "read_code", read)
    assert state(place, tmp_path / "cache.json").digest == before.digest


def test_a_solver_and_its_libraries_are_known_by_content(tmp_path):
    solver = tmp_path / "solver"
    shutil.copy2(shutil.which("true"), solver)
    (tmp_path / "s.toml").write_text(
        '[study]\nname = "s"\n[model]\nkind = "command"\ncommand = ["{study}/solver", "{a}"]\n'
        '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n'
        '[[response]]\nname = "y"\nread = { kind = "json", file = "o.json", key = "y" }\n'
    )

    def found():
        study = load_study(tmp_path / "s.toml")
        return model_state(study.spec(version="1"), {}, cache=ContentCache(tmp_path / "cache.json"))

    before = found()
    assert "program solver" in before.decides
    with open(solver, "ab") as file:
        file.write(b"\0")
    assert found().digest != before.digest


def values(place, permissions=None):
    with Campaign.from_file(place / "s.toml", permissions=permissions) as campaign:
        (row,) = campaign.evaluate([{"a": 0.5}])
        states = campaign.store.select("SELECT state FROM evaluation WHERE key = ?", [row.key])
        return row.outputs["y"], states[0][0]


def answer(place, gain):
    (place / "data" / "gain.txt").write_text(gain)


def test_a_change_is_met_in_three_ways(place):
    assert values(place) == (4.5, 1)
    answer(place, "2.5")
    with pytest.raises(
        StudyError,
        match=r"changed after 1 run was stored in s.holdfast: data data/gain.txt changed. Undo that",
    ):
        values(place)
    answer(place, "1.5")
    assert values(place) == (4.5, 1)
    answer(place, "2.5")
    assert values(place, Permissions(same_model=True)) == (4.5, 1)
    assert values(place) == (4.5, 1), "once said, it is known"
    answer(place, "3.5")
    y, number = values(place, Permissions(new_version=True))
    assert (y, number) == (10.5, 3)
    assert values(place) == (10.5, 3)
    with Campaign.from_file(place / "s.toml") as campaign:
        assert len(campaign.store.rows()) == 2
        assert campaign.spec.version == "1~2"


def test_whether_the_tree_is_as_committed_is_written_down(tmp_path):
    from workbench.provenance.state import _tree

    if shutil.which("git") is None:
        pytest.skip("needs git")

    def git(*arguments):
        who = ["-c", "user.name=n", "-c", "user.email=n@example.com"]
        subprocess.run(["git", "-C", str(tmp_path), *who, *arguments], check=True, capture_output=True)

    assert _tree(tmp_path) == "unknown"
    git("init")
    (tmp_path / "m.py").write_text("a = 1\n")
    git("add", ".")
    git("commit", "-m", "first")
    assert _tree(tmp_path) == "clean"
    (tmp_path / "new.txt").write_text("")
    assert _tree(tmp_path) == "clean", "files that git does not follow are none of it"
    (tmp_path / "m.py").write_text("a = 2\n")
    assert _tree(tmp_path) == "dirty"


def test_a_look_takes_what_is_known_and_keeps_nothing(tmp_path):
    file, place = tmp_path / "a.txt", tmp_path / "cache.json"
    file.write_text("1")
    old = file.stat().st_mtime - 3600.0
    os.utime(file, (old, old))
    look = ContentCache(place, keeps=False)
    assert look.of(file, Path.read_text) == "1"
    look.write()
    assert not place.exists()
    kept = ContentCache(place)
    kept.of(file, Path.read_text)
    kept.write()
    assert ContentCache(place, keeps=False).of(file, Path.read_text) == "1"
