"""The linear spring and damper, eq. (2.2)."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from .table import code_of

__all__ = ["Spring", "energies", "forces", "parameter_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring:
    """Linear spring and damper, eq. (2.2): f = k delta + c rate.

    >>> Spring(k=225.0).parameters
    (225.0, 0.0)
    """

    k: float
    c: float = 0.0

    code: ClassVar[int] = code_of("Spring")
    names: ClassVar[tuple[str, ...]] = ("k", "c")
    smooth: ClassVar[bool] = True  # infinitely often differentiable
    elastic: ClassVar[bool] = True  # its force without the damper is the slope of its energy

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.k, self.c)


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        f[i] = p[0, i] * delta[i] + p[1, i] * rate[i]
        fd[i] = p[0, i]
        fv[i] = p[1, i]


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density."""
    for i in range(first, last):
        energy[i] = 0.5 * p[0, i] * delta[i] * delta[i]


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    dp[0] = delta
    dp[1] = rate
