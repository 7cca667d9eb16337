"""The files behind a Python function: what it imports inside the user's own folders, and the data they name.

Code is compared by its syntax tree without docstrings: comments, blank lines and line lengths change nothing.
Installed packages and Python's own library are not followed; they are named, and their versions stand in the
state of the model.
"""

import ast
import os
import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass, field
from hashlib import blake2b
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any

from workbench.provenance.content import ContentCache, digest_of

__all__ = ["Closure", "closure_of", "file_of", "without_docstrings"]

HOUSE = frozenset({"workbench", "doe", "surrogates"})  # holdfast's own, known by its version
LONGEST_NAME = 200
FILE = re.compile(r"\.(?!py$)\w{1,8}$")  # texts that may name a file of data
PLACE = re.compile(r"[\w/-]+$")  # and a folder
STUDY = re.compile(r"^\s*\[study\]", re.MULTILINE)
INSTALLED = ("site-packages", "dist-packages")


@dataclass(slots=True)
class Closure:
    """Files by the name they have wherever the folder stands -> digest; packages that they import.

    places: name of a file of code -> where it stands here.
    """

    code: dict[str, str] = field(default_factory=dict)
    places: dict[str, Path] = field(default_factory=dict)
    data: dict[str, str] = field(default_factory=dict)
    packages: set[str] = field(default_factory=set)


def closure_of(starts: Sequence[Path], study: Path, cache: ContentCache) -> Closure:
    """The Python files `starts`, what they import from the user's folders, and the data files they name."""
    found = Closure()
    waiting = [_absolute(path) for path in starts]
    seen: set[Path] = set()
    while waiting:
        path = waiting.pop()
        if path in seen or not path.is_file():
            continue
        seen.add(path)
        folders = list(dict.fromkeys([study, path.parent, path.resolve().parent]))
        found.places[_name(path, study)] = path.resolve()
        try:
            content = cache.of(path, parsed)
        except (OSError, SyntaxError, ValueError):
            found.code[_name(path, study)] = digest_of(path)
            continue
        found.code[_name(path, study)] = content["digest"]
        for module in content["imports"]:
            files = _module_files(module, path, folders)
            waiting += files
            top = module.lstrip(".").partition(".")[0]
            if not files and top and not module.startswith(".") and top not in sys.stdlib_module_names:
                found.packages.add(top)
        files = [name for name in content["names"] if FILE.search(name)]
        places = [f / d for f in folders for d in content["names"] if PLACE.match(d)] if files else []
        for folder in (*folders, *(place for place in places if place.is_dir())):
            for file in (folder / name for name in files):
                if file.is_file() and not (file.suffix == ".toml" and cache.of(file, is_study)):
                    found.data[_name(_absolute(file), study)] = cache.of(file, digest_of)
    return found


def file_of(place: str, study: Path) -> Path | None:
    """The file of `file.py` or of a dotted module, without importing it; None where there is none of ours."""
    if place.endswith(".py"):
        return study / place
    files = _module_files(place, study / "study.toml", [study])
    return files[-1] if files else None


def is_study(path: Path) -> bool:
    """Whether a file is a study, which is no data of its model."""
    return STUDY.search(path.read_text(encoding="utf-8", errors="replace")) is not None


def parsed(path: Path) -> dict[str, Any]:
    """Digest of the code, modules that it imports (relative ones with dots), and texts that may name data.

    Raises:
        SyntaxError, ValueError: it is no Python.
    """
    tree = ast.parse(path.read_bytes())
    imports: set[str] = set()
    names: set[str] = set()
    written: set[str] = set()  # what the code writes is no input
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = "." * node.level + (node.module or "")
            imports.add(base)
            joint = "" if base.endswith(".") else "."
            imports.update(f"{base}{joint}{alias.name}" for alias in node.names if alias.name != "*")
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = node.value
            if text and len(text) <= LONGEST_NAME and "\n" not in text and "\0" not in text:
                names.add(text)
        elif isinstance(node, ast.Call) and _is_import_call(node):
            imports.add(node.args[0].value)  # type: ignore[attr-defined]
        elif isinstance(node, ast.Call) and _writes(node):
            texts = (n.value for n in ast.walk(node) if isinstance(n, ast.Constant))
            written.update(text for text in texts if isinstance(text, str))
    names -= written
    digest = blake2b(
        ast.dump(without_docstrings(tree)).encode("utf-8", "surrogatepass"), digest_size=16
    ).hexdigest()
    return {"digest": digest, "imports": sorted(imports), "names": sorted(names)}


def without_docstrings(tree: ast.Module) -> ast.Module:
    """The same tree, whose functions, classes and module have no docstrings any more."""
    for node in ast.walk(tree):
        body = getattr(node, "body", None)
        if isinstance(body, list) and isinstance(
            node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef
        ):
            if ast.get_docstring(node, clean=False) is not None:
                node.body = body[1:]
    return tree


def _is_import_call(node: ast.Call) -> bool:
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    given = node.args[0] if node.args else None
    return name in ("import_module", "__import__") and isinstance(getattr(given, "value", None), str)


def _writes(node: ast.Call) -> bool:
    """Whether a call writes a file: open(..., "w"), save(...), to_csv(...), path.write_text(...)."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if name != "open":
        return name.startswith(("save", "to_", "write"))
    mode = [*node.args[1:2], *(k.value for k in node.keywords if k.arg == "mode")]
    return any(isinstance(getattr(m, "value", None), str) and set("wax+") & set(m.value) for m in mode)  # type: ignore[attr-defined]


def _module_files(module: str, importer: Path, folders: Sequence[Path]) -> list[Path]:
    """Files that importing `module` runs: its packages and itself; none where it is not the user's own."""
    dots = len(module) - len(module.lstrip("."))
    parts = [part for part in module.lstrip(".").split(".") if part]
    if dots:
        root = importer.parent
        for _ in range(dots - 1):
            root = root.parent
        return _below(root, parts)
    if not parts or parts[0] in HOUSE or parts[0] in sys.stdlib_module_names:
        return []
    for folder in folders:
        files = _below(folder, parts)
        if files:
            return files
    try:
        spec = PathFinder.find_spec(parts[0])
    except (ImportError, ValueError, OSError):
        return []
    origin = None if spec is None else spec.origin
    if origin is None or not origin.endswith(".py") or any(word in Path(origin).parts for word in INSTALLED):
        return []
    place = Path(origin)
    return _below(place.parent.parent if place.name == "__init__.py" else place.parent, parts)


def _below(root: Path, parts: Sequence[str]) -> list[Path]:
    """Files of a dotted name below a folder; a part that is no module is a name inside the one before."""
    files: list[Path] = []
    place = root
    for part in parts:
        if (place / part / "__init__.py").is_file():
            place = place / part
            files.append(place / "__init__.py")
        elif (place / f"{part}.py").is_file():
            files.append(place / f"{part}.py")
            break
        elif (place / part).is_dir():
            place = place / part
        else:
            break
    return [_absolute(file) for file in files]


def _absolute(path: Path) -> Path:
    """Where a file is looked for; a link is not followed: it is the content there that counts."""
    return Path(os.path.abspath(path))


def _name(path: Path, study: Path) -> str:
    """Of a file below the study's folder where it stands there, else its last two parts."""
    for place, folder in ((path, study), (path, study.resolve()), (path.resolve(), study.resolve())):
        if place.is_relative_to(folder):
            return place.relative_to(folder).as_posix()
    return "/".join(path.parts[-2:])
