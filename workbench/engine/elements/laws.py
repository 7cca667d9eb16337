"""Members: force elements between one point of a body and one point of another, and their laws (2.1) to
(2.4).

A law gives the force f (N, tension positive) of a member at density 1 from its elongation delta (m, length
minus
natural length), the rate of delta (m/s) and the time (s). The member's force is alpha^power f. Kinks are
rounded in
C2 over the stated width, so gradients exist everywhere; outside the width the printed law holds exactly.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar

import numpy as np

__all__ = [
    "Airbag",
    "Belt",
    "Contact",
    "Impulse",
    "Law",
    "Retractor",
    "Spring",
    "UserLaw",
]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spring:
    """Linear spring and damper, eq. (2.2): f = k delta + c rate.

    >>> Spring(k=225.0).parameters
    (225.0, 0.0)
    """

    k: float
    c: float = 0.0

    code: ClassVar[int] = 0
    names: ClassVar[tuple[str, ...]] = ("k", "c")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.k, self.c)


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

    code: ClassVar[int] = 1
    names: ClassVar[tuple[str, ...]] = ("k", "c", "gap")

    def __post_init__(self) -> None:
        if self.width <= 0.0:
            raise ValueError(f"contact needs width > 0 (the rounding of its kink), got width={self.width}")
        if self.side not in (-1, 1):
            raise ValueError(f"contact needs side=+1 (elongation) or -1 (compression), got side={self.side}")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.k, self.c, self.gap, self.width, float(self.side))


@dataclass(frozen=True, slots=True, kw_only=True)
class Impulse:
    """Pulse in time, eq. (2.4): f = f0 exp(-sigma (t - t0)^2), sigma in 1/s^2."""

    f0: float
    sigma: float
    t0: float

    code: ClassVar[int] = 2
    names: ClassVar[tuple[str, ...]] = ("f0", "sigma", "t0")

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


@dataclass(frozen=True, slots=True, kw_only=True)
class Belt:
    """Piecewise linear belt, eq. (8.26): k1 up to the knee, then k2; slack in compression; optional damper
    c."""

    k1: float = 4000.0
    k2: float = 1000.0
    knee: float = 0.015
    width: float = 1e-3
    c: float = 0.0

    code: ClassVar[int] = 3
    names: ClassVar[tuple[str, ...]] = ("k1", "k2", "knee", "", "c")

    def __post_init__(self) -> None:
        if not 0.0 < self.width <= self.knee:
            raise ValueError(f"belt needs 0 < width <= knee, got width={self.width} and knee={self.knee} m")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (self.k1, self.k2, self.knee, self.width, self.c)


@dataclass(frozen=True, slots=True, kw_only=True)
class Airbag:
    """Gas spring, eq. (8.27) with its sign corrected: f = c0 - c1/(length + delta)^power for delta <= -onset.

    (8.27) prints (0.14 - delta), which jumps at the onset and pulls; with (0.14 + delta) it starts at 0 and
    pushes.
    `c1=None` makes it continuous at the onset exactly: c1 = c0 (length - onset)^power. Past delta = -cap the
    law
    goes on as its Taylor parabola, so the singularity at delta = -length is never met. `deploy` (s) and
    `rise` (s)
    switch it on smoothly; by default it is always ready.
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

    code: ClassVar[int] = 4
    names: ClassVar[tuple[str, ...]] = ("c0", "c1", "length", "power", "onset", "", "", "deploy")

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


@dataclass(frozen=True, slots=True, kw_only=True)
class UserLaw:
    """A law of your own: `force(delta, rate, t, **parameters)` on arrays, one entry per member that uses it.

    Slopes are taken by complex step, so write the function with numpy operations that take complex arrays: no
    abs, no comparison of delta or rate themselves (`np.where(delta.real > 0, ...)` is fine). Or give
    `slopes`,
    which returns (df/ddelta, df/drate). `StoredEnergy` does not count its members.

    >>> cubic = UserLaw(force=lambda delta, rate, t, k3: k3 * delta**3, parameters={"k3": 1e4})
    """

    force: Callable[..., Array]
    parameters: Mapping[str, float] = field(default_factory=dict)
    slopes: Callable[..., tuple[Array, Array]] | None = None

    code: ClassVar[int] = 9

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))


Law = Spring | Contact | Impulse | Belt | Airbag | UserLaw
