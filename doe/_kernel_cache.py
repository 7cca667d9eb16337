# mypy: ignore-errors
"""How the kernels are compiled, and when a compiled one is out of date.

numba keeps machine code beside the source and takes it as fresh while the kernel's own file is unchanged.
But a kernel holds the code of the kernels that it calls, which may stand in other files. So here the stamp of
a compiled kernel counts all kernel files of the package: an edit of any of them compiles all anew.
"""

from contextlib import suppress
from functools import cache
from hashlib import sha256
from pathlib import Path

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

__all__ = ["kernel"]

PACKAGE = Path(__file__).parent


@cache
def kernels_digest():
    """Digest of the names and contents of all kernel files of the package."""
    digest = sha256()
    for path in sorted(PACKAGE.rglob("_kernels_*.py")):
        digest.update(path.relative_to(PACKAGE).as_posix().encode())
        digest.update(sha256(path.read_bytes()).digest())
    return digest.hexdigest()


class _PackageCache(FunctionCache):
    """numba's cache of a function, with a stamp of the whole package."""

    def __init__(self, function):
        super().__init__(function)
        self._cache_file = IndexDataCacheFile(
            cache_path=self._cache_path,
            filename_base=self._impl.filename_base,
            source_stamp=(self._impl.locator.get_source_stamp(), kernels_digest()),
        )


def kernel(*, fastmath=False, allocates=True, inline="never", inner=False):
    """Compile a kernel: no checks of divisors, which cost a factor of 8, and kept beside its source.

    fastmath: sums in any order and no NaN; without it the same bits come out on every processor.
    allocates: False for a kernel that makes no arrays: those it is given are not counted as they are handed
    on, which costs more than the work of a swap where they come in records.
    inline: "always" for a step of one loop that is put into its caller's source.
    inner: True for what kernels alone call: no wrapper for Python and no file of its own, which take as long
    to make as a small kernel.
    """

    def compiled(function):
        dispatcher = njit(
            fastmath=fastmath, error_model="numpy", _nrt=allocates, inline=inline,
            no_cfunc_wrapper=True, no_cpython_wrapper=inner,
        )(function)  # fmt: skip
        if inner:
            return _refusing_python(dispatcher)
        # where neither the package nor a home can be written, numba has no place for a cache
        with suppress(RuntimeError):
            dispatcher._cache = _PackageCache(function)
        return dispatcher

    return compiled


def _refusing_python(dispatcher):
    """A kernel without a wrapper says so where Python calls it: numba would jump to nowhere."""

    def refused(*args, **kws):
        name = dispatcher.py_func.__name__
        raise TypeError(f"kernel '{name}' is for kernels alone; drop inner=True to call it from Python")

    def kept(compiled):  # without an entry that Python's calls would find
        dispatcher.overloads[tuple(compiled.signature.args)] = compiled

    dispatcher._compile_for_args, dispatcher.add_overload = refused, kept
    return dispatcher
