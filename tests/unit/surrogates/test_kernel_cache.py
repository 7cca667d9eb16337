"""A compiled kernel is out of date when any kernel file of the package has changed."""

from pathlib import Path

import surrogates
from surrogates import _kernel_cache
from surrogates._kernel_cache import is_kept, kernel
from tests.kernel_package import answers_around_an_edit, kernel_imports


def test_an_edit_of_an_inner_kernel_reaches_its_callers(tmp_path):
    assert answers_around_an_edit(Path(_kernel_cache.__file__), tmp_path) == (1.0, 2.0, 2.0)


def test_kernels_rest_on_kernel_files_alone():
    """What a compiled kernel holds stands in files that the digest counts."""
    for name, imported in kernel_imports(Path(surrogates.__file__).parent).items():
        strangers = {m for m in imported if not m.startswith("_kernels_")}
        assert strangers <= {"_kernel_cache", "math", "numpy"}, name


def test_without_a_place_for_a_cache_kernels_are_compiled_all_the_same(monkeypatch):
    def nowhere(self, function):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr("surrogates._kernel_cache._PackageCache.__init__", nowhere)

    @kernel()
    def doubled(x):
        return 2.0 * x

    assert doubled(1.5) == 3.0
    assert is_kept(doubled)  # there is nothing to wait for


def test_a_kernel_is_kept_once_it_was_called(monkeypatch, tmp_path):
    monkeypatch.setattr("numba.config.CACHE_DIR", str(tmp_path))

    @kernel()
    def tripled(x):
        return 3.0 * x

    assert not is_kept(tripled)
    assert tripled(2.0) == 6.0
    assert is_kept(tripled)
