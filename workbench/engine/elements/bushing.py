"""Bushings: two axes between two points, with saturation; they may break for good."""

from dataclasses import dataclass
from math import hypot
from typing import Any, ClassVar

from numpy import cos, exp, sin, sqrt

from ..compiler.options import inner
from ._kernels_rounding import saturated, smoothstep
from .table import code_of

__all__ = ["Bushing", "forces", "parameter_slopes"]

Point = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bushing:
    """Two axes between a point of `a` and a point of `b`, in b's frame; it saturates and may let go for good.

        force on a = -hold (1 - D) w(r) [cap tanh(k r/cap) e + c r' sech^2(k r/cap) - preload]
        dD/dt = (1 - D) logistic((r - release)/width)/tau,   D(0) = 0

    w falls from 1 at r = slip to 0 at r = release (C2), e is the unit separation, r its length (rounded at
    eps), m.  k: N/m.  c: N s/m.  cap: N; None: linear.  slip, release: m; None: it never breaks.  tau: s.
    width: m.  hold: in [0, 1], scales all.
    preload: the force (N, b's frame) that it exerts on `a` with no separation.
    opens: direction (b's frame) in which `a` comes loose; `cap` then limits the force on that side only, and
    `push_cap` the force when `a` is pressed on, with a C2 transition between e . opens = 0 and -1.
    Raises ValueError for other values.
    """

    a: str
    b: str
    point_a: Point = (0.0, 0.0)
    point_b: Point = (0.0, 0.0)
    k: float
    c: float = 0.0
    cap: float | None = None
    slip: float | None = None
    release: float | None = None
    tau: float = 0.02
    width: float = 0.005
    eps: float = 5e-4
    hold: float = 1.0
    preload: Point = (0.0, 0.0)
    opens: Point | None = None
    push_cap: float | None = None
    name: str = ""

    code: ClassVar[int] = code_of("Bushing")
    names: ClassVar[tuple[str, ...]] = ("k", "c", "cap", "hold")  # parameters with a gradient
    states: ClassVar[int] = 1  # of first order
    elastic: ClassVar[bool] = False  # whether its energy is counted: it slips and breaks

    def __post_init__(self) -> None:
        if (self.slip is None) != (self.release is None):
            raise ValueError(f"bushing '{self.a}'-'{self.b}' needs both slip and release, or neither")
        if self.slip is not None and self.release is not None and not 0.0 <= self.slip < self.release:
            raise ValueError(
                f"bushing '{self.a}'-'{self.b}' needs 0 <= slip < release in m, "
                f"got {self.slip} and {self.release}"
            )
        if self.cap is not None and self.cap <= 0.0:
            raise ValueError(f"bushing '{self.a}'-'{self.b}' needs cap > 0 N, got cap={self.cap}")
        if (self.opens is None) != (self.push_cap is None):
            raise ValueError(f"bushing '{self.a}'-'{self.b}' needs both opens and push_cap, or neither")
        if self.push_cap is not None and (self.cap is None or self.push_cap <= 0.0):
            raise ValueError(
                f"bushing '{self.a}'-'{self.b}' needs cap > 0 N and push_cap > 0 N together, "
                f"got cap={self.cap} and push_cap={self.push_cap}"
            )
        if self.opens is not None and hypot(*self.opens) == 0.0:
            raise ValueError(f"bushing '{self.a}'-'{self.b}' needs a direction opens, got {self.opens}")
        if min(self.tau, self.width, self.eps) <= 0.0:
            raise ValueError(f"bushing '{self.a}'-'{self.b}' needs tau, width and eps > 0")

    @property
    def breakable(self) -> bool:
        """Whether it has a release distance."""
        return self.release is not None

    @property
    def smooth(self) -> bool:
        """Whether its force has all derivatives."""
        return not self.breakable

    @property
    def has_state(self) -> bool:
        """Whether its damage can grow."""
        return self.breakable

    def column(self, start: Any) -> tuple[float, ...]:
        """Parameters in the order of the kernels, wherever the bodies are at the start."""
        nx, ny = (0.0, 0.0) if self.opens is None else self.opens
        length = hypot(nx, ny) or 1.0
        return (
            self.k, self.c, 1e30 if self.cap is None else self.cap,
            0.0 if self.slip is None else self.slip, 1.0 if self.release is None else self.release,
            self.tau if self.breakable else 0.0, self.eps, self.hold, *self.preload,
            *self.point_a, *self.point_b, self.width,
            nx / length, ny / length, 0.0 if self.push_cap is None else self.push_cap,
        )  # fmt: skip


