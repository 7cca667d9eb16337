"""Who may import whom: the table of the house against the syntax trees."""

import ast
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
OURS = {"doe", "surrogates", "studies", "workbench", "workbench.engine"}
NUMERICS = {"numpy", "scipy", "numba"}
TABLE = {
    "workbench.engine": NUMERICS,
    "doe": NUMERICS | {"pyDOE3"},
    "surrogates": NUMERICS | {"sklearn"},
    "workbench": NUMERICS
    | {"doe", "surrogates", "workbench.engine", "pandas", "xarray", "matplotlib", "pydantic", "pydantic_core"}
    | {"typer", "click", "rich", "jinja2", "psutil", "markupsafe"}
    # optional extras, imported inside functions
    | {"fmpy", "dask", "distributed", "h5netcdf", "pyarrow"},
    "studies": NUMERICS
    | {"doe", "surrogates", "workbench", "workbench.engine", "pandas", "xarray", "matplotlib"}
    # the peers that the screening study compares with
    | {"sklearn"},
}


def room_of(module: str) -> str:
    """The room a dotted module name belongs to: ours, or the top-level name of a stranger."""
    if module == "workbench.engine" or module.startswith("workbench.engine."):
        return "workbench.engine"
    return module.split(".")[0]


def imports(path: Path, root: Path = ROOT) -> set[str]:
    """Rooms and packages that the file imports, relative imports resolved."""
    package = path.relative_to(root).with_suffix("").parts[:-1]
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {room_of(alias.name) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = list(package[: len(package) - node.level + 1]) if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            found |= {room_of(f"{module}.{alias.name}") for alias in node.names}
    return found


def violations(path: Path, root: Path = ROOT) -> set[str]:
    room = room_of(".".join(path.relative_to(root).with_suffix("").parts))
    return imports(path, root) - TABLE[room] - {room} - set(sys.stdlib_module_names) - {"__future__"}


FILES = sorted(
    p for room in ("doe", "surrogates", "studies", "workbench") for p in (ROOT / room).rglob("*.py")
)


@pytest.mark.parametrize("path", FILES, ids=lambda p: str(p.relative_to(ROOT)))
def test_only_the_allowed_rooms_are_imported(path):
    assert violations(path) == set()


@pytest.mark.parametrize(
    ("file", "code", "stranger"),
    [
        ("doe/latin/lhs.py", "import workbench.space", "workbench"),
        ("surrogates/likelihood/restricted.py", "from doe import lhs", "doe"),
        ("workbench/engine/layout/separable/sequence.py", "import xarray as xr", "xarray"),
        ("workbench/engine/layout/separable/sequence.py", "from ....study import Study", "workbench"),
        ("workbench/space/box.py", "from studies import welch20", "studies"),
    ],
)
def test_a_seeded_violation_is_found(tmp_path, file, code, stranger):
    path = tmp_path / file
    path.parent.mkdir(parents=True)
    path.write_text(code + "\n")
    assert violations(path, tmp_path) == {stranger}
