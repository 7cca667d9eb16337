"""A compiled kernel is out of date when any kernel file of the package has changed."""

from pathlib import Path

import pytest
from numba.core.caching import NullCache

import doe
from doe import _kernel_cache
from doe._kernel_cache import kernel
from doe.latin._kernels_swaps import move_tables, search
from tests.kernel_package import answers_around_an_edit, kernel_imports


@pytest.mark.parametrize("how", ["", "inner=True"])
def test_an_edit_of_an_inner_kernel_reaches_its_callers(tmp_path, how):
    assert answers_around_an_edit(Path(_kernel_cache.__file__), tmp_path, how) == (1.0, 2.0, 2.0)


def test_what_kernels_alone_call_has_no_file():
    assert isinstance(move_tables._cache, NullCache)
    assert not isinstance(search._cache, NullCache)


def test_what_kernels_alone_call_refuses_python():
    """Before a kernel has called it, and behind that: without a wrapper the process would end."""

    @kernel(inner=True)
    def halved(x):
        return 0.5 * x

    @kernel()
    def quartered(x):
        return halved(halved(x))

    refusal = "kernel 'halved' is for kernels alone; drop inner=True to call it from Python"
    with pytest.raises(TypeError, match=refusal):
        halved(1.0)
    assert quartered(1.0) == 0.25
    with pytest.raises(TypeError, match=refusal):
        halved(1.0)


def test_kernels_rest_on_kernel_files_alone():
    """What a compiled kernel holds stands in files that the digest counts."""
    for name, imported in kernel_imports(Path(doe.__file__).parent).items():
        strangers = {m for m in imported if not m.startswith("_kernels_")}
        assert strangers <= {"_kernel_cache", "math", "numpy", "typing"}, name


def test_the_digest_counts_names_and_contents(tmp_path, monkeypatch):
    monkeypatch.setattr(_kernel_cache, "PACKAGE", tmp_path)
    digest = _kernel_cache.kernels_digest.__wrapped__
    seen = {digest()}
    (tmp_path / "_kernels_a.py").write_text("x = 1\n")
    seen.add(digest())
    (tmp_path / "_kernels_a.py").write_text("x = 2\n")
    seen.add(digest())
    (tmp_path / "_kernels_a.py").rename(tmp_path / "_kernels_b.py")
    seen.add(digest())
    assert len(seen) == 4
    (tmp_path / "other.py").touch()
    assert digest() in seen


def test_without_a_place_for_a_cache_kernels_are_compiled_all_the_same(monkeypatch):
    def nowhere(self, function):
        raise RuntimeError("cannot cache function: no locator available")

    monkeypatch.setattr("doe._kernel_cache._PackageCache.__init__", nowhere)

    @kernel()
    def doubled(x):
        return 2.0 * x

    assert doubled(1.5) == 3.0
