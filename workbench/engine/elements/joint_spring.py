"""Joint springs: a torsional spring and damper between two bodies, with smooth stops."""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from ._kernels_rounding import softplus, softplus_integral
from .table import code_of

__all__ = ["JointSpring", "energy", "forces", "parameter_slopes", "torque_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSpring:
    """Torsional spring, damper and smooth stops between two bodies (torque on `a`, opposite on `b`).

        T = -k phi - c phi' - k_stop [softplus(phi - upper) - softplus(-phi - lower)]
        phi = theta_a - theta_b - rest,    softplus(x) = width log(1 + exp(x/width))

    k: N m/rad.  c: N m s/rad.  rest: rad, None for the angle at the start.  k_stop: N m/rad.
    upper, lower: stop angles on either side of rest, rad, both >= 0.  width: rad, so a stop begins to act a
    few widths before its angle.  Raises ValueError for other values.
    """

    a: str
    b: str
    k: float = 0.0
    c: float = 0.0
    rest: float | None = None
    k_stop: float = 0.0
    upper: float = 0.0
    lower: float = 0.0
    width: float = 0.02
    name: str = ""

    code: ClassVar[int] = code_of("JointSpring")
    names: ClassVar[tuple[str, ...]] = (
        "k",
        "c",
        "rest",
        "k_stop",
        "upper",
        "lower",
    )  # parameters with a gradient
    states: ClassVar[int] = 0  # of first order
    elastic: ClassVar[bool] = True  # whether its energy is counted

    def __post_init__(self) -> None:
        if self.width <= 0.0:
            raise ValueError(
                f"joint spring '{self.a}'-'{self.b}' needs width > 0 rad, got width={self.width}"
            )
        if self.k_stop < 0.0 or self.upper < 0.0 or self.lower < 0.0:
            raise ValueError(
                f"joint spring '{self.a}'-'{self.b}' needs k_stop, upper and lower >= 0 "
                f"(angles on either side of rest), got k_stop={self.k_stop}, upper={self.upper}, "
                f"lower={self.lower}"
            )

    @property
    def smooth(self) -> bool:
        """Softplus stops have all derivatives."""
        return True

    @property
    def has_state(self) -> bool:
        """It remembers nothing."""
        return False

    def column(self, start: Any) -> tuple[float, ...]:
        """Parameters in the order of the kernels; start: (3,) x, y and angle of `a` seen from `b`."""
        rest = start[2] if self.rest is None else self.rest
        return (self.k, self.c, rest, self.k_stop, self.upper, self.lower, self.width)


@inner
def forces(p: Any, t: int, big: Any, fr: Any, kr: Any, cr: Any) -> None:
    """Add k phi + c phi' + k_stop [softplus(phi - upper) - softplus(-phi - lower)], minus the torque on a.

    Column t of p: k, c, rest, k_stop, upper, lower, width; phi = theta - rest.
    """
    phi = big[2] - p[2, t]
    high, high1 = softplus(phi - p[4, t], p[6, t])
    low, low1 = softplus(-phi - p[5, t], p[6, t])
    fr[2] += p[0, t] * phi + p[1, t] * big[5] + p[3, t] * (high - low)
    kr[2, 2] += p[0, t] + p[3, t] * (high1 + low1)
    cr[2, 2] += p[1, t]


@inner
def energy(p: Any, t: int, big: Any, out: Any) -> None:
    """Add to out[0] the elastic energy: k phi^2/2 and the integral of the stops' softplus."""
    phi = big[2] - p[2, t]
    total = 0.5 * p[0, t] * phi * phi
    if p[3, t].real != 0.0:
        total += p[3, t] * (
            softplus_integral(phi - p[4, t], p[6, t]) + softplus_integral(-phi - p[5, t], p[6, t])
        )
    out[0] += total


@inner
def torque_slopes(p: Any, t: int, big: Any, dp: Any) -> None:
    """Fill dp (6,): slopes of minus the torque by k, c, rest, k_stop, upper, lower."""
    phi = big[2] - p[2, t]
    high, high1 = softplus(phi - p[4, t], p[6, t])
    low, low1 = softplus(-phi - p[5, t], p[6, t])
    dp[0] = phi
    dp[1] = big[5]
    dp[2] = -p[0, t] - p[3, t] * (high1 + low1)
    dp[3] = high - low
    dp[4] = -p[3, t] * high1
    dp[5] = p[3, t] * low1


@inner
def parameter_slopes(p: Any, t: int, big: Any, z: Any, dp: Any) -> None:
    """Fill the first 6 rows of dp (., 3): slopes of F by the parameters."""
    for m in range(6):
        dp[m, 0] = 0.0
        dp[m, 1] = 0.0
    torque_slopes(p, t, big, dp[:, 2])
