"""A law of the user's with first-order states of its own: what viscoelastic and hydraulic parts and friction
need."""

from collections.abc import Callable, Mapping
from ctypes import POINTER, c_double
from dataclasses import dataclass, field
from functools import partial
from math import isfinite
from types import MappingProxyType
from typing import Any

import numpy as np

from ._kernels_called import STEP
from ._kernels_called_states import CONSTANTS, MOST_CONSTANTS, WIDTH, strut_entries
from .law_check import check_slopes
from .user_function import arguments, compiled_once, python_of

__all__ = ["StateLaw"]

_STRUT_ENTRIES: Any = strut_entries
_DOUBLES = POINTER(c_double)
MOST_STATES = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class StateLaw:
    """A law of your own with one or two states x: `force(delta, rate, t, x, **constants)`, N, and

        dx/dt = growth(delta, rate, t, x, **constants),   x(0) as in `states`

    of single numbers, compiled as in `CompiledLaw`: analytic in all arguments (there are no slopes to give).
    delta: elongation, m.  rate: m/s.  t: s.  states: name -> value at the start, in the order in which the
    functions take them; with two states `growth` returns both rates.  The states' slopes stand in the scheme
    and in its adjoint.

    Raises ValueError for no or more than two states, more than 22 constants, such as are no numbers,
    functions that take other arguments, hold variables of a function around them or do not compile, and where
    slopes by complex step differ from differences.

    >>> def force(delta, rate, t, pulled, k, c):
    ...     return k * (delta - pulled)
    >>> def growth(delta, rate, t, pulled, k, c):
    ...     return k * (delta - pulled) / c
    >>> maxwell = StateLaw(
    ...     force=force, growth=growth, states={"pulled": 0.0}, constants={"k": 9e3, "c": 400.0}
    ... )
    >>> maxwell.changed(c=500.0).constants["c"]
    500.0
    """

    force: Callable[..., Any]
    growth: Callable[..., Any]
    states: Mapping[str, float]
    constants: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for name in ("states", "constants"):
            given = {str(key): float(value) for key, value in getattr(self, name).items()}
            object.__setattr__(self, name, MappingProxyType(given))
            _require_numbers(given)
        if not 1 <= len(self.states) <= MOST_STATES or len(self.constants) > MOST_CONSTANTS:
            raise ValueError(
                f"a law with states takes 1 to {MOST_STATES} states and at most {MOST_CONSTANTS} constants, "
                f"got {len(self.states)} and {len(self.constants)}"
            )
        first = ("delta", "rate", "t", *self.states)
        order = arguments(self.force, "force", first, self.constants)
        if arguments(self.growth, "growth", first, self.constants) != order:
            raise ValueError("force and growth of a law need their arguments in one order")
        constants = {name: self.constants[name] for name in order}
        object.__setattr__(self, "constants", MappingProxyType(constants))
        self._check()

    def __reduce__(self) -> Any:  # mapping proxies are not pickled
        return _law, (self.force, self.growth, dict(self.states), dict(self.constants))

    def changed(self, **values: float) -> "StateLaw":
        """With other values of some constants or, by their names, starts of states, slopes not held against
        differences again. Raises ValueError for names that are neither, values that are no numbers."""
        _require_numbers(values)
        for name in values:
            if name not in self.constants and name not in self.states:
                known = ", ".join((*self.states, *self.constants))
                raise ValueError(f"no state or constant is called '{name}': {known}")
        return _law(
            self.force,
            self.growth,
            {name: values.get(name, value) for name, value in self.states.items()},
            {name: values.get(name, value) for name, value in self.constants.items()},
        )

    def addresses(self) -> tuple[float, ...]:
        """Where the compiled entries of this process are."""
        return tuple(float(entry.address) for entry in self._entries())

    def _entries(self) -> tuple[Any, ...]:
        functions, sizes = (self.force, self.growth), (len(self.states), len(self.constants))
        return compiled_once(
            functions, sizes, lambda: _STRUT_ENTRIES(*functions, *sizes),
            cure="Write them with operators and numpy's functions of single numbers; growth returns as many "
            "numbers as there are states",
        )  # fmt: skip

    def look(self, delta: Any, rate: Any, t: float, states: Any) -> np.ndarray[Any, Any]:
        """(1 + states,) complex: force, N, and the rates of the states, each per s."""
        values, out = np.array([delta, rate, *states], complex), np.zeros(1 + len(self.states), complex)
        row = np.zeros(WIDTH)
        row[CONSTANTS : CONSTANTS + len(self.constants)] = tuple(self.constants.values())
        places = [x.view(float).ctypes.data_as(_DOUBLES) for x in (values, row, out)]
        self._entries()[0].ctypes(places[0], t, places[1], places[2])
        return out

    def _check(self) -> None:
        """Slopes of force and growth by elongation and rate, and by the states, against differences."""
        first, second = (*self.states, "nothing")[:2]
        for k, function in enumerate((self.force, *(self.growth for _ in self.states))):
            for moved, by in ((0, ("delta", "rate")), (2, (first, second))):
                check_slopes(python_of(function).__name__, partial(self._slopes, k, moved), by=by)

    def _slopes(self, k: int, moved: int, x: float, y: float, t: float) -> tuple[float, float, float]:
        """Number k of what the law gives with numbers `moved` and the next at x and y; its slopes by them."""
        numbers: list[complex] = [0.031, -0.17, *self.states.values()]
        found = []
        for pair in ((x + 1j * STEP, y), (x, y + 1j * STEP)):
            numbers[moved : moved + 2] = pair[: len(numbers) - moved]
            found.append(self.look(numbers[0], numbers[1], t, numbers[2:])[k])
        return found[0].real, found[0].imag / STEP, found[1].imag / STEP


def _require_numbers(given: Mapping[str, float]) -> None:
    for name, value in given.items():
        if not isfinite(value):
            raise ValueError(f"a law with states needs numbers, got {name}={value}")


def _law(force: Any, growth: Any, states: Mapping[str, float], constants: Mapping[str, float]) -> StateLaw:
    """A law of functions that one was made of before."""
    law = object.__new__(StateLaw)
    numbers = (MappingProxyType({k: float(x) for k, x in given.items()}) for given in (states, constants))
    for name, value in zip(StateLaw.__slots__, (force, growth, *numbers), strict=True):
        object.__setattr__(law, name, value)
    return law
