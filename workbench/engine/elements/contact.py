"""The one-way contact with a gap, eq. (2.3), its kink rounded."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from ._kernels_rounding import ramp
from .table import code_of

__all__ = ["Contact", "energies", "forces", "parameter_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Contact:
    """One-way contact with a gap, eq. (2.3): f = k (delta - gap) + c rate where delta > gap, else 0.

    `side=-1` acts when the member gets shorter than natural length minus gap (a buffer), pushing apart.
    """

    k: float
    c: float = 0.0
    gap: float = 0.0
    width: float = 1e-3
    side: int = 1

    code: ClassVar[int] = code_of("Contact")
    names: ClassVar[tuple[str, ...]] = ("k", "c", "gap")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = True  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        if self.width <= 0.0:
            raise ValueError(f"contact needs width > 0 (the rounding of its kink), got width={self.width}")
        if self.side not in (-1, 1):
            raise ValueError(f"contact needs side=+1 (elongation) or -1 (compression), got side={self.side}")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.k, self.c, self.gap, self.width, float(self.side))


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        side = p[4, i]
        r, r1, r2, _ = ramp(side * delta[i] - p[2, i], p[3, i])
        f[i] = side * p[0, i] * r + p[1, i] * rate[i] * r1
        fd[i] = p[0, i] * r1 + p[1, i] * rate[i] * side * r2
        fv[i] = p[1, i] * r1


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density."""
    for i in range(first, last):
        _, _, _, u = ramp(p[4, i] * delta[i] - p[2, i], p[3, i])
        energy[i] = p[0, i] * u


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    side = p[4, i]
    r, r1, r2, _ = ramp(side * delta - p[2, i], p[3, i])
    dp[0] = side * r
    dp[1] = rate * r1
    dp[2] = -side * p[0, i] * r1 - p[1, i] * rate * r2
