"""The piecewise linear belt, eq. (8.26), its kinks rounded."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from ._kernels_rounding import ramp
from .table import code_of

__all__ = ["Belt", "energies", "forces", "parameter_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Belt:
    """Piecewise linear belt, eq. (8.26): k1 up to the knee, then k2; slack in compression; damper c."""

    k1: float = 4000.0
    k2: float = 1000.0
    knee: float = 0.015
    width: float = 1e-3
    c: float = 0.0

    code: ClassVar[int] = code_of("Belt")
    names: ClassVar[tuple[str, ...]] = ("k1", "k2", "knee", "", "c")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = True  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        if not 0.0 < self.width <= self.knee:
            raise ValueError(f"belt needs 0 < width <= knee, got width={self.width} and knee={self.knee} m")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.k1, self.k2, self.knee, self.width, self.c)


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        a, a1, a2, _ = ramp(delta[i], p[3, i])
        b, b1, _, _ = ramp(delta[i] - p[2, i], p[3, i])
        f[i] = p[0, i] * a + (p[1, i] - p[0, i]) * b + p[4, i] * rate[i] * a1
        fd[i] = p[0, i] * a1 + (p[1, i] - p[0, i]) * b1 + p[4, i] * rate[i] * a2
        fv[i] = p[4, i] * a1


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density."""
    for i in range(first, last):
        _, _, _, a = ramp(delta[i], p[3, i])
        _, _, _, b = ramp(delta[i] - p[2, i], p[3, i])
        energy[i] = p[0, i] * a + (p[1, i] - p[0, i]) * b


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    a, a1, _, _ = ramp(delta, p[3, i])
    b, b1, _, _ = ramp(delta - p[2, i], p[3, i])
    dp[0] = a - b
    dp[1] = b
    dp[2] = -(p[1, i] - p[0, i]) * b1
    dp[4] = rate * a1
