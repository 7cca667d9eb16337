"""Kernels on disk are out of date when any file of compiled functions is edited, not their own alone."""

import importlib
import sys

import pytest
from numba.core.caching import CompileResultCacheImpl

from tests.kernel_package import no_bytecode
from workbench.engine.compiler.cache import COMPILED, PACKAGE, count_all_kernels, kernels_digest

INNER = """from numba import njit
from workbench.engine.compiler.options import INNER


@njit(**INNER)
def inner(x):
    return x + {term}
"""
OUTER = """from numba import njit
from workbench.engine.compiler.options import ENTRY
from ._kernels_inner import inner


@njit(**ENTRY)
def outer(x):
    return inner(x)
"""


@pytest.fixture
def locators(monkeypatch):
    """The list of locators, put back afterwards, the engine's own among them."""
    importlib.import_module("workbench.engine.compiler.options")
    monkeypatch.setattr(
        CompileResultCacheImpl, "_locator_classes", list(CompileResultCacheImpl._locator_classes)
    )


def fresh(package):
    """The outer kernel as a new process would see it."""
    for name in [name for name in sys.modules if name.split(".")[0] == package]:
        del sys.modules[name]
    kernels_digest.cache_clear()
    importlib.invalidate_caches()
    with no_bytecode():
        return importlib.import_module(f"{package}._kernels_outer").outer


def answers_around_an_edit(folder, name):
    """outer(0.0) before an edit of the file of `inner`, after it, and again; whether the last was kept."""
    package = folder / name
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "_kernels_outer.py").write_text(OUTER)
    found = []
    for term in (1.0, 2.0):
        (package / "_kernels_inner.py").write_text(INNER.format(term=term))
        found.append(fresh(name)(0.0))
    last = fresh(name)
    found.append(last(0.0))
    return found, sum(last.stats.cache_hits.values())


def test_an_edited_inner_kernel_is_in_force_at_once(tmp_path, monkeypatch, locators):
    monkeypatch.syspath_prepend(str(tmp_path))
    count_all_kernels(tmp_path / "counted_kernels")
    assert answers_around_an_edit(tmp_path, "counted_kernels") == ([1.0, 2.0, 2.0], 1)
    # numba alone goes on with the old machine code
    assert answers_around_an_edit(tmp_path, "kernels_not_counted") == ([1.0, 1.0, 1.0], 1)


def test_the_engine_is_counted_once(locators):
    before = list(CompileResultCacheImpl._locator_classes)
    assert any(getattr(locator, "package", None) == PACKAGE for locator in before)
    count_all_kernels()
    assert CompileResultCacheImpl._locator_classes == before


def test_every_file_of_compiled_functions_is_counted():
    counted = {path for pattern in COMPILED for path in PACKAGE.glob(pattern)}
    marks = ("@njit(", "@inner\n", "from numba.extending import overload")
    compiled = {path for path in PACKAGE.rglob("*.py") if any(mark in path.read_text() for mark in marks)}
    assert len(compiled) > 20
    assert compiled <= counted
