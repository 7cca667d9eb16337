# mypy: ignore-errors
"""When a compiled kernel of the engine is out of date.

numba keeps machine code beside the source and takes it as fresh while the kernel's own file is unchanged. But
a kernel holds the code of the functions that it calls, which stand in other files. So the stamp of a compiled
kernel counts all files of the engine that hold compiled functions: an edit of any of them compiles all anew.

numba asks a list of locators where a function's code is kept and what its stamp is. Ours stand before its
own, answer for files of the engine alone, and keep the places as they are.
"""

from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from numba.core.caching import CompileResultCacheImpl

__all__ = ["COMPILED", "count_all_kernels", "is_kept", "kernels_digest"]

PACKAGE = Path(__file__).parent.parent
# files that hold compiled functions, and how they are compiled
COMPILED = ("**/_kernels_*.py", "**/_kernels/*.py", "elements/*.py", "compiler/*.py")


@cache
def kernels_digest(package):
    """Digest of the names and contents of all files of a package that hold compiled functions."""
    digest = sha256()
    for path in sorted({path for pattern in COMPILED for path in package.glob(pattern)}):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _stamped(locator, package):
    """A locator of numba's that answers for the files of a package, its stamp with the package's digest."""

    class Stamped(locator):
        @classmethod
        def from_function(cls, py_func, py_file):
            return super().from_function(py_func, py_file) if package in Path(py_file).parents else None

        def get_source_stamp(self):
            return super().get_source_stamp(), kernels_digest(package)

    Stamped.package = package
    Stamped.__name__ = locator.__name__  # numba takes those of users by their names
    return Stamped


def count_all_kernels(package=PACKAGE):
    """Let the stamp of every kernel of a package count all its files of compiled functions, from now on."""
    own = CompileResultCacheImpl._locator_classes
    if any(getattr(locator, "package", None) == package for locator in own):
        return
    theirs = [locator for locator in own if not hasattr(locator, "package")]
    CompileResultCacheImpl._locator_classes = [_stamped(locator, package) for locator in theirs] + list(own)


def is_kept(dispatcher: Any) -> bool:
    """Whether machine code of a kernel is kept that is not out of date, or there is no place to keep it."""
    file = getattr(dispatcher._cache, "_cache_file", None)
    return file is None or bool(file._load_index())
