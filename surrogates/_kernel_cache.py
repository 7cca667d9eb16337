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
from typing import Any

from numba import njit
from numba.core.caching import FunctionCache, IndexDataCacheFile

__all__ = ["is_kept", "kernel"]

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


def kernel(*, fastmath=True, inline="never"):
    """Compile a kernel: no checks of divisors, which cost a factor of 8, and kept beside its source.

    fastmath: sums in any order and no NaN.
    inline: "always" for what is put into its callers' source.
    """

    def compiled(function):
        dispatcher = njit(fastmath=fastmath, error_model="numpy", inline=inline)(function)
        # where neither the package nor a home can be written, numba has no place for a cache
        with suppress(RuntimeError):
            dispatcher._cache = _PackageCache(function)
        return dispatcher

    return compiled


def is_kept(dispatcher: Any) -> bool:
    """Whether machine code of a kernel is kept that is not out of date, or there is no place to keep it."""
    file = getattr(dispatcher._cache, "_cache_file", None)
    return file is None or bool(file._load_index())
