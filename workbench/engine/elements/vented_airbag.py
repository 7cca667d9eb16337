"""An airbag with vents: the gas spring (8.27) on the way in, a share of it on the way out.

    f = h(-delta') f_airbag(delta, t)

h is 1 while the bag is pressed together and falls to `returned` where it opens faster than `speed`: the gas
has left through the vents, and what is left follows the body without a push.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from . import airbag
from ._kernels_rounding import given_back
from .airbag import Airbag
from .table import code_of
from .webbing import check_returned

__all__ = ["VentedAirbag", "energies", "forces", "parameter_slopes"]

_AIRBAG_FORCES: Any = airbag.forces
_AIRBAG_SLOPES: Any = airbag.parameter_slopes
_RETURNED, _SPEED = 9, 10  # rows behind those of the airbag


@dataclass(frozen=True, slots=True, kw_only=True)
class VentedAirbag:
    """Gas spring (8.27) that pushes with a share `returned` where it opens faster than `speed` (m/s).

    All others are those of `Airbag`, see there. returned=0: no energy comes back from an opening that is
    fast; slower, it pushes on, so that a body at rest is held.

    Raises ValueError for numbers that `Airbag` refuses, a share outside [0, 1] or a speed not above 0.

    >>> bag = VentedAirbag(returned=0.0, deploy=0.5)
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
    returned: float = 0.0
    speed: float = 0.1

    code: ClassVar[int] = code_of("VentedAirbag")
    names: ClassVar[tuple[str, ...]] = (*Airbag.names, "", "returned")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = False  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        self.sealed()
        check_returned("vented airbag", self.returned)
        if not self.speed > 0.0:
            raise ValueError(f"vented airbag needs speed > 0 in m/s, got speed={self.speed}")

    def sealed(self) -> Airbag:
        """The same bag without vents."""
        return Airbag(
            c0=self.c0, c1=self.c1, length=self.length, power=self.power, onset=self.onset, width=self.width,
            cap=self.cap, deploy=self.deploy, rise=self.rise,
        )  # fmt: skip

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (*self.sealed().parameters, self.returned, self.speed)


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    _AIRBAG_FORCES(p, first, last, delta, rate, t, f, fd, fv)
    for i in range(first, last):
        h, h1, _ = given_back(-rate[i], p[_RETURNED, i], p[_SPEED, i])
        fv[i] = -h1 * f[i]
        f[i] *= h
        fd[i] *= h


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Nothing is counted as stored: what is not lost comes back within the same law."""
    for i in range(first, last):
        energy[i] = 0.0


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    h, _, by_returned = given_back(-rate, p[_RETURNED, i], p[_SPEED, i])
    # the force of the bag; dp is the work space until it is filled
    dp[0], dp[1] = delta, rate
    _AIRBAG_FORCES(p[:, i : i + 1], 0, 1, dp[0:1], dp[1:2], t, dp[2:3], dp[3:4], dp[4:5])
    f = dp[2]
    for k in range(5):
        dp[k] = 0.0
    _AIRBAG_SLOPES(p, i, delta, rate, t, dp)
    for k in range(_RETURNED):
        dp[k] *= h
    dp[_RETURNED] = by_returned * f
