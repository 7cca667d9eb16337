# mypy: ignore-errors
"""One kernel out of many of the same name, chosen by code, compiled.

The choices are written out of a table when they are compiled, one `if` an entry: closures, one inside the
other, would compile a function more for each.
"""

from functools import cache

from numba import njit
from numba.extending import overload

from ..compiler.held import names_listed
from ..compiler.options import INNER
from .table import code_of

__all__ = ["by_code", "by_held_code"]


def by_code(files, kernel, arguments):
    """The kernel of that name in the modules `files` (record -> module), as choose(code, *arguments)."""
    return njit(**INNER)(_written(files, files, kernel, f"code, {arguments}"))


def by_held_code(files, kernel, arguments):
    """The same as choose(held, code, *arguments), compiled for the records in the type of `held` alone; see
    `listed`.
    """
    written = cache(lambda names: _written(names, files, kernel, f"held, code, {arguments}"))
    choose = _written((), files, kernel, f"held, code, {arguments}")

    @overload(choose, jit_options=INNER, strict=False)
    def _chosen(*given):
        return written(names_listed(given[0]))

    return choose


def _written(names, files, kernel, arguments):
    """The choice among the kernels of some records, as a function of Python."""
    lines, kernels = [f"def choose({arguments}):", "    pass"], {}
    handed_on = arguments.partition("code, ")[2]
    for name in names:
        lines += [f"    if code == {code_of(name)}:", f"        {name}({handed_on})", "        return"]
        kernels[name] = getattr(files[name], kernel)
    exec("\n".join(lines), kernels)
    return kernels["choose"]
