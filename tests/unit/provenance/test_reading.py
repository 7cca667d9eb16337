"""What is a reader's own, and what the simulation's."""

import pytest

from workbench.provenance.content import ContentCache
from workbench.provenance.named import model_files
from workbench.provenance.reading import readings_now
from workbench.provenance.state import model_state
from workbench.study.loading import load_study

FILES = {
    "solver.py": "import sys, units\nimport json\nSCALE = 2.0\n"
    "def solve(a):\n    return shared(a) * SCALE\n"
    "def shared(a):\n    return units.si(a)\n"
    "def peak(work):\n    return _largest(work) + shared(1.0)\n"
    "def _largest(work):\n    return 1.0\n"
    'if __name__ == "__main__":\n    solve(float(sys.argv[1]))\n',
    "units.py": "def si(a):\n    return a\n",
    "post.py": "import units, filters\n"
    'def first(work):\n    """Of the run."""\n    return filters.smooth(_table("gauge.csv"))\n'
    "def second(work):\n    return 2.0\n"
    "def _table(name):\n    return name\n",
    "filters.py": "def smooth(x):\n    return x\n",
    "gauge.csv": "1\n",
    "s.toml": '[study]\nname = "s"\n[model]\nkind = "command"\n'
    'command = ["{python}", "{study}/solver.py", "{a}"]\n'
    '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n'
    '[[response]]\nname = "p"\nread = { kind = "python", function = "solver.py:peak" }\n'
    '[[response]]\nname = "q"\nread = { kind = "python", function = "post.py:first" }\n'
    '[[response]]\nname = "r"\nread = { kind = "python", function = "post:second" }\n'
    '[[response]]\nname = "j"\nread = { kind = "json", file = "o.json", key = "y" }\n',
}


@pytest.fixture
def place(tmp_path):
    for name, text in FILES.items():
        (tmp_path / name).write_text(text)
    return tmp_path


def found(place):
    """The digest of the simulation, and that of the code of every reader."""
    study = load_study(place / "s.toml")
    spec = study.spec(version="1")
    wanted, cache = study.model.get("state") or {}, ContentCache(place / "cache.json")
    readings = readings_now(study.readings, spec, model_files(spec), wanted, cache=cache)
    state = model_state(spec, wanted, cache=cache)
    return {"simulation": state.digest} | {name: how.get("code") for name, how in readings.items()}


EDITS = {
    "a reader": ("post.py", '_table("gauge.csv"))', '_table("gauge.csv")) + 1', {"q"}),
    "another reader": ("post.py", "return 2.0", "return 3.0", {"r"}),
    "its helper": ("post.py", "return name", "return name + name", {"q"}),
    "a module of it": ("filters.py", "return x", "return -x", {"q", "r"}),
    "data of it": ("gauge.csv", "1", "2", {"q", "r"}),
    "a reader in the solver": ("solver.py", "+ shared(1.0)", "+ shared(2.0)", {"p"}),
    "its own helper in the solver": ("solver.py", "return 1.0", "return 1.5", {"p"}),
    "what the solver shares with it": ("solver.py", "units.si(a)", "-units.si(a)", {"simulation"}),
    "the solver": ("solver.py", "SCALE = 2.0", "SCALE = 3.0", {"simulation"}),
    "a module of both": ("units.py", "return a", "return -a", {"simulation"}),
    "a docstring": ("post.py", "Of the run", "Of this run", set()),
    "a comment": ("post.py", "def second", "# the second\n\n\ndef second", set()),
}


@pytest.mark.parametrize("name", EDITS)
def test_an_edit_belongs_to_the_reading_or_to_the_simulation(place, name):
    file, old, new, changed = EDITS[name]
    before = found(place)
    text = (place / file).read_text()
    assert old in text
    (place / file).write_text(text.replace(old, new))
    after = found(place)
    assert {key for key in after if after[key] != before[key]} == changed


def test_readers_without_code_have_none(place):
    assert found(place)["j"] is None


def test_excluded_files_are_no_part_of_a_reader(place):
    text = (place / "s.toml").read_text()
    (place / "s.toml").write_text(text.replace("[[par", '[model.state]\nexclude = ["gauge.csv"]\n[[par', 1))
    before = found(place)
    (place / "gauge.csv").write_text("3\n")
    assert found(place) == before


def test_a_reader_that_is_no_python_is_known_by_its_bytes(place):
    before = found(place)["q"]
    (place / "post.py").write_text("def first(work:\n")
    broken = found(place)["q"]
    (place / "post.py").write_text("def first(work :\n")
    assert len({before, broken, found(place)["q"]}) == 3
