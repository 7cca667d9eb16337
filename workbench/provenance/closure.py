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

from workbench.models.python import source_digest
from workbench.provenance.content import ContentCache, digest_of

__all__ = ["Closure", "closure_of", "digest_of_function", "file_of", "without_docstrings"]

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
    put_on_path: list[Path] = []  # by the code, which imports from there, too
    unfound: list[tuple[str, Path]] = []
    while waiting:
        path = waiting.pop()
        if path not in seen and path.is_file():
            seen.add(path)
            content = _read_into(found, path, study, cache)
            if content.get("puts_on_path"):
                put_on_path += _named_folders(content["names"], _folders(path, study))
            unfound += [(module, path) for module in content.get("imports", ())]
        if not waiting:  # what is put on the path anywhere serves what is imported anywhere
            modules, unfound = unfound, []
            for module, importer in modules:
                files = _module_files(module, importer, _folders(importer, study), put_on_path)
                waiting += [file for file in files if file not in seen]
                if not files:
                    unfound.append((module, importer))
    found.packages |= {top for module, _ in unfound for top in _package_of(module)}
    return found


def _read_into(found: Closure, path: Path, study: Path, cache: ContentCache) -> dict[str, Any]:
    """What a file of code holds, {} where it is no Python; `found` gets it and its data."""
    name = _name(path, study)
    found.places[name] = path.resolve()
    try:
        content: dict[str, Any] = cache.of(path, read_code)
    except (OSError, SyntaxError, ValueError):
        found.code[name] = digest_of(path)
        return {}
    found.code[name] = content["digest"]
    folders = _folders(path, study)
    files = [text for text in content["names"] if FILE.search(text)]
    places = [f / d for f in folders for d in content["names"] if PLACE.match(d)] if files else []
    for folder in (*folders, *(place for place in places if place.is_dir())):
        for file in (folder / text for text in files):
            if file.is_file() and not (file.suffix == ".toml" and cache.of(file, is_study)):
                found.data[_name(_absolute(file), study)] = cache.of(file, digest_of)
    return content


def _folders(path: Path, study: Path) -> list[Path]:
    """Where the code of a file finds modules and data."""
    return list(dict.fromkeys([study, path.parent, path.resolve().parent]))


def file_of(place: str, study: Path) -> Path | None:
    """The file of `file.py` or of a dotted module, without importing it; None where there is none of ours."""
    if place.endswith(".py"):
        return study / place
    files = _module_files(place, study / "study.toml", [study])
    return files[-1] if files else None


def digest_of_function(reference: str, study: Path) -> str:
    """A digest of "module:function" with what it imports and names of the user's own; of its file alone where
    that is installed."""
    start = file_of(reference.partition(":")[0], study)
    if start is None:
        return source_digest(reference, study)
    found = closure_of([start], study, ContentCache(None))
    text = repr([sorted(found.code.items()), sorted(found.data.items())])
    return blake2b(text.encode(), digest_size=16).hexdigest()


def is_study(path: Path) -> bool:
    """Whether a file is a study, which is no data of its model."""
    return STUDY.search(path.read_text(encoding="utf-8", errors="replace")) is not None


def read_code(path: Path) -> dict[str, Any]:
    """Digest of the code, modules that it imports (relative ones with dots), texts that may name data, and
    whether it changes where modules are imported from.

    Raises:
        SyntaxError, ValueError: it is no Python.
    """
    tree = ast.parse(path.read_bytes())
    imports: set[str] = set()
    names: set[str] = set()
    written: set[str] = set()  # what the code writes is no input
    puts_on_path = False
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            imports.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = "." * node.level + (node.module or "")
            imports.add(base)
            joint = "" if base.endswith(".") else "."
            imports.update(f"{base}{joint}{alias.name}" for alias in node.names if alias.name != "*")
        elif isinstance(node, ast.Attribute) and _is_path_of_imports(node):
            puts_on_path = True
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
    return {
        "digest": digest,
        "imports": sorted(imports),
        "names": sorted(names),
        "puts_on_path": puts_on_path,
    }


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


def _is_path_of_imports(node: ast.Attribute) -> bool:
    """Whether it is `sys.path` or `site.addsitedir`."""
    of = getattr(node.value, "id", "")
    return (of, node.attr) in (("sys", "path"), ("site", "addsitedir"))


def _named_folders(names: Sequence[str], folders: Sequence[Path]) -> list[Path]:
    """Folders that texts of code name, in one part or two, seen from `folders` and from the two above each;
    and these themselves.
    """
    above = list(dict.fromkeys(up for folder in folders for up in (folder, *folder.parents[:2])))
    texts = [name for name in names if PLACE.match(name)]
    named = [place for up in above for name in texts if (place := up / name).is_dir()]
    inside = [place for folder in named for name in texts if (place := folder / name).is_dir()]
    return [*named, *inside, *above]


def _package_of(module: str) -> set[str]:
    """The package that a module belongs to, where it is neither Python's own nor a relative one."""
    top = module.partition(".")[0]
    return {top} if top and top not in sys.stdlib_module_names else set()


def _writes(node: ast.Call) -> bool:
    """Whether a call writes a file: open(..., "w"), save(...), to_csv(...), path.write_text(...)."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    if name != "open":
        return name.startswith(("save", "to_", "write"))
    mode = [*node.args[1:2], *(k.value for k in node.keywords if k.arg == "mode")]
    return any(isinstance(getattr(m, "value", None), str) and set("wax+") & set(m.value) for m in mode)  # type: ignore[attr-defined]


def _module_files(
    module: str, importer: Path, folders: Sequence[Path], put_on_path: Sequence[Path] = ()
) -> list[Path]:
    """Files that importing `module` runs: its packages and itself; none where it is not the user's own.

    put_on_path: folders in which it is looked for where it is neither in `folders` nor installed.
    """
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
    if spec is None:
        return next((files for folder in put_on_path if (files := _below(folder, parts))), [])
    origin = spec.origin
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
