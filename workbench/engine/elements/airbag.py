"""The gas spring, eq. (8.27) with its sign corrected: c0 - c1/(L - onset - u)^n, u = R(-delta - onset)."""

from dataclasses import dataclass
from typing import Any, ClassVar

from numpy import exp, log

from ..compiler.options import inner
from ._kernels_rounding import ramp
from .table import code_of

__all__ = ["Airbag", "energies", "forces", "parameter_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Airbag:
    """Gas spring, eq. (8.27) with its sign corrected: f = c0 - c1/(length + delta)^power for delta <= -onset.

    (8.27) prints (0.14 - delta), which jumps at the onset and pulls; with (0.14 + delta) it starts at 0 and
    pushes. `c1=None` makes it continuous at the onset exactly: c1 = c0 (length - onset)^power. Past delta =
    -cap the law goes on as its Taylor parabola, so the singularity at delta = -length is never met. `deploy`
    (s) and `rise` (s) switch it on smoothly; by default it is always ready.
    """

    c0: float = 30.0
    c1: float | None = None
    length: float = 0.14
    power: float = 1.4
    onset: float = 0.005
    width: float = 2e-4
    cap: float = 0.13
    deploy: float = -1e9
    rise: float = 0.01

    code: ClassVar[int] = code_of("Airbag")
    names: ClassVar[tuple[str, ...]] = ("c0", "c1", "length", "power", "onset", "", "", "deploy")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = True  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        if not 0.0 < self.cap < self.length:
            raise ValueError(
                f"airbag needs 0 < cap < length: its force is singular at delta=-length={-self.length} m, "
                f"got cap={self.cap} m. Choose cap a little below length"
            )
        if not 0.0 <= self.onset < self.cap:
            raise ValueError(f"airbag needs 0 <= onset < cap, got onset={self.onset} and cap={self.cap} m")
        if self.width <= 0.0 or self.rise <= 0.0:
            raise ValueError(
                f"airbag needs width > 0 and rise > 0, got width={self.width} m, rise={self.rise} s"
            )

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        c1 = self.c0 * (self.length - self.onset) ** self.power if self.c1 is None else self.c1
        return (
            self.c0, c1, self.length, self.power, self.onset, self.width, self.cap, self.deploy, self.rise,
        )  # fmt: skip


# Gauss-Legendre nodes and weights on [0, 1], eight points: the rounded corner of the bag has no closed
# integral
_NODES = (
    0.019855071751231884, 0.10166676129318664, 0.2372337950418355, 0.40828267875217510,
    0.59171732124782490, 0.7627662049581645, 0.89833323870681336, 0.98014492824876812,
)  # fmt: skip
_WEIGHTS = (
    0.05061426814518813, 0.11119051722668724, 0.15685332293894364, 0.18134189168918100,
    0.18134189168918100, 0.15685332293894364, 0.11119051722668724, 0.05061426814518813,
)  # fmt: skip


@inner
def bag(compression: Any, c0: Any, c1: Any, length: Any, power: Any, cap: Any) -> Any:
    """Gas spring c0 - c1/(length - x)^power at compression x, continued by its Taylor parabola past x = cap.

    Returns force, slope, curvature with respect to x, and the integral from 0.
    """
    x = compression
    if x.real > cap.real:
        x = 0.0 * compression + cap
    room = length - x
    g = c1 * exp(-power * log(room))
    f0 = c0 - g
    f1 = -power * g / room
    f2 = -power * (power + 1.0) * g / (room * room)
    if abs(power - 1.0) < 1e-9:
        u0 = c0 * x + c1 * log(room / length)
    else:
        u0 = c0 * x - c1 * (exp((1.0 - power) * log(room)) - exp((1.0 - power) * log(length))) / (power - 1.0)
    e = compression - x
    force = f0 + e * (f1 + 0.5 * e * f2)
    return force, f1 + e * f2, f2, u0 + e * (f0 + e * (0.5 * f1 + e * f2 / 6.0))


@inner
def bag_energy(x: Any, c0: Any, c1: Any, length: Any, power: Any, cap: Any, w: Any) -> Any:
    """Integral of -force over compression, through the rounded corner and beyond (>= 0)."""
    half = 0.5 * w.real
    if x.real <= -half:
        return 0.0 * x
    top = x
    if x.real > half:
        top = 0.0 * x + half
    total = 0.0 * x
    for i in range(8):
        u, _, _, _ = ramp(-half + (top + half) * _NODES[i], w)
        y, _, _, _ = bag(u, c0, c1, length, power, cap)
        total -= (top + half) * _WEIGHTS[i] * y
    if x.real > half:
        _, _, _, a = bag(x, c0, c1, length, power, cap)
        _, _, _, b = bag(top, c0, c1, length, power, cap)
        total -= a - b
    return total


@inner
def gate(t: Any, t0: Any, rise: Any) -> Any:
    """0 before t0, 1 after t0 + rise, a quintic (C2) between; value and slope."""
    s = t - t0
    if s.real <= 0.0:
        return 0.0 * s, 0.0 * s
    if s.real >= rise.real:
        return 0.0 * s + 1.0, 0.0 * s
    s = s / rise
    return s * s * s * (10.0 + s * (6.0 * s - 15.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s) / rise


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        on, _ = gate(t, p[7, i], p[8, i])
        x, x1, _, _ = ramp(-delta[i] - p[4, i], p[5, i])
        y, y1, _, _ = bag(x, p[0, i], p[1, i], p[2, i] - p[4, i], p[3, i], p[6, i] - p[4, i])
        f[i] = on * y
        fd[i] = -on * y1 * x1
        fv[i] = 0.0


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density."""
    for i in range(first, last):
        on, _ = gate(t, p[7, i], p[8, i])
        energy[i] = on * bag_energy(
            -delta[i] - p[4, i], p[0, i], p[1, i], p[2, i] - p[4, i], p[3, i], p[6, i] - p[4, i], p[5, i]
        )


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    on, on1 = gate(t, p[7, i], p[8, i])
    x, x1, _, _ = ramp(-delta - p[4, i], p[5, i])
    length, power, cap = p[2, i] - p[4, i], p[3, i], p[6, i] - p[4, i]
    y, y1, _, _ = bag(x, p[0, i], p[1, i], length, power, cap)
    e = max(x - cap, 0.0)
    room = length - min(x, cap)
    # slopes of f = c0 - g (1 + n e/room + n (n + 1) e^2 / (2 room^2)), g = c1/room^n
    g = exp(-power * log(room))
    z = e / room
    shape = 1.0 + power * z + 0.5 * power * (power + 1.0) * z * z
    dp[0] = on
    dp[1] = -on * g * shape
    by_room = on * p[1, i] * g / room * (power * shape + power * z + power * (power + 1.0) * z * z)
    dp[3] = on * p[1, i] * g * (log(room) * shape - z - (power + 0.5) * z * z)
    dp[2] = by_room
    # onset: moves x by -x1, the room by -1 + x1 (below the cap); past the cap x - cap moves by 1 - x1
    if x < cap:
        dp[4] = -by_room - on * y1 * x1
    else:
        dp[4] = on * y1 * (1.0 - x1)
    dp[7] = -on1 * y
