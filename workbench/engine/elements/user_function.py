"""Functions of Python that users give to be compiled: what they may take, what makes two of them one."""

from collections.abc import Mapping
from inspect import Parameter, signature
from types import FunctionType
from typing import Any

__all__ = ["arguments", "brief", "identity", "python_of"]


def python_of(function: Any) -> FunctionType:
    """The function of Python behind one that is compiled already."""
    return getattr(function, "py_func", function)


def identity(function: FunctionType) -> Any:
    """What makes the code of a function: two that are made by one line of one module are one."""
    held = tuple(id(cell.cell_contents) for cell in function.__closure__ or ())
    return function.__code__, id(function.__globals__), held


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


def brief(error: Exception) -> str:
    """What numba says of the function itself, without where it was in its own work."""
    said = [line.strip() for line in str(error).splitlines()]
    own = [line for line in said if line and not line.startswith(_ASIDE)]
    place = next((line.rstrip(":") for line in said if line.startswith('File "') and "<" not in line), "")
    return " ".join(own[:2]) + (f" ({place})" if place else "")


_ASIDE = (
    "Failed in", "During:", 'File "', "<source", "There are", "Overload", "- Of which", "With argument",
    "def ", "^", ">>>",
)  # fmt: skip
