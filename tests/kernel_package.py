"""A small package of two kernels, one calling the other, for tests of how kernels are kept compiled."""

import ast
import importlib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

INNER = "from ._kernel_cache import kernel\n\n\n@kernel({how})\ndef inner(x):\n    return x + {term}\n"
OUTER = """from ._kernel_cache import kernel
from ._kernels_inner import inner


@kernel()
def outer(x):
    return inner(x)
"""


def answers_around_an_edit(source: Path, folder: Path, how: str = "") -> tuple[float, float, float]:
    """What `outer(0.0)` says before an edit of the file of `inner`, after it, and from the cache then.

    source: the `_kernel_cache.py` under test, copied into a package made in `folder`.
    how: what is said to `kernel` of `inner`.
    """
    package = folder / "kernels_under_test"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "_kernel_cache.py").write_text(source.read_text())
    (package / "_kernels_outer.py").write_text(OUTER)
    sys.path.insert(0, str(folder))
    try:
        found = []
        for term in (1.0, 2.0, 2.0):
            inner = package / "_kernels_inner.py"
            text = INNER.format(term=term, how=how)
            if not inner.exists() or inner.read_text() != text:
                inner.write_text(text)
            found.append(_fresh(package.name).outer(0.0))
        hits = _fresh(package.name).outer
        hits(0.0)
        assert sum(hits.stats.cache_hits.values()) == 1
        return tuple(found)
    finally:
        sys.path.remove(str(folder))
        _forget(package.name)


def _forget(package: str) -> None:
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        del sys.modules[name]


def _fresh(package: str):
    """The outer kernels as a new process would see them."""
    _forget(package)
    importlib.invalidate_caches()
    with no_bytecode():
        return importlib.import_module(f"{package}._kernels_outer")


@contextmanager
def no_bytecode() -> Iterator[None]:
    """Imports that leave none: Python takes it as fresh after an edit in the same second to the same size."""
    before, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        yield
    finally:
        sys.dont_write_bytecode = before


def kernel_imports(package: Path) -> dict[str, set[str]]:
    """Last part of every module that each kernel file of a package imports from."""
    found = {}
    for path in sorted(package.rglob("_kernels_*.py")):
        names = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                names.add((node.module or "").split(".")[-1])
        found[path.name] = names
    return found
