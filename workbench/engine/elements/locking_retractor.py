"""A reel that pays webbing out under a light pull until it locks.

    f = tension + w(t) h(delta') min(k R(delta - paid), limit)

w rises from 0 to 1 within `rise` after the sensor `locks`; R, min and h are those of `webbing`.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from ._kernels_rounding import given_back
from .airbag import gate
from .table import code_of
from .webbing import check_tension, tension

__all__ = ["LockingRetractor", "energies", "forces", "parameter_slopes"]


@dataclass(frozen=True, slots=True, kw_only=True)
class LockingRetractor:
    """A reel: a light `tension` (N) always; once it locks, webbing of k (N/m) with a load limiter (N).

    locks: s, when the sensor says so.  rise: s, within which the pawl takes hold.
    paid: m, how much webbing is out beyond the natural length when it locks; what is out less is slack.
    returned, speed, width: as in `Webbing`.

    A law has no memory, so `paid` is a number and is not found by the run: take it off a run without the
    lock, or leave 0, which locks at the natural length.

    Raises ValueError for numbers out of these ranges.

    >>> reel = LockingRetractor(k=1e5, locks=0.52)
    """

    k: float
    locks: float
    tension: float = 10.0
    paid: float = 0.0
    limit: float = 4000.0
    rise: float = 0.01
    returned: float = 0.1
    speed: float = 0.1
    width: float = 2e-3

    code: ClassVar[int] = code_of("LockingRetractor")
    names: ClassVar[tuple[str, ...]] = ("k", "paid", "limit", "tension", "locks", "", "returned")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = False  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        check_tension("locking retractor", self)
        if self.tension < 0.0:
            raise ValueError(f"locking retractor needs tension >= 0 in N, got tension={self.tension}")

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (
            self.k, self.paid, self.limit, self.tension, self.locks, self.rise, self.returned, self.speed,
            self.width,
        )  # fmt: skip


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        on, _ = gate(t, p[4, i], p[5, i])
        y, y1, _, _ = tension(delta[i] - p[1, i], p[0, i], p[2, i], p[8, i])
        h, h1, _ = given_back(rate[i], p[6, i], p[7, i])
        f[i] = p[3, i] + on * h * y
        fd[i] = on * h * y1
        fv[i] = on * h1 * y


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Nothing is counted as stored: what is not lost comes back within the same law."""
    for i in range(first, last):
        energy[i] = 0.0


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    on, on1 = gate(t, p[4, i], p[5, i])
    y, y1, by_k, by_limit = tension(delta - p[1, i], p[0, i], p[2, i], p[8, i])
    h, _, by_returned = given_back(rate, p[6, i], p[7, i])
    dp[0] = on * h * by_k
    dp[1] = -on * h * y1
    dp[2] = on * h * by_limit
    dp[3] = 1.0
    dp[4] = -on1 * h * y
    dp[6] = on * by_returned * y
