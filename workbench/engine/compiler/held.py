# mypy: ignore-errors
"""Compiled in where a system holds something, compiled to nothing where it does not.

A kernel is compiled for the types of its arguments, so what a system holds has to show in a type: the table
of something absent has no rows, and `ABSENT` for the type of its items (`marked`). A function of tables that
stands under `only_with` then becomes an empty one, and nothing that it alone calls is compiled.
"""

from inspect import signature
from typing import Any

import numpy as np
from numba.core import types
from numba.extending import overload

from .options import INNER

__all__ = ["ABSENT", "listed", "marked", "names_listed", "only_with"]

ABSENT = np.int8


def marked(table: Any) -> Any:
    """The table, or an empty one of the same shape whose type tells that it is empty."""
    return table if len(table) else np.zeros(table.shape, ABSENT)


def listed(names: Any) -> Any:
    """A table without rows whose type lists names, the kinds of something that a system holds."""
    return np.zeros(0, [(name, ABSENT) for name in names])


def names_listed(table):
    """The names in the numba type of such a table."""
    return tuple(table.dtype.fields)


def only_with(*fields):
    """Decorator: compile a function of tables (its first argument) only where one of these fields has rows.

    It returns nothing. Called from Python it is itself.
    """

    def choice(function):
        empty = {}
        exec(f"def nothing({', '.join(signature(function).parameters)}): pass", empty)

        @overload(function, jit_options=INNER, strict=False)
        def _chosen(*arguments):
            held = (arguments[0].fields[name].dtype != types.int8 for name in fields)
            return function if any(held) else empty["nothing"]

        return function

    return choice
