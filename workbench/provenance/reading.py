"""The code behind readers that are functions: it belongs to the reading of a run, not to its simulation.

Of a reader counts what is its own: the functions of its file that it reaches, and what that file imports
inside the study's and the user's own folders with the data that is named there, less the files that the
simulation is made of, too. In a file that both share the reader owns what nothing else there names.
"""

import ast
import json
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatch
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.models.protocol import ModelSpec
from workbench.provenance.closure import closure_of, file_of, without_docstrings
from workbench.provenance.content import ContentCache

__all__ = ["digest_without", "reader_files", "readings_now"]

REST = ""  # name of all statements of a file that define no plain function or class

Part = Sequence[Any]  # name, digest, names that it uses


def readings_now(
    readings: Mapping[str, Mapping[str, Any]],
    spec: ModelSpec,
    starts: Sequence[Path],
    wanted: Mapping[str, Any],
    *,
    cache: ContentCache,
) -> dict[str, dict[str, Any]]:
    """How responses are read, with the digest of the code of those readers that are functions: `code`.

    `starts`: files that the simulation begins with; `wanted` is `[model.state]`, whose `exclude` counts here.
    """
    found = {name: dict(how) for name, how in readings.items()}
    if not any(_function(how) for how in readings.values()):
        return found
    study = Path(spec.folder)
    simulation = closure_of(starts, study, cache)
    readers = reader_files(spec)
    for how in found.values():
        file, _, name = _function(how).rpartition(":")
        path = file_of(file, study) if file else None
        if path is None or not path.is_file():
            continue
        closure = closure_of([path], study, cache)
        own = {n: d for n, d in closure.code.items() if n not in simulation.code}
        own |= {n: d for n, d in closure.data.items() if n not in simulation.data}
        own = {n: d for n, d in own.items() if not any(fnmatch(n, p) for p in wanted.get("exclude", ()))}
        here = next(n for n, place in closure.places.items() if place == path.resolve())
        parts = _parts(path, cache)
        if here in simulation.code:
            mine = _own_names(parts, readers[path.resolve()]) & _reached(parts, [name])
        else:
            mine = _reached(parts, [name, REST])
        if here in own or here in simulation.code:
            own[here] = _digest([p[1] for p in parts if p[0] in mine]) if parts else closure.code[here]
        how["code"] = _digest(sorted(own.items()))
    return found


def reader_files(spec: ModelSpec) -> dict[Path, list[str]]:
    """File of the study -> the functions in it that read responses."""
    found: dict[Path, list[str]] = {}
    for rule in spec.options.get("read", {}).values() if spec.kind == "command" else ():
        place, _, name = rule.get("function", "").rpartition(":")
        path = file_of(place, Path(spec.folder)) if place else None
        if path is not None:
            found.setdefault(path.resolve(), []).append(name)
    return found


def digest_without(path: Path, readers: Sequence[str], cache: ContentCache) -> str:
    """A digest of the code of a file less what is the readers' own."""
    parts = _parts(path, cache)
    own = _own_names(parts, readers)
    return _digest([part[1] for part in parts if part[0] not in own])


def _function(how: Mapping[str, Any]) -> str:
    return str(how.get("read", {}).get("function", ""))


def _digest(content: Any) -> str:
    return blake2b(json.dumps(content).encode(), digest_size=16).hexdigest()


def _parts(path: Path, cache: ContentCache) -> list[Part]:
    """Parts of a file of Python as `parts_of` gives them; none of anything else."""
    try:
        return list(cache.of(path, parts_of))
    except (OSError, SyntaxError, ValueError):
        return []


def parts_of(path: Path) -> list[Part]:
    """Name, digest and used names of each plain function and class of a file, and of all other statements.

    Raises:
        SyntaxError, ValueError: it is no Python.
    """
    tree = without_docstrings(ast.parse(path.read_bytes()))
    groups: dict[str, list[ast.stmt]] = {REST: []}
    for node in tree.body:
        plain = isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.decorator_list
        groups.setdefault(node.name if plain else REST, []).append(node)  # type: ignore[attr-defined]
    return [
        [name, _digest([ast.dump(node) for node in nodes]), sorted(_names(nodes))]
        for name, nodes in groups.items()
    ]


def _names(nodes: Iterable[ast.AST]) -> set[str]:
    """Names, attributes and texts in a piece of code: whatever may stand for a function."""
    found = set()
    for top in nodes:
        for node in ast.walk(top):
            if isinstance(node, ast.Name):
                found.add(node.id)
            elif isinstance(node, ast.Attribute):
                found.add(node.attr)
            elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
                found.add(node.value)
    return found


def _reached(parts: Sequence[Part], names: Iterable[str]) -> set[str]:
    """Parts that the named ones use, and those that these use, and so on."""
    uses = {part[0]: set(part[2]) for part in parts}
    found: set[str] = set()
    waiting = [name for name in names if name in uses]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += [other for other in uses[name] if other in uses and other not in found]
    return found


def _own_names(parts: Sequence[Part], readers: Iterable[str]) -> set[str]:
    """What the readers reach and nothing else of the file uses."""
    named = [name for name in readers if name != REST]
    own = _reached(parts, named) - {REST}
    while True:
        shared = {used for part in parts if part[0] not in own for used in part[2]} & own
        if not shared:
            return own
        own -= shared
