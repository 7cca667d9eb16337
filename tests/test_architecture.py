"""The house against its table: who may import whom, what a room holds, and how long a file may be.

Each check returns the offences it finds below a root, one line each; each is tried on a small tree with a
seeded offence.
"""

import ast
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import doe
import surrogates
import workbench
import workbench.engine
from tests.house import (
    FLOORS,
    GALLERIES,
    OWN_FILES,
    PACKAGES,
    PAGE,
    STRANGERS,
    diagram,
    page_with_diagram,
    rooms_on_disk,
    sentence,
)
from tests.imports import arrows, circles, files_of, named_modules, opens_by_name
from workbench.engine.elements.table import ELEMENTS, LAWS
from workbench.models.opening import KINDS
from workbench.stages.table import STAGES

ROOT = Path(__file__).parent.parent
MIXED, TOP, LINES = 16, 7, 400
"""At most so many files in a mixed folder, directly in workbench/, and lines in a file."""
KINDS_OF_TESTS = ("unit", "laws", "papers", "peers", "faults")
PUBLIC = {
    f"{package.__name__.replace('.', '/')}/{name}"
    for package in (workbench, workbench.engine, doe, surrogates)
    for name in package.__all__
}


def floor(folder: str, name: str) -> int | None:
    """How far from the top a room or file of `folder` stands; None when the table does not place it."""
    if name == "__init__":
        return -1
    floors = [line.split() for line in FLOORS.get(folder, (OWN_FILES,))]
    for wanted in (name, OWN_FILES):
        for height, line in enumerate(floors):
            if wanted in line:
                return height
    return None


def place(module: str, files: dict[str, Path], root: Path) -> tuple[str, ...]:
    """A module's folders and file: ("workbench", "search", "gap"), ("workbench", "search", "__init__")."""
    return files[module].relative_to(root).with_suffix("").parts


def is_upward(importer: tuple[str, ...], imported: tuple[str, ...]) -> bool:
    """Does the arrow leave the table's way, which goes from a floor to one below it?"""
    depth = next(i for i, (a, b) in enumerate(zip(importer, imported, strict=False)) if a != b)
    folder = "/".join(importer[:depth])
    above, below = floor(folder, importer[depth]), floor(folder, imported[depth])
    if above is None or below is None:
        return True
    own = [len(way) == depth + 1 and not is_named(folder, way[depth]) for way in (importer, imported)]
    return above > below or (above == below and not all(own))


def is_named(folder: str, name: str) -> bool:
    """Does the table name this file or room, rather than leave it among the folder's own files?"""
    return any(name in line.split() for line in FLOORS.get(folder, ()))


def room_of(where: tuple[str, ...]) -> str:
    """The folder of a file; a file that the table names is a room of its own."""
    folder = "/".join(where[:-1])
    return "/".join(where) if is_named(folder, where[-1]) else folder


def upward(root: Path) -> list[str]:
    """Imports that do not go down by the table."""
    files = files_of(root, PACKAGES)
    where = {module: place(module, files, root) for module in files}
    return [
        f"{'/'.join(where[a])} -> {'/'.join(where[b])}"
        for a, targets in arrows(root, PACKAGES).items()
        for b in sorted(targets)
        if is_upward(where[a], where[b])
    ]


def in_circles(root: Path) -> list[str]:
    """Files, and rooms, that import one another round a circle."""
    graph = arrows(root, PACKAGES)
    files = files_of(root, PACKAGES)
    room = {module: room_of(place(module, files, root)) for module in files}
    rooms: dict[str, set[str]] = {}
    for a, targets in graph.items():
        if files[a].stem != "__init__":  # a package's face names all that it hands out
            rooms.setdefault(room[a], set()).update({room[b] for b in targets} - {room[a]})
    return [", ".join(circle) for circle in [*circles(graph), *circles(rooms)]]


def strangers(root: Path) -> list[str]:
    """Packages from outside that a package may not import."""
    found = []
    for path in files_of(root, PACKAGES).values():
        file = str(path.relative_to(root))
        package = next(p for p in STRANGERS if file.startswith(f"{p}/"))
        names = {name.split(".")[0] for name in named_modules(path, root)}
        outside = names - set(PACKAGES) - set(sys.stdlib_module_names) - STRANGERS[package]
        found += [f"{file}: {name}" for name in sorted(outside)]
    return found


def unplaced(root: Path) -> list[str]:
    """Rooms and files that the table does not place, and places of the table that nothing fills."""
    on_disk = {room for room in rooms_on_disk(root) if "/" in room}
    named = {
        f"{f}/{n}" for f, lines in FLOORS.items() if f for n in " ".join(lines).split() if n != OWN_FILES
    }
    files = {f"{f}/{p.stem}" for f in FLOORS if f for p in (root / f).glob("*.py") if p.stem != "__init__"}
    loose = {
        file for file in files - named if not any(OWN_FILES in s for s in FLOORS[file.rpartition("/")[0]])
    }
    return [
        *(f"{room} has no floor" for room in sorted((on_disk | loose) - named)),
        *(f"{room} does not exist" for room in sorted(named - on_disk - files)),
    ]


