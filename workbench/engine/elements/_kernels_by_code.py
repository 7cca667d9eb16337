# mypy: ignore-errors
"""One kernel out of many of the same name, chosen by code, compiled.

The choices are written out of a table when they are compiled, one `if` an entry: closures, one inside the
other, would compile a function more for each.
"""

from numba import njit

from ..compiler.options import INNER
from .table import code_of

__all__ = ["by_code"]


def by_code(files, kernel, arguments):
    """The kernel of that name in the modules `files` (record -> module), as choose(code, *arguments)."""
    lines = [f"def choose(code, {arguments}):"]
    kernels = {}
    for name, file in files.items():
        lines += [f"    if code == {code_of(name)}:", f"        {name}({arguments})", "        return"]
        kernels[name] = getattr(file, kernel)
    exec("\n".join(lines), kernels)
    return njit(**INNER)(kernels["choose"])
