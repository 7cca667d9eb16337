"""The public names of `doe`: sorted, loaded on first use, never hidden by a module of the same name."""

import inspect
import subprocess
import sys
from importlib import import_module

import pytest

import doe


def test_names_are_sorted_and_exist():
    assert doe.__all__ == sorted(doe.__all__)
    assert set(doe.__all__) <= set(dir(doe))
    for name in doe.__all__:
        assert getattr(doe, name).__name__ == name
        assert getattr(doe, name).__doc__


def test_importing_a_module_does_not_hide_the_function_of_its_name():
    for name, module in (("lhs", "latin.lhs"), ("ihs", "latin.ihs"), ("quality", "quality")):
        assert inspect.ismodule(import_module(f"doe.{module}"))
        assert inspect.isfunction(getattr(doe, name))


def test_importing_the_package_loads_nothing_heavy():
    code = "import doe, sys; print([m for m in ('numpy', 'numba', 'scipy', 'pyDOE3') if m in sys.modules])"
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_a_name_that_does_not_exist_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'doe' has no attribute 'latain'"):
        getattr(doe, "latain")  # noqa: B009 - a misspelt attribute, on purpose