def like_functions(root: Path) -> list[str]:
    """Rooms that carry the name of a public function: importing the room would hide it."""
    return [room for room in rooms_on_disk(root) if room in PUBLIC]


def faces(root: Path) -> list[str]:
    """Rooms that do not say what they are for, or whose `__init__.py` loads what it hands out."""
    found = []
    for room in rooms_on_disk(root):
        file = root / room / "__init__.py"
        if not file.exists():
            found.append(f"{room} has no __init__.py")
            continue
        if not sentence(room, root).endswith(".") or len(sentence(room, root).split()) < 4:
            found.append(f"{room} has no sentence")
        if "/" in room and room != "workbench/engine" and loads(ast.parse(file.read_text())):
            found.append(f"{room} loads modules when it is imported")
    return found


def loads(tree: ast.Module) -> bool:
    """Does importing this `__init__.py` import any module of ours?"""
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and (node.level or (node.module or "").split(".")[0] in PACKAGES):
            return True
        if isinstance(node, ast.Import) and any(a.name.split(".")[0] in PACKAGES for a in node.names):
            return True
    return False


def crowded(root: Path) -> list[str]:
    """Mixed folders with too many files."""
    found = []
    for room in rooms_on_disk(root):
        count = sum(path.is_file() for path in (root / room).iterdir())
        if room not in GALLERIES and count > (TOP if room == "workbench" else MIXED):
            found.append(f"{room}: {count} files")
    return found


def long_files(root: Path) -> list[str]:
    """Files of more than 400 lines."""
    paths = sorted(files_of(root, PACKAGES).values())
    return [str(path.relative_to(root)) for path in paths if len(path.read_text().splitlines()) > LINES]


def homeless_tests(root: Path) -> list[str]:
    """Test files whose folder is no room: tests of `workbench/space/` stand in tests/unit/space."""
    found = []
    for kind in KINDS_OF_TESTS:
        for path in sorted((root / "tests" / kind).rglob("test_*.py")):
            room = path.parent.relative_to(root / "tests" / kind)
            above = "" if room.parts and room.parts[0] in ("docs", *PACKAGES) else "workbench"
            if not (root / above / room).is_dir():
                found.append(str(path.relative_to(root)))
    return found


def lost_long_tests(root: Path) -> list[str]:
    """Lines of tests/long.txt, which `make fast` leaves out, that name no test."""
    listed = root / "tests/long.txt"
    found = []
    for line in listed.read_text().split() if listed.exists() else ():
        file, _, function = line.partition("::")
        if not (root / file).exists() or f"def {function}(" not in (root / file).read_text():
            found.append(line)
    return found


CHECKS: dict[str, Callable[[Path], list[str]]] = {
    check.__name__: check
    for check in (
        upward, in_circles, strangers, unplaced, like_functions, faces, crowded, long_files, homeless_tests,
        lost_long_tests,
    )
}  # fmt: skip


@pytest.mark.parametrize("check", CHECKS)
def test_the_house_is_as_its_table_says(check):
    assert CHECKS[check](ROOT) == []


def test_the_page_shows_the_house():
    page = (ROOT / PAGE).read_text()
    assert page_with_diagram(page) == page, "run: python -m tests.house --write"
    missing = [room for room in rooms_on_disk() if f"{room.rpartition('/')[2]}/" not in diagram()]
    assert missing == []


FACES = {"doe", "surrogates", "workbench", "workbench.engine", "workbench._moved"}
OPENERS = {
    "workbench.stages.table": {f"workbench.stages.{stage.name}" for stage in STAGES},
    "workbench.engine.elements._kernels_laws": {
        f"workbench.engine.elements.{file}" for file in LAWS.values()
    },
    "workbench.engine.elements._kernels_elements": {
        f"workbench.engine.elements.{file}" for file in ELEMENTS.values()
    },
    "workbench.models.opening": {place.partition(":")[0] for place in KINDS.values()},
}
"""Modules that open others by names in a table, and those others."""
OPENERS_OF_THE_USERS = {"workbench.models.python", "workbench.robust_layout.model"}


def test_what_is_opened_by_name_is_known_and_closes_no_circle():
    opening = {module for module, path in files_of(ROOT, PACKAGES).items() if opens_by_name(path)}
    assert opening == FACES | OPENERS_OF_THE_USERS | set(OPENERS)
    graph = arrows(ROOT, PACKAGES)
    assert circles({m: graph[m] | OPENERS.get(m, set()) for m in graph}) == []
    backwards = {**OPENERS, "workbench.stages.design": {"workbench.stages.table"}}
    assert len(circles({m: graph[m] | backwards.get(m, set()) for m in graph})) == 1


def test_the_packages_do_not_know_their_elders():
    assert floor("", "studies") < floor("", "workbench") < floor("", "doe") == floor("", "surrogates")
    assert floor("workbench", "engine") == floor("workbench", "errors")


