# mypy: ignore-errors
"""Options of the compiled kernels, chosen for short compile times and fast loops.

No kernel allocates (`_nrt`: no reference counts in the code), division follows IEEE (worth a factor 8 in the
member loops), and only kernels that Python calls carry wrappers and a place in the cache on disk.
"""

from numba import njit

from . import cache
from .passes import CalledCompiler, InnerCompiler, KernelCompiler

__all__ = ["CALLED", "CAREFUL", "ENTRY", "INNER", "inner"]

cache.count_all_kernels()

INNER = {
    "fastmath": True,
    "error_model": "numpy",
    "_nrt": False,
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
    "pipeline_class": InnerCompiler,
}
CALLED = {**INNER, "pipeline_class": CalledCompiler}
# nogil: load cases are simulated in threads (simulation/side_by_side.py)
CAREFUL = {
    "error_model": "numpy",
    "_nrt": False,
    "no_cfunc_wrapper": True,
    "cache": True,
    "nogil": True,
    "pipeline_class": KernelCompiler,
}  # sees NaN
ENTRY = {"fastmath": True, **CAREFUL}


def inner(function):
    """Compile a function that only kernels call, as `njit(**INNER)` does."""
    return njit(**INNER)(function)
