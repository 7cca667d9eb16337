"""Force elements on a joint or between two bodies: joint springs with stops, and bushings that may break."""

from dataclasses import dataclass
from math import hypot

__all__ = ["Bushing", "JointSpring"]

Point = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class JointSpring:
    """Torsional spring, damper and smooth stops between two bodies (torque on `a`, opposite on `b`).

        T = -k phi - c phi' - k_stop [softplus(phi - upper) - softplus(-phi - lower)],  phi = theta_a -
        theta_b - rest

    rest: rad, None for the angle at the start. upper, lower: stop angles on either side of rest, rad, both >=
    0;
    softplus(x) = width log(1 + exp(x/width)), so a stop begins to act a few widths before its angle.
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Bushing:
    """Two-axis bushing of a point of `a` to a point of `b`, in b's frame, that saturates and may let go for
    good.

        force on a = -hold (1 - D) w(r) [cap tanh(k r/cap) e + c r' sech^2(k r/cap) - preload]
        dD/dt = (1 - D) logistic((r - release)/width)/tau,   D(0) = 0

    w falls from 1 at r = slip to 0 at r = release (C2), e is the unit separation, r its length (rounded at
    eps).
    Without `slip` and `release` the bushing never breaks; without `cap` it is linear. `hold` in [0, 1] scales
    all.
    preload: the force (N, b's frame) that it exerts on `a` with no separation.
    opens: direction (b's frame) in which `a` comes loose; `cap` then limits the force on that side only, and
    `push_cap` the force when `a` is pressed on, with a C2 transition between e . opens = 0 and -1.
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

    def column(self) -> tuple[float, ...]:
        """Parameters in the order of the kernel."""
        nx, ny = (0.0, 0.0) if self.opens is None else self.opens
        length = hypot(nx, ny) or 1.0
        return (
            self.k, self.c, 1e30 if self.cap is None else self.cap,
            0.0 if self.slip is None else self.slip, 1.0 if self.release is None else self.release,
            self.tau if self.breakable else 0.0, self.eps, self.hold, *self.preload,
            *self.point_a, *self.point_b, self.width,
            nx / length, ny / length, 0.0 if self.push_cap is None else self.push_cap,
        )  # fmt: skip
