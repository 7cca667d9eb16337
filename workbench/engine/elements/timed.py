"""A member that acts in a window of time only: another law times a smooth window from `start` to `end`."""

from dataclasses import dataclass, replace
from typing import Any, ClassVar

from ..compiler.options import inner
from . import airbag, belt, contact, spring
from ._kernels_by_code import by_code
from .airbag import gate
from .laws import Law
from .table import code_of

__all__ = ["Timed", "bare", "energies", "forces", "parameter_slopes", "window"]

NEVER = 1e9  # s
_OWN = 9  # rows of the parameter table that the law inside may fill
_CODE, _START, _END, _RISE = range(_OWN, _OWN + 4)
# laws that may stand in a window: a pulse in time has a time already
_INSIDE = {"Spring": spring, "Contact": contact, "Belt": belt, "Airbag": airbag}


def _chosen(kernel: str, arguments: str) -> Any:
    choose: Any = by_code
    return choose(_INSIDE, kernel, arguments)


_forces: Any = _chosen("forces", "p, first, last, delta, rate, t, f, fd, fv")
_energies: Any = _chosen("energies", "p, first, last, delta, t, energy")
_parameter_slopes: Any = _chosen("parameter_slopes", "p, i, delta, rate, t, dp")


@dataclass(frozen=True, slots=True, kw_only=True)
class Timed:
    """Another law in a window of time: f = w(t) f_law, w from 0 to 1 in [start, start + rise], and back from
    1 to 0 in [end, end + rise], by quintics (C2).

    start None: from the beginning on.  end None: to the end.  rise: s, > 0. A start or an end between two
    time steps is as good as one on a step: the force, and what follows from it, changes smoothly with both.

    Raises ValueError unless rise > 0 and start + rise <= end, and for laws in Python, pulses in time and laws
    in a window already.

    >>> from workbench.engine import Belt
    >>> Timed(law=Belt(), end=1.0).names[-3:]
    ('start', 'end', '')
    """

    law: Law
    start: float | None = None
    end: float | None = None
    rise: float = 0.02

    code: ClassVar[int] = code_of("Timed")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = True  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        if type(self.law).__name__ not in _INSIDE:
            raise ValueError(
                f"a window needs one of {', '.join(_INSIDE)} in it, got {type(self.law).__name__}. A pulse "
                "in time has a t0 and a sigma of its own"
            )
        start = -NEVER if self.start is None else self.start
        end = NEVER if self.end is None else self.end
        if not self.rise > 0.0 or not start + self.rise <= end:
            raise ValueError(
                f"a window needs rise > 0 and start + rise <= end in s, got start={self.start}, "
                f"end={self.end} and rise={self.rise}"
            )

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters: those of the law inside, then start and end."""
        own: tuple[str, ...] = getattr(self.law, "names", ())
        return (*own, *("" for _ in range(_OWN + 1 - len(own))), "start", "end", "")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        own = tuple(self.law.parameters)
        return (
            *own, *(0.0 for _ in range(_OWN - len(own))), float(self.law.code),
            -NEVER if self.start is None else self.start, NEVER if self.end is None else self.end, self.rise,
        )  # fmt: skip

    def changed(self, **values: float) -> "Timed":
        """With other values: `start`, `end` and `rise` of the window, all others of the law inside."""
        outer = {name: x for name, x in values.items() if name in ("start", "end", "rise")}
        own: Any = self.law
        return replace(self, law=replace(own, **{n: x for n, x in values.items() if n not in outer}), **outer)


def bare(law: Law) -> Law:
    """The law without its window."""
    return law.law if isinstance(law, Timed) else law


@inner
def window(t: Any, start: Any, end: Any, rise: Any) -> Any:
    """Value of the window, and its slopes by start and by end."""
    on, on1 = gate(t, start, rise)
    off, off1 = gate(t, end, rise)
    return on * (1.0 - off), -on1 * (1.0 - off), on * off1


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        w, _, _ = window(t, p[_START, i], p[_END, i], p[_RISE, i])
        _forces(int(p[_CODE, i].real), p, i, i + 1, delta, rate, t, f, fd, fv)
        f[i] *= w
        fd[i] *= w
        fv[i] *= w


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density."""
    for i in range(first, last):
        w, _, _ = window(t, p[_START, i], p[_END, i], p[_RISE, i])
        _energies(int(p[_CODE, i].real), p, i, i + 1, delta, t, energy)
        energy[i] *= w


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    code = int(p[_CODE, i].real)
    w, by_start, by_end = window(t, p[_START, i], p[_END, i], p[_RISE, i])
    # the force of the law inside; dp is the work space until it is filled
    dp[0], dp[1] = delta, rate
    _forces(code, p[:, i : i + 1], 0, 1, dp[0:1], dp[1:2], t, dp[2:3], dp[3:4], dp[4:5])
    f = dp[2]
    for k in range(5):
        dp[k] = 0.0
    _parameter_slopes(code, p, i, delta, rate, t, dp)
    for k in range(_OWN):
        dp[k] *= w
    dp[_START] = by_start * f
    dp[_END] = by_end * f
