"""A measured curve of force over elongation: straight between its points, kinks rounded in C2; a damper.

    f = scale (f0 + k0 delta + sum_j (k_j - k_(j-1)) R(delta - x_j)) + c rate

x_j are the points between the first and the last, k_j the slope behind each of them, f0 + k0 delta the line
through the first two; R is max(0, .) rounded over `width`. Beyond the ends the first and the last line go on.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Any, ClassVar

from ..compiler.options import inner
from ._kernels_rounding import ramp
from .table import PARAMETERS, code_of

__all__ = ["Curve", "energies", "forces", "parameter_slopes"]

_KINKS = 6  # first row of the table with a kink: a place and a change of slope each
MOST = 2 + (PARAMETERS - _KINKS) // 2  # points


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """Force over elongation by points (m, N), at most 14, as a test or a data sheet gives them.

    points: elongations ascend; tension is positive, so what only pushes has its forces, below zero, at
    negative elongations.  Through (0, 0) if the member shall be at rest there.
    c: N s/m, a damper beside it.  scale: of the curve's force.
    width: m, over which each kink is rounded (C2); at most the smallest distance of two points.

    Loading and unloading follow one curve; `Webbing` and `VentedAirbag` lose energy on the way back.

    Raises ValueError for fewer than two or too many points, for points that do not ascend or are no numbers,
    and for a width that does not fit between them.

    >>> foam = Curve(points=((-0.10, -900.0), (-0.06, -250.0), (0.0, 0.0), (0.1, 0.0)), width=0.01)
    >>> from workbench.engine.elements.law_series import law_series
    >>> import numpy as np
    >>> at = np.array([[-0.08], [-0.03], [0.05]])
    >>> law_series([foam], at, 0 * at, np.zeros(3)).force.ravel().round(9).tolist()
    [-575.0, -125.0, 0.0]
    """

    points: tuple[tuple[float, float], ...]
    c: float = 0.0
    scale: float = 1.0
    width: float = 1e-3

    code: ClassVar[int] = code_of("Curve")
    names: ClassVar[tuple[str, ...]] = ("scale", "c")
    smooth: ClassVar[bool] = False  # infinitely often differentiable
    elastic: ClassVar[bool] = True  # its force without the damper is the slope of its energy

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", tuple((float(x), float(f)) for x, f in self.points))
        if not 2 <= len(self.points) <= MOST:
            raise ValueError(f"a curve needs 2 to {MOST} points (m, N), got {len(self.points)}")
        for k, (x, f) in enumerate(self.points):
            if not (isfinite(x) and isfinite(f)):
                raise ValueError(f"a curve needs numbers, got ({x}, {f}) as point {k}")
        gaps = [b[0] - a[0] for a, b in zip(self.points, self.points[1:], strict=False)]
        if min(gaps) <= 0.0:
            k = gaps.index(min(gaps))
            raise ValueError(
                f"a curve needs elongations that ascend, got {self.points[k][0]} m and then "
                f"{self.points[k + 1][0]} m as points {k} and {k + 1}"
            )
        if not 0.0 < self.width <= min(gaps):
            raise ValueError(
                f"a curve needs 0 < width <= {min(gaps):g} m, the smallest distance of two points, got "
                f"width={self.width}"
            )

    @property
    def parameters(self) -> tuple[float, ...]:
        """Column of the parameter table."""
        slopes = [(g - f) / (y - x) for (x, f), (y, g) in zip(self.points, self.points[1:], strict=False)]
        first, force = self.points[0]
        kinks = [
            number
            for (x, _), before, behind in zip(self.points[1:-1], slopes, slopes[1:], strict=False)
            for number in (x, behind - before)
        ]
        return (
            self.scale, self.c, force - slopes[0] * first, slopes[0], self.width, float(len(kinks) // 2),
            *kinks,
        )  # fmt: skip


@inner
def static(p: Any, i: int, delta: Any) -> Any:
    """The curve of member i at scale 1 and its slope."""
    f = p[2, i] + p[3, i] * delta
    by_delta = p[3, i] + 0.0 * delta
    for j in range(int(p[5, i].real)):
        r, r1, _, _ = ramp(delta - p[6 + 2 * j, i], p[4, i])
        f += p[7 + 2 * j, i] * r
        by_delta += p[7 + 2 * j, i] * r1
    return f, by_delta


@inner
def forces(p: Any, first: int, last: int, delta: Any, rate: Any, t: Any, f: Any, fd: Any, fv: Any) -> None:
    """Fill f, df/ddelta, df/drate of members first..last-1 at unit density."""
    for i in range(first, last):
        y, y1 = static(p, i, delta[i])
        f[i] = p[0, i] * y + p[1, i] * rate[i]
        fd[i] = p[0, i] * y1
        fv[i] = p[1, i]


@inner
def energies(p: Any, first: int, last: int, delta: Any, t: Any, energy: Any) -> None:
    """Fill the stored energy of members first..last-1 at unit density, none at elongation 0."""
    for i in range(first, last):
        u = (p[2, i] + 0.5 * p[3, i] * delta[i]) * delta[i]
        for j in range(int(p[5, i].real)):
            _, _, _, there = ramp(delta[i] - p[6 + 2 * j, i], p[4, i])
            _, _, _, at_rest = ramp(0.0 * delta[i] - p[6 + 2 * j, i], p[4, i])
            u += p[7 + 2 * j, i] * (there - at_rest)
        energy[i] = p[0, i] * u


@inner
def parameter_slopes(p: Any, i: int, delta: Any, rate: Any, t: Any, dp: Any) -> None:
    """Slopes of the unit force of member i by its parameters, rows of `dp` that are not 0."""
    y, _ = static(p, i, delta)
    dp[0] = y
    dp[1] = rate
