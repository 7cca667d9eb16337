"""The pulse in time, eq. (2.4), and the retractor (8.28), which is the same law."""

from dataclasses import dataclass
from typing import Any, ClassVar

from numpy import exp

from ..compiler.options import inner
from .table import code_of

__all__ = ["Impulse", "Retractor", "energies", "forces", "parameter_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Impulse:
    """Pulse in time, eq. (2.4): f = f0 exp(-sigma (t - t0)^2), sigma in 1/s^2."""

    f0: float
    sigma: float
    t0: float

    code: ClassVar[int] = code_of("Impulse")
    names: ClassVar[tuple[str, ...]] = ("f0", "sigma", "t0")
    smooth: ClassVar[bool] = True  # infinitely often differentiable
    elastic: ClassVar[bool] = False  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        if self.sigma < 0.0:
            raise ValueError(f"impulse needs sigma >= 0 in 1/s^2, got sigma={self.sigma}")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.f0, self.sigma, self.t0)


def Retractor(*, f0: float = 500.0, sigma: float = 300.0, t0: float = 1.5) -> Impulse:
    """The retractor of eq. (8.28), a timed pull: 500 N exp(-300 (t - 1.5)^2), 96 ms wide at half height."""
    return Impulse(f0=f0, sigma=sigma, t0=t0)


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        s = t - p[2, i]
        f[i] = p[0, i] * exp(-p[1, i] * s * s)
        fd[i] = 0.0
        fv[i] = 0.0


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density."""
    for i in range(first, last):
        energy[i] = 0.0


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    s = t - p[2, i]
    e = exp(-p[1, i] * s * s)
    dp[0] = e
    dp[1] = -s * s * p[0, i] * e
    dp[2] = 2.0 * p[1, i] * s * p[0, i] * e
