"""Webbing of a seat belt: slack, a pretensioner, a load limiter, and loss where it runs back.

    f = h(delta') min(k R(e), limit),    e = delta - slack + pull w(t)

R is max(0, .) and min its like, both rounded in C2; w rises from 0 to 1 within `rise` after `fires`. h is 1
while the webbing is drawn out and falls to `returned` where it runs back faster than `speed` (`given_back`).
"""

from dataclasses import dataclass
from typing import Any, ClassVar

from ..compiler.options import inner
from ._kernels_rounding import given_back, limited, ramp
from .airbag import gate
from .table import code_of

__all__ = ["Webbing", "energies", "forces", "parameter_slopes", "tension"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Webbing:
    """Webbing: f = h(delta') min(k R(delta - slack + pull w(t)), limit).

    k: N/m.  slack: m, drawn out before it pulls.  limit: N, the force of the load limiter.
    pull: m, wound in by a pretensioner within `rise` (s) after `fires` (s); 0: none.
    returned: share of the force while it runs back faster than `speed` (m/s), between 0 and 1.
    width: m, of the rounded start of the pull; the corner at the limit is rounded over a tenth of the limit.

    A law has no memory: webbing that the limiter has let out is taken up again at once when it runs back, so
    a second pull starts from the same length; the work of the first is lost all the same, by `returned`.

    Raises ValueError for numbers out of these ranges.

    >>> belt = Webbing(k=1e5, slack=0.02, limit=4e3, pull=0.1, fires=0.01)
    """

    k: float
    slack: float = 0.0
    limit: float = 4000.0
    pull: float = 0.0
    fires: float = 0.0
    rise: float = 0.01
    returned: float = 0.1
    speed: float = 0.1
    width: float = 2e-3

    code: ClassVar[int] = code_of("Webbing")
    names: ClassVar[tuple[str, ...]] = ("k", "slack", "limit", "pull", "fires", "", "returned")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = False  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        check_tension("webbing", self)
        if self.slack < 0.0 or self.pull < 0.0:
            raise ValueError(
                f"webbing needs slack >= 0 and pull >= 0, got slack={self.slack} and pull={self.pull} m"
            )

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        return (
            self.k, self.slack, self.limit, self.pull, self.fires, self.rise, self.returned, self.speed,
            self.width,
        )  # fmt: skip


def check_tension(what: str, law: Any) -> None:
    """Raise ValueError unless stiffness, limit, widths and the share given back can be."""
    for name, unit in (("k", "N/m"), ("limit", "N"), ("rise", "s"), ("speed", "m/s"), ("width", "m")):
        if not getattr(law, name) > 0.0:
            raise ValueError(f"{what} needs {name} > 0 in {unit}, got {name}={getattr(law, name)}")
    check_returned(what, law.returned)


def check_returned(what: str, returned: float) -> None:
    """Raise ValueError unless it is a share."""
    if not 0.0 <= returned <= 1.0:
        raise ValueError(f"{what} needs 0 <= returned <= 1, the share of the force, got returned={returned}")


@inner
def tension(e: Any, k: Any, limit: Any, w: Any) -> Any:
    """min(k R(e), limit) and its slopes by e, k and limit."""
    a, a1, _, _ = ramp(e, w)
    f, by_pull, by_limit = limited(k * a, limit)
    return f, by_pull * k * a1, by_pull * a, by_limit


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        on, _ = gate(t, p[4, i], p[5, i])
        y, y1, _, _ = tension(delta[i] - p[1, i] + p[3, i] * on, p[0, i], p[2, i], p[8, i])
        h, h1, _ = given_back(rate[i], p[6, i], p[7, i])
        f[i] = h * y
        fd[i] = h * y1
        fv[i] = h1 * y


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Nothing is counted as stored: what is not lost comes back within the same law."""
    for i in range(first, last):
        energy[i] = 0.0


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    on, on1 = gate(t, p[4, i], p[5, i])
    y, y1, by_k, by_limit = tension(delta - p[1, i] + p[3, i] * on, p[0, i], p[2, i], p[8, i])
    h, _, by_returned = given_back(rate, p[6, i], p[7, i])
    dp[0] = h * by_k
    dp[1] = -h * y1
    dp[2] = h * by_limit
    dp[3] = h * y1 * on
    dp[4] = -h * y1 * p[3, i] * on1
    dp[6] = by_returned * y
