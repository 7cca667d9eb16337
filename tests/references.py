"""Paths and dotted names of the house, wherever text speaks of them: pages, docstrings and comments."""

import ast
import io
import re
import tokenize
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

from tests.house import PACKAGES

__all__ = ["missing_names", "missing_paths", "texts"]

OURS = "|".join(PACKAGES)
PATH = re.compile(rf"(?<![\w./<-])(?:{OURS}|tests|docs)/[\w./*-]*\w")
NAME = re.compile(rf"(?<![\w./-])(?:{OURS})(?:\.[A-Za-z_]\w*)+(?![\w/])")
LINK = re.compile(r"\]\((?!https?:|#|mailto:)([^)#\s]+)")


def texts(root: Path) -> Iterator[tuple[Path, str]]:
    """Every page, and what a Python file says beside its code: its docstrings and comments."""
    pages = [*(root / "docs").rglob("*.md"), *root.glob("*.md")]
    yield from ((page, page.read_text()) for page in sorted(pages))
    for folder in (*PACKAGES, "tests"):
        for path in sorted((root / folder).rglob("*.py")):
            yield path, said(path.read_text())


def said(code: str) -> str:
    """Docstrings and comments of a file."""
    tree = ast.parse(code)
    kinds = (ast.Module, ast.ClassDef, ast.FunctionDef)
    parts = [ast.get_docstring(node) or "" for node in ast.walk(tree) if isinstance(node, kinds)]
    tokens = tokenize.generate_tokens(io.StringIO(code).readline)
    parts += [token.string for token in tokens if token.type == tokenize.COMMENT]
    return "\n".join(parts)


def missing_paths(text: str, page: Path, root: Path) -> list[str]:
    """Paths below the root, and links of a page, that lead nowhere; `*` stands for anything."""
    found = [path for path in PATH.findall(text) if not any(root.glob(path.rstrip("/")))]
    if page.suffix == ".md":
        found += [link for link in LINK.findall(text) if not (page.parent / link).exists()]
    return found


def missing_names(text: str, root: Path) -> list[str]:
    """Dotted names that name no module, nothing that a module holds, and no style of matplotlib's."""
    names = [name for name in NAME.findall(text) if not name.endswith(".py")]
    styles = [name for name in names if (root / name.replace(".", "/")).with_suffix(".mplstyle").exists()]
    return [name for name in names if name not in styles and not held(name)]


def held(name: str) -> bool:
    """Does a dotted name lead to a module, or from one to something it holds? An old name of one does not."""
    first, *rest = name.split(".")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", DeprecationWarning)
            found: object = import_module(first)
            for k, part in enumerate(rest, start=1):
                if hasattr(found, part):  # a function before the module that bore its name
                    found = getattr(found, part)
                else:
                    found = import_module(".".join((first, *rest[:k])))
    except (ModuleNotFoundError, DeprecationWarning):
        return False
    return True