@inner
def directed_cap(p: Any, b: int, rx: Any, ry: Any, r: Any) -> Any:
    """Limit of the force at a separation (rx, ry) of length r: value, slope by (rx, ry), slope by the cap.

    cap on the side that opens (e.n >= 0), push cap when pressed on (e.n = -1), smoothstep(-e.n) between.
    """
    if p[17, b].real <= 0.0:
        return p[2, b] + 0.0 * r, 0.0 * r, 0.0 * r, 0.0 * r + 1.0
    e = (rx * p[15, b] + ry * p[16, b]) / r
    part, part1 = smoothstep(-e)
    more = (p[17, b] - p[2, b]) * part1 / r
    x = -more * (p[15, b] - e * rx / r)
    y = -more * (p[16, b] - e * ry / r)
    return p[2, b] + (p[17, b] - p[2, b]) * part, x, y, 1.0 - part


@inner
def forces(
    p: Any, b: int, big: Any, z: Any, rate0: Any, half: Any, tangent: bool, fr: Any, kr: Any, cr: Any,
    slopes: Any, out: Any,
) -> None:  # fmt: skip
    """Breakable bushing: -(force on body 1) = s [cap tanh(k r/cap) r_/r + c r' sech^2(k r/cap) - preload].

    s = hold (1 - D) w(r), r = sqrt(r_.r_ + eps^2), w falls from 1 at r1 to 0 at r2; the damage obeys
    dD/dt = (1 - D) logistic((r - r2)/width)/tau, taken here at the end of a trapezoidal step:
    D = (z + half (rate0 + a))/(1 + half a), a = logistic/tau; half = 0 leaves D = z.
    Column b of p: k, c, cap, r1, r2, tau, eps, hold, preload x, y, s1x, s1y, s2x, s2y, width, n x, n y,
    push cap; tau = 0: unbreakable; push cap = 0: one cap for all directions.
    out = D, dD/dt.  slopes: dg/dD, dF/dD (3), dg/dX (3) and dD/dX (3) of the step, all but the first where
    `tangent`.
    """
    c, s = cos(big[2]), sin(big[2])
    ax = c * p[10, b] - s * p[11, b]
    ay = s * p[10, b] + c * p[11, b]
    rx = ax + big[0] - p[12, b]
    ry = ay + big[1] - p[13, b]
    vx = big[3] - ay * big[5]
    vy = big[4] + ax * big[5]
    r = sqrt(rx * rx + ry * ry + p[6, b] * p[6, b])
    k, damping = p[0, b], p[1, b]
    cap, cap_x, cap_y, _ = directed_cap(p, b, rx, ry, r)
    saturation = saturated(k * r / cap)
    g = cap * saturation / r
    h = 1.0 - saturation * saturation
    damage = 0.0 * r
    w = 0.0 * r + 1.0
    w1 = 0.0 * r
    a = 0.0 * r
    a1 = 0.0 * r
    if p[5, b].real > 0.0:
        step, step1 = smoothstep((r - p[3, b]) / (p[4, b] - p[3, b]))
        w = 1.0 - step
        w1 = -step1 / (p[4, b] - p[3, b])
        x = (r - p[4, b]) / p[14, b]
        if x.real > 0.0:
            e = exp(-x)
            lost = 1.0 / (1.0 + e)
        else:
            e = exp(x)
            lost = e / (1.0 + e)
        a = lost / p[5, b]
        a1 = a * (1.0 - lost) / p[14, b]
        damage = (z + half * (rate0 + a)) / (1.0 + half * a)
    out[0] = damage
    out[1] = (1.0 - damage) * a
    slopes[0] = -a
    hold = p[7, b]
    strength = hold * (1.0 - damage) * w
    qx = g * rx + damping * vx * h - p[8, b]
    qy = g * ry + damping * vy * h - p[9, b]
    fx = strength * qx
    fy = strength * qy
    fr[0] += fx
    fr[1] += fy
    fr[2] += ax * fy - ay * fx
    if not tangent:
        return
    # slopes along r, each divided by r so that they multiply (rx, ry)
    g1 = (k * h - g) / (r * r)
    h1 = -2.0 * saturation * h * k / (cap * r)
    s1 = hold * (1.0 - damage) * w1 / r
    ux = strength * (g1 * rx + damping * vx * h1) + s1 * qx
    uy = strength * (g1 * ry + damping * vy * h1) + s1 * qy
    k00 = strength * g + ux * rx
    k01 = ux * ry
    k10 = uy * rx
    k11 = strength * g + uy * ry
    if p[17, b].real > 0.0:  # the limit turns with the direction
        u = k * r / cap
        by_cap, h_cap = (saturation - u * h) / r, 2.0 * saturation * h * u / cap
        mx = strength * (by_cap * rx + damping * vx * h_cap)
        my = strength * (by_cap * ry + damping * vy * h_cap)
        k00 += mx * cap_x
        k01 += mx * cap_y
        k10 += my * cap_x
        k11 += my * cap_y
    cd = strength * damping * h
    fz, gx, zx = slopes[1:4], slopes[4:7], slopes[7:10]
    fz[0] = -hold * w * qx
    fz[1] = -hold * w * qy
    fz[2] = ax * fz[1] - ay * fz[0]
    gr = (1.0 - damage) * a1 / r
    gx[0] = gr * rx
    gx[1] = gr * ry
    gx[2] = gr * (ax * ry - ay * rx)
    share = half / (1.0 + half * a)
    # r_ depends on theta by (-ay, ax); the rate r' depends on theta by -theta' (ax, ay)
    col0 = k00 * -ay + k01 * ax - cd * big[5] * ax
    col1 = k10 * -ay + k11 * ax - cd * big[5] * ay
    kr[0, 0] += k00
    kr[0, 1] += k01
    kr[0, 2] += col0
    kr[1, 0] += k10
    kr[1, 1] += k11
    kr[1, 2] += col1
    kr[2, 0] += ax * k10 - ay * k00
    kr[2, 1] += ax * k11 - ay * k01
    kr[2, 2] += ax * col1 - ay * col0 - ax * fx - ay * fy
    cr[0, 0] += cd
    cr[1, 1] += cd
    cr[0, 2] -= cd * ay
    cr[2, 0] -= cd * ay
    cr[1, 2] += cd * ax
    cr[2, 1] += cd * ax
    cr[2, 2] += cd * (ax * ax + ay * ay)
    for m in range(3):
        zx[m] = share * gx[m]
        for n in range(3):
            kr[m, n] += fz[m] * share * gx[n]


