"""The house: the rooms of each package from the top down, and what each package may import from outside.

`tests/test_architecture.py` holds every import against these tables, and the diagram in
`docs/explanation/architecture.md` is made from them:

    python -m tests.house            prints the diagram
    python -m tests.house --write    puts it into the page
"""

import ast
import sys
from pathlib import Path

__all__ = [
    "FLOORS",
    "GALLERIES",
    "OWN_FILES",
    "PACKAGES",
    "STRANGERS",
    "diagram",
    "page_with_diagram",
    "rooms_on_disk",
    "sentence",
]

ROOT = Path(__file__).parent.parent
PAGE = Path("docs/explanation/architecture.md")
PACKAGES = ("studies", "workbench", "doe", "surrogates")

OWN_FILES = "*"
"""Stands in `FLOORS` for the files of a folder that are not named on a floor of their own."""

# folder -> its floors from the top down. A floor is a line of rooms (folders) and files that do not know
# one another; each may import from the floors below it. "" is the repository.
FLOORS: dict[str, tuple[str, ...]] = {
    "": ("studies", "workbench", "doe surrogates"),
    "studies": ("*", "adams_loop amplifier bracket buck_converter", "gunner"),
    "studies/gunner": (
        "checks",
        "slopes",
        "restraints",
        "drawing",
        "*",
        "vehicle cabin",
        "figure",
        "figure_numbers",
        "proving_grounds",
        "parts parameters manoeuvre",
    ),
    "workbench": (
        "__main__",
        "terminal",
        "stages",
        "robust_layout",
        "campaign",
        "report",
        "robust",
        "screening search figures workers",
        "study provenance histories",
        "sampling models",
        "space motion system",
        "engine errors _siblings _moved",
    ),
    "workbench/campaign": ("rescue results", "*", "integrity"),
    "workbench/models": ("stored", "*"),
    "workbench/report": ("*", "sections", "worst_case histories layout", "page", "lines"),
    "workbench/system": ("*", "processes"),
    "workbench/search": ("*", "evidence proposals", "surrogate", "runs"),
    "workbench/search/evidence": ("*", "attack"),
    "workbench/engine": (
        "layout",
        "sensitivity",
        "simulation",
        "objectives",
        "planar natural tree",
        "integration",
        "elements",
        "compiler",
        "errors",
    ),
    "workbench/engine/integration": ("*", "_kernels"),
    "workbench/engine/layout": ("*", "paths", "bound separable whole", "outcome", "formulation"),
    "workbench/engine/planar": ("*", "_kernels"),
    "workbench/engine/tree": ("robot_files", "*", "loops steps", "_kernels"),
    "doe": ("*", "optimal", "latin", "criteria portable", "_kernel_cache"),
    "surrogates": ("compiling", "screening", "analysis", "kriging", "likelihood", "errors _kernel_cache"),
    "surrogates/screening": ("*", "sets", "partitions"),
}

# folders of like things, which may be long: folder -> what each file is
GALLERIES = {
    "studies": "one problem per file, with its study file",
    "workbench/engine/elements": "one law per file",
}

NUMERICS = frozenset({"numpy", "scipy", "numba"})
# package -> what it may import from outside the house and Python's own library
STRANGERS: dict[str, frozenset[str]] = {
    "workbench/engine": NUMERICS,
    "doe": NUMERICS | {"pyDOE3"},
    "surrogates": NUMERICS | {"sklearn"},
    "workbench": NUMERICS
    | {"pandas", "xarray", "matplotlib", "pydantic", "pydantic_core"}
    | {"typer", "click", "rich", "jinja2", "psutil", "markupsafe"}
    # optional extras, imported inside functions
    | {"fmpy", "dask", "distributed", "h5netcdf", "pyarrow"},
    # sklearn: the peers that the screening study compares with
    "studies": NUMERICS | {"pandas", "xarray", "matplotlib", "sklearn"},
}


def rooms_on_disk(root: Path = ROOT) -> list[str]:
    """Folders of the packages that hold Python files, as paths below the root."""
    found = {path.parent.relative_to(root) for package in PACKAGES for path in (root / package).rglob("*.py")}
    return sorted(str(folder) for folder in found)


def sentence(room: str, root: Path = ROOT) -> str:
    """The first paragraph of a room's docstring, on one line."""
    text = ast.get_docstring(ast.parse((root / room / "__init__.py").read_text())) or ""
    return " ".join(text.split("\n\n")[0].split())


def diagram(root: Path = ROOT) -> str:
    """The rooms of every package from the top down, each with its sentence; `+` where it shares a floor."""
    lines: list[str] = []
    for package in (room for floor in FLOORS[""] for room in floor.split()):
        lines += [_line(f"{package}/", sentence(package, root)), *_rooms(package, root, depth=1), ""]
    return "\n".join(["```text", *lines[:-1], "```"])


def _rooms(folder: str, root: Path, *, depth: int) -> list[str]:
    lines: list[str] = []
    for floor in FLOORS[folder]:
        for place, name in enumerate(floor.split()):
            indent = "  " * depth + ("+ " if place else "  ")
            room = f"{folder}/{name}"
            if (root / room).is_dir():
                lines.append(_line(f"{indent}{name}/", sentence(room, root)))
                lines += _rooms(room, root, depth=depth + 1) if room in FLOORS else []
            else:
                lines.append(f"{indent}{name}.py")
    return lines


def _line(name: str, text: str) -> str:
    return f"{name:24}{text}"


def page_with_diagram(text: str, root: Path = ROOT) -> str:
    """The page with the diagram between its two marks; ValueError when a mark is missing."""
    before, rest = text.split(START)
    _, after = rest.split(END)
    return f"{before}{START}\n{diagram(root)}\n{END}{after}"


START, END = "<!-- the house: made by tests/house.py -->", "<!-- end of the house -->"

if __name__ == "__main__":
    if "--write" in sys.argv[1:]:
        page = ROOT / PAGE
        page.write_text(page_with_diagram(page.read_text()))
    else:
        print(diagram())
