"""Functions of Python that users give to be compiled: what they may take, each made into code once."""

from collections.abc import Callable, Mapping, Sequence
from inspect import Parameter, signature
from types import FunctionType
from typing import Any

import numpy as np
from numba.core.errors import NumbaError

__all__ = ["arguments", "compiled_once", "is_helper", "python_of"]

# compiled entries by what they were made from, kept as long as the process lives: tables hold their addresses
_MADE: dict[Any, tuple[Any, ...]] = {}


def python_of(function: Any) -> FunctionType:
    """The function of Python behind one that is compiled already."""
    return getattr(function, "py_func", function)


def is_helper(value: Any) -> bool:
    """Whether it is a plain function, not one that numba has its own of."""
    home = str(getattr(value, "__module__", "")).partition(".")[0]
    return isinstance(value, FunctionType) and home not in ("numpy", "numba", "math", "cmath")


def compiled_once(
    functions: Sequence[Any], sizes: tuple[int, ...], make: Callable[[], tuple[Any, ...]], *, cure: str
) -> tuple[Any, ...]:
    """What `make` compiles of these functions for these sizes, made once a process as long as they stay.

    Raises ValueError with what numba says and the cure where they do not compile.
    """
    key = (sizes, *(_identity(function) for function in functions))
    if key not in _MADE:
        try:
            _MADE[key] = make()
        except (NumbaError, NotImplementedError) as error:  # the second: a comparison of complex numbers
            names = " and ".join(f"'{python_of(function).__name__}'" for function in functions)
            raise ValueError(f"numba does not compile {names} of a law: {_brief(error)}\n{cure}") from error
    return _MADE[key]


def _identity(function: Any, around: tuple[Any, ...] = ()) -> Any:
    """What makes the code of a function: its own, and what it reads of its module and of functions around it,
    functions and numbers as they are now. Two that are made by one line of one module are one."""
    own = python_of(function)
    code = own.__code__
    if code in around:  # calls itself
        return code
    held = [cell.cell_contents for cell in own.__closure__ or ()]
    read = [own.__globals__[name] for name in code.co_names if name in own.__globals__]
    return code, tuple(_kept(value, (*around, code)) for value in (*held, *read))


def _kept(value: Any, around: tuple[Any, ...]) -> Any:
    """Something that differs where compiled code would."""
    if is_helper(python_of(value)):
        return _identity(value, around)
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    try:
        hash(value)
    except TypeError:
        return repr(value)
    return value


def arguments(
    function: Any, what: str, states: tuple[str, ...], constants: Mapping[str, float]
) -> tuple[str, ...]:
    """The constants in the order in which a function takes them, behind `states`. Raises ValueError where it
    takes others, or reads a variable of a function around it."""
    own = python_of(function)
    if not isinstance(own, FunctionType):
        raise ValueError(f"a compiled law needs a function of Python as {what}, got {type(own).__name__}")
    taken = list(signature(own).parameters.values())
    named = tuple(one.name for one in taken[len(states) :])
    plain = all(one.kind is Parameter.POSITIONAL_OR_KEYWORD for one in taken)
    if len(taken) < len(states) or not plain or set(named) != set(constants):
        raise ValueError(
            f"a compiled law needs {what}({', '.join((*states, *constants))}), got "
            f"{own.__name__}({', '.join(str(one) for one in taken)})"
        )
    for name, cell in zip(own.__code__.co_freevars, own.__closure__ or (), strict=True):
        if not callable(cell.cell_contents):
            raise ValueError(
                f"{own.__name__} reads '{name}' of the function around it, which compiled code would keep as "
                "it is now; give it among the constants"
            )
    return named


def _brief(error: Exception) -> str:
    """What numba says of the function itself, without where it was in its own work."""
    said = [line.strip() for line in str(error).replace(": File: unknown: Line unknown.", "").splitlines()]
    own = [line for line in said if line and not line.startswith(_ASIDE)]
    place = next((line.rstrip(":") for line in said if line.startswith('File "') and "<" not in line), "")
    return " ".join(own[:2]) + (f" ({place})" if place else "")


_ASIDE = (
    "Failed in", "During:", 'File "', "<source", "There are", "Overload", "- Of which", "With argument",
    "def ", "^", ">>>",
)  # fmt: skip