# what is found -> file, its text, and the check that finds it
SEEDS = {
    "up, between packages": ("doe/latin/lhs.py", "import workbench.space", "upward"),
    "up, between rooms": ("workbench/space/box.py", "from workbench.study import loading", "upward"),
    "up, between inner rooms": ("workbench/search/runs/ledger.py", "from ..evidence import gap", "upward"),
    "up, from a room to its folder's files": (
        "workbench/search/runs/ledger.py", "from workbench.search.worst_case import search", "upward",
    ),
    "up, through the package's face": ("workbench/space/box.py", "from workbench import Campaign", "upward"),
    "between neighbours": ("surrogates/likelihood/restricted.py", "from doe import lhs", "upward"),
    "up, inside a function": (
        "workbench/space/box.py", "def f():\n    from workbench.study import loading\n", "upward",
    ),
    "up, for types only": (
        "workbench/space/box.py",
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    from workbench.study import loading\n",
        "upward",
    ),
    "up, relative": (
        "workbench/engine/layout/separable/sequence.py", "from ....study.loading import Study", "upward",
    ),
    "up, by import_module": (
        "workbench/space/box.py", "import importlib\nimportlib.import_module('workbench.study.loading')",
        "upward",
    ),
    "the engine and the workbench's errors": (
        "workbench/engine/layout/optimise.py", "from workbench.errors import StudyError", "upward",
    ),
    "a circle of two files in one room": (
        "workbench/space/box.py", "def f():\n    from workbench.space import units\n", "in_circles",
    ),
    "a circle of two rooms": ("workbench/space/units.py", "import workbench.study.loading", "in_circles"),
    "a stranger": ("workbench/engine/planar/runs.py", "import xarray as xr", "strangers"),
    "a room without a floor": ("workbench/attic/__init__.py", '"""Old things."""', "unplaced"),
    "a file without a floor": ("workbench/helpers.py", "", "unplaced"),
    "a room named like a function": ("workbench/minimax/__init__.py", '"""A room."""', "like_functions"),
    "a room without a face": ("workbench/attic/box.py", "", "faces"),
    "a room without a sentence": ("workbench/study/__init__.py", '"""Study."""', "faces"),
    "an eager face": (
        "workbench/study/__init__.py",
        '"""One typed file with all that is asked."""\nfrom workbench.study.loading import Study', "faces",
    ),
    "a test without a room": ("tests/unit/attic/test_box.py", "", "homeless_tests"),
    "a test of a package's lost room": ("tests/laws/doe/attic/test_box.py", "", "homeless_tests"),
    "a lost long test": ("tests/long.txt", "tests/unit/doe/test_box.py::test_it", "lost_long_tests"),
    "a long file": ("workbench/space/box.py", "\n" * 401, "long_files"),
}  # fmt: skip


def small_house(root: Path) -> Path:
    """A tree in which no check finds anything, as far as its rooms go."""
    for file, text in {
        "workbench/__init__.py": '"""The workbench, as small as can be."""',
        "workbench/study/__init__.py": '"""One typed file with all that is asked."""',
        "workbench/study/loading.py": "from workbench.space import box",
        "workbench/space/__init__.py": '"""Parameters with their units and bounds."""',
        "workbench/space/box.py": "import numpy as np",
        "workbench/space/units.py": "from workbench.space import box",
        "workbench/search/__init__.py": '"""The search for the worst case."""',
        "workbench/search/worst_case.py": "from workbench.search.evidence import gap",
        "workbench/search/evidence/__init__.py": '"""How sure the worst case is."""',
        "workbench/search/evidence/gap.py": "from ..runs import ledger",
        "workbench/search/runs/__init__.py": '"""The runs of the search."""',
        "workbench/search/runs/ledger.py": "from workbench.space.box import Space",
        "workbench/errors.py": "",
        "doe/__init__.py": '"""Points in the unit cube."""',
    }.items():
        (root / file).parent.mkdir(parents=True, exist_ok=True)
        (root / file).write_text(text + "\n")
    return root


@pytest.mark.parametrize("seed", SEEDS)
def test_a_seeded_offence_is_found(tmp_path, seed):
    file, text, check = SEEDS[seed]
    root = small_house(tmp_path)
    before = CHECKS[check](root)
    assert check == "unplaced" or before == []
    (root / file).parent.mkdir(parents=True, exist_ok=True)
    (root / file).write_text(text + "\n")
    (found,) = set(CHECKS[check](root)) - set(before)
    assert file.rpartition("/")[0] in found.replace(".", "/")


def test_a_folder_with_too_many_files_is_found(tmp_path):
    root = small_house(tmp_path)
    for number in range(MIXED):
        (root / f"workbench/study/part_{number}.py").touch()
    assert crowded(root) == [f"workbench/study: {MIXED + 2} files"]
    for number in range(TOP):
        (root / f"workbench/part_{number}.py").touch()
    assert crowded(root)[0] == f"workbench: {TOP + 2} files"


def test_a_page_without_a_room_is_mended():
    page = (ROOT / PAGE).read_text()
    assert page.count("\n    search/") + page.count("\n  + search/") == 1
    assert page_with_diagram(page.replace(" search/", " attic/")) == page