@inner
def parameter_slopes(p: Any, b: int, big: Any, z: Any, dp: Any) -> None:
    """Fill the first 4 rows of dp (., 3): slopes of F by k, c, cap, hold at damage z (breakage stays)."""
    c, s = cos(big[2]), sin(big[2])
    ax = c * p[10, b] - s * p[11, b]
    ay = s * p[10, b] + c * p[11, b]
    rx = ax + big[0] - p[12, b]
    ry = ay + big[1] - p[13, b]
    vx = big[3] - ay * big[5]
    vy = big[4] + ax * big[5]
    r = sqrt(rx * rx + ry * ry + p[6, b] * p[6, b])
    k, damping = p[0, b], p[1, b]
    cap, _, _, by_cap = directed_cap(p, b, rx, ry, r)
    u = k * r / cap
    saturation = saturated(u)
    h = 1.0 - saturation * saturation
    w = 1.0
    if p[5, b] > 0.0:
        step, _ = smoothstep((r - p[3, b]) / (p[4, b] - p[3, b]))
        w = 1.0 - step
    hold = p[7, b] * (1.0 - z) * w
    slope = -2.0 * saturation * h  # dh/du
    for m in range(4):
        dp[m, 0] = 0.0
        dp[m, 1] = 0.0
    dp[0, 0] = hold * (h * rx + damping * vx * slope * r / cap)
    dp[0, 1] = hold * (h * ry + damping * vy * slope * r / cap)
    dp[1, 0] = hold * vx * h
    dp[1, 1] = hold * vy * h
    dcap = (saturation - u * h) / r
    dp[2, 0] = hold * by_cap * (dcap * rx - damping * vx * slope * u / cap)
    dp[2, 1] = hold * by_cap * (dcap * ry - damping * vy * slope * u / cap)
    share = (1.0 - z) * w
    dp[3, 0] = share * (cap * saturation / r * rx + damping * vx * h - p[8, b])
    dp[3, 1] = share * (cap * saturation / r * ry + damping * vy * h - p[9, b])
    for m in range(4):
        dp[m, 2] = ax * dp[m, 1] - ay * dp[m, 0]
