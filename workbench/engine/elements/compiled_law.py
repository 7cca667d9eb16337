"""A law of the user's, written as a function of Python numbers and compiled with numba."""

from collections.abc import Callable, Mapping
from ctypes import POINTER, c_double
from dataclasses import dataclass, field
from math import isfinite
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

from ..compiler.options import inner
from ._kernels_called import FIRST, entries, force_at, slopes_at
from .law_check import check_slopes
from .table import PARAMETERS, code_of
from .user_function import arguments, compiled_once, python_of

__all__ = ["CompiledLaw", "energies", "forces", "parameter_slopes"]

_ENTRIES: Any = entries
_FORCE_AT: Any = force_at
_SLOPES_AT: Any = slopes_at
_DOUBLES = POINTER(c_double)
_STATES = ("delta", "rate", "t")
MOST = PARAMETERS - FIRST  # constants


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledLaw:
    """A member law of your own: `force(delta, rate, t, **constants)` of single numbers, compiled.

    delta: elongation, m.  rate: m/s.  t: s.  It returns the tension, N, at density 1, and runs in planar
    systems, trees and natural coordinates as the engine's own laws do, in every scheme, with all gradients,
    those by its constants among them.

    numba compiles the function in nopython mode, once a process. Slopes are taken by complex step, so it must
    be analytic in its arguments: numpy's functions instead of those of `math`, no `abs`, branches by
    `delta.real`, kinks rounded. Or give `slopes`, which returns (df/ddelta, df/drate) and is called, as
    `force` is then, with real numbers; slopes by the constants are not known then.  What the functions read
    from their module, functions that they call among it, is compiled in, anew where it has changed when a
    system is made; numbers that change belong in `constants`.

    Its energy is not known: `StoredEnergy` does not count its members.

    Raises ValueError for more than 26 constants or such as are no numbers, for functions that take other
    arguments, hold variables of a function around them or do not compile, and where slopes differ from
    differences of the force.

    >>> def stiffening(delta, rate, t, k, c):
    ...     return k * delta**3 + c * rate
    >>> law = CompiledLaw(force=stiffening, constants={"k": 1e4, "c": 2.0})
    >>> law.changed(k=2e4).parameters[-2:]
    (20000.0, 2.0)
    """

    force: Callable[..., Any]
    constants: Mapping[str, float] = field(default_factory=dict)
    slopes: Callable[..., tuple[Any, Any]] | None = None

    code: ClassVar[int] = code_of("CompiledLaw")
    smooth: ClassVar[bool] = True  # for all we know
    elastic: ClassVar[bool] = False  # its energy is not known

    def __post_init__(self) -> None:
        constants = {str(name): float(value) for name, value in self.constants.items()}
        if len(constants) > MOST:
            raise ValueError(f"a compiled law takes at most {MOST} constants, got {len(constants)}")
        _require_numbers(constants)
        order = arguments(self.force, "force", _STATES, constants)
        if self.slopes is not None and arguments(self.slopes, "slopes", _STATES, constants) != order:
            raise ValueError("force and slopes of a compiled law need their arguments in one order")
        object.__setattr__(self, "constants", MappingProxyType({name: constants[name] for name in order}))
        self._check()

    def __reduce__(self) -> Any:  # mapping proxies are not pickled
        return _law, (self.force, dict(self.constants), self.slopes)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: of the constants, where slopes by them are known."""
        own = tuple(self.constants) if self.slopes is None else ("",) * len(self.constants)
        return ("",) * FIRST + own

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table: addresses of this process's compiled entries, then constants."""
        return (*(float(entry.address) for entry in self._entries()), *self.constants.values())

    def _entries(self) -> tuple[Any, ...]:
        functions = [self.force] if self.slopes is None else [self.force, self.slopes]
        return compiled_once(
            functions, (len(self.constants),),
            lambda: _ENTRIES(self.force, self.slopes, len(self.constants)),
            cure="Write it with operators and numpy's functions of single numbers"
            + (", or give slopes if it takes real numbers only" if self.slopes is None else ""),
        )  # fmt: skip

    def _check(self) -> None:
        """Slopes against differences of the force."""
        entry, column, out = self._entries()[0].ctypes, np.array(self.parameters), np.zeros(5)
        own, *places = (x.ctypes.data_as(_DOUBLES) for x in (column, *(out[k:] for k in range(5))))

        def look(delta: float, rate: float, t: float) -> tuple[float, float, float]:
            out[:2] = delta, rate
            entry(*places[:2], t, own, 1, *places[2:])
            f, by_delta, by_rate = out[2:].tolist()
            return f, by_delta, by_rate

        check_slopes(python_of(self.force).__name__, look, given=self.slopes is not None)

    def changed(self, **values: float) -> "CompiledLaw":
        """With other values of some constants, slopes not held against differences again.

        Raises ValueError for names that are none and values that are no numbers.
        """
        _require_numbers(values)
        for name in values:
            if name not in self.constants:
                raise ValueError(f"no constant is called '{name}': {', '.join(self.constants)}")
        return _law(self.force, {**self.constants, **values}, self.slopes)


def _require_numbers(constants: Mapping[str, float]) -> None:
    for name, value in constants.items():
        if not isfinite(value):
            raise ValueError(f"a compiled law needs numbers, got {name}={value}")


def _law(force: Any, constants: Mapping[str, float], slopes: Any) -> CompiledLaw:
    """A law of functions that one was made of before: search steps make thousands of them."""
    law = object.__new__(CompiledLaw)
    own = MappingProxyType({name: float(value) for name, value in constants.items()})
    for name, value in zip(CompiledLaw.__slots__, (force, own, slopes), strict=True):
        object.__setattr__(law, name, value)
    return law


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        _FORCE_AT(p, i, delta[i], rate[i], t.real, f, fd, fv)


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1, which is not known, with 0."""
    for i in range(first, last):
        energy[i] = 0.0 * delta[i]


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    _SLOPES_AT(p, i, delta, rate, t, dp)
