"""Every import of the four packages as an arrow between files, read from the syntax trees.

Imports at the top of a file, inside functions, under `TYPE_CHECKING`, relative ones, and
`import_module("...")` with a name written out all count. What counts as one arrow: the file that
imports, and the file that defines the module named (a package stands for its `__init__.py`).
"""

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import TypeGuard

__all__ = ["arrows", "circles", "files_of", "module_of", "named_modules", "opens_by_name"]


def module_of(path: Path, root: Path) -> str:
    """The dotted name of a file below `root`; a package's `__init__.py` carries the package's name."""
    parts = path.relative_to(root).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def files_of(root: Path, packages: Iterable[str]) -> dict[str, Path]:
    """Dotted name -> file of every module of the packages below `root`."""
    paths = (path for package in packages for path in sorted((root / package).rglob("*.py")))
    return {module_of(path, root): path for path in paths}


def named_modules(path: Path, root: Path) -> set[str]:
    """Dotted names that a file imports, as far down as written: `from a.b import c` gives a.b.c."""
    package = path.relative_to(root).parts[:-1]
    return set(_imports(path.read_text(), package))


@cache  # several checks read the same files
def _imports(text: str, package: tuple[str, ...]) -> frozenset[str]:
    return frozenset(name for node in ast.walk(ast.parse(text)) for name in _names(node, package))


def _names(node: ast.AST, package: tuple[str, ...]) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = package[: len(package) - node.level + 1] if node.level else ()
        start = ".".join([*base, *([node.module] if node.module else [])])
        yield from (f"{start}.{alias.name}" for alias in node.names)
    elif _is_opening(node) and isinstance(node.args[0], ast.Constant):
        yield str(node.args[0].value)


def _is_opening(node: ast.AST) -> TypeGuard[ast.Call]:
    """Is it a call of `import_module` with something?"""
    if not isinstance(node, ast.Call) or not node.args:
        return False
    called = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return called in ("import_module", "__import__")


def opens_by_name(path: Path) -> bool:
    """Does a file import modules whose names it computes or reads from a table?"""
    tree = ast.parse(path.read_text())
    calls = [node for node in ast.walk(tree) if _is_opening(node)]
    return any(not isinstance(call.args[0], ast.Constant) for call in calls)


def arrows(root: Path, packages: Iterable[str]) -> dict[str, set[str]]:
    """Module -> modules of the packages that it imports, itself left out."""
    files = files_of(root, packages)
    return {
        module: {found for name in named_modules(path, root) if (found := _file_of(name, files))} - {module}
        for module, path in files.items()
    }


def _file_of(name: str, files: dict[str, Path]) -> str | None:
    """The longest beginning of a dotted name that is a module of ours, or None for a stranger."""
    while name not in files:
        name, _, last = name.rpartition(".")
        if not last:
            return None
    return name


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of nodes that reach one another (Tarjan 1972), each sorted, single nodes left out."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        index[node] = low[node] = len(index)
        stack.append(node)
        for target in sorted(graph.get(node, ())):
            if target not in index:
                visit(target)
                low[node] = min(low[node], low[target])
            elif target in stack:
                low[node] = min(low[node], index[target])
        if low[node] == index[node]:
            cut = stack.index(node)
            if len(stack) - cut > 1:
                found.append(sorted(stack[cut:]))
            del stack[cut:]

    for node in sorted(graph):
        if node not in index:
            visit(node)
    return sorted(found)
