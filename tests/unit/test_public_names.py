"""The public names of the workbench are there, sorted, and loaded on first use only."""

import subprocess
import sys

import pytest

import workbench

HEAVY = ("numba", "sklearn", "xarray", "pandas", "matplotlib", "scipy.stats", "pydantic")


def modules_after(code: str) -> set[str]:
    """Names in sys.modules of a fresh interpreter that ran `code`."""
    text = subprocess.run(
        [sys.executable, "-c", f"{code}\nimport sys; print(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
    ).stdout
    return set(text.split())


def test_names_are_sorted_and_exist():
    assert workbench.__all__ == sorted(workbench.__all__)
    for name in workbench.__all__:
        assert getattr(workbench, name).__name__ == name
    assert set(workbench.__all__) <= set(dir(workbench))


def test_a_module_never_hides_the_function_of_its_name():
    code = "import workbench.search.worst_case; from workbench import worst_case; print(callable(worst_case))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"


def test_a_name_that_does_not_exist_is_an_attribute_error():
    with pytest.raises(AttributeError, match="module 'workbench' has no attribute 'Campain'"):
        getattr(workbench, "Campain")  # noqa: B009 - a misspelt attribute, on purpose


def test_the_version_is_known():
    assert workbench.__version__.count(".") == 2


def test_importing_the_workbench_loads_nothing_heavy():
    loaded = modules_after("import workbench, workbench.engine")
    assert not {m for m in (*HEAVY, "numpy", "doe", "surrogates") if m in loaded}
