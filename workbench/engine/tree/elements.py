"""Forces on a tree: members, bushings, springs and dampers on coordinates, couplings, loads; SI units."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..elements.laws import Law
from ..elements.state_law import StateLaw
from ..errors import InvalidSystem
from .joints import ZERO, Quaternion, Triple

__all__ = [
    "CoordinateDamper", "CoordinateSpring", "Coupling", "SpatialBushing", "SpatialLoad", "SpatialMember",
    "SpatialStrut", "SphericalSpring", "friction_samples",
]  # fmt: skip

Array = np.ndarray[Any, Any]
GROUND = "ground"


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialMember:
    """A force element between a point of body `a` and a point of body `b`; its law and density as for a
    planar `Member`.

    natural_length: m, None for the length at the start.  power: SIMP exponent.
    """

    a: str
    b: str = GROUND
    point_a: Triple = ZERO
    point_b: Triple = ZERO
    law: Law
    natural_length: float | None = None
    power: float = 1.0
    name: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialStrut:
    """A force along the line from a point of body `a` to a point of body `b` by a law with states of its own,
    which the scheme integrates; it has no density.

    natural_length: m, None for the length at the start.  name: its states are called "x of strut 'name'",
    or 'a-b' without one.
    """

    a: str
    b: str = GROUND
    point_a: Triple = ZERO
    point_b: Triple = ZERO
    law: StateLaw
    natural_length: float | None = None
    name: str = ""

    @property
    def called(self) -> str:
        """Its name, or those of its bodies."""
        return self.name or f"{self.a}-{self.b}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialBushing:
    """Three-axis bushing of a point of `a` to a point of `b`, in b's axes, that saturates and may let go for
    good.

        force on a = -hold (1 - D) w(|r|) [g k r + h c r' - preload],   g = cap tanh(e/cap)/e,  h =
        sech^2(e/cap) e = sqrt(|k r|^2 + (mean(k) eps)^2),   dD/dt = (1 - D) logistic((|r| -
        release)/width)/tau,   D(0) = 0

    k, c: one number, or one per axis of b.  w falls from 1 at |r| = slip to 0 at release (C2). Without `slip`
    and `release` it never breaks; without `cap` it is linear. preload: force on `a` (N, b's axes) at no
    separation.  opens, push_cap: as in the planar `Bushing`; `cap` then limits the force on the opening side.
    """

    a: str
    b: str = GROUND
    point_a: Triple = ZERO
    point_b: Triple = ZERO
    k: float | Triple
    c: float | Triple = 0.0
    cap: float | None = None
    slip: float | None = None
    release: float | None = None
    tau: float = 0.02
    width: float = 0.005
    eps: float = 5e-4
    hold: float = 1.0
    preload: Triple = ZERO
    opens: Triple | None = None
    push_cap: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        where = f"bushing '{self.a}'-'{self.b}'"
        if (self.slip is None) != (self.release is None):
            raise InvalidSystem(f"{where} needs both slip and release, or neither")
        if self.slip is not None and self.release is not None and not 0.0 <= self.slip < self.release:
            raise InvalidSystem(f"{where} needs 0 <= slip < release in m, got {self.slip} and {self.release}")
        if self.cap is not None and self.cap <= 0.0:
            raise InvalidSystem(f"{where} needs cap > 0 N, got cap={self.cap}")
        if (self.opens is None) != (self.push_cap is None) or (self.opens and self.cap is None):
            raise InvalidSystem(f"{where} needs opens, push_cap and cap together")
        if min(self.tau, self.width, self.eps) <= 0.0:
            raise InvalidSystem(f"{where} needs tau, width and eps > 0")

    @property
    def breakable(self) -> bool:
        """Whether it has a release distance."""
        return self.release is not None

    def column(self) -> tuple[float, ...]:
        """Parameters in the order of the kernel; points in the bodies' frames."""
        k, c = (x if isinstance(x, tuple) else (x, x, x) for x in (self.k, self.c))
        opens = np.zeros(3) if self.opens is None else np.asarray(self.opens) / np.linalg.norm(self.opens)
        return (
            *k, *c, 1e30 if self.cap is None else self.cap,
            0.0 if self.slip is None else self.slip, 1.0 if self.release is None else self.release,
            self.tau if self.breakable else 0.0, self.eps, self.hold, *self.preload,
            *self.point_a, *self.point_b, self.width, *(float(x) for x in opens),
            0.0 if self.push_cap is None else self.push_cap,
        )  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class CoordinateSpring:
    """Spring, damper, smooth stops and constant torque on one coordinate of a body's joint.

        T = torque - k phi - c phi' - k_stop [softplus(phi - upper) - softplus(-phi - lower)],  phi = q - rest

    coordinate: which of the joint's coordinates (in the order of the joint's description).  rest: None for
    the value at the start.  Units N m/rad for turns, N/m for slides; `width` of the stops in rad or m.
    """

    body: str
    coordinate: int = 0
    k: float = 0.0
    c: float = 0.0
    rest: float | None = None
    k_stop: float = 0.0
    upper: float = 0.0
    lower: float = 0.0
    width: float = 0.02
    torque: float = 0.0

    def __post_init__(self) -> None:
        if self.width <= 0.0 or min(self.k_stop, self.upper, self.lower) < 0.0:
            raise InvalidSystem(
                f"spring of '{self.body}' needs width > 0 and k_stop, upper, lower >= 0 (distances on either "
                f"side of rest), got width={self.width}, k_stop={self.k_stop}, upper={self.upper}, "
                f"lower={self.lower}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class CoordinateDamper:
    """Resistance against the rate v of one coordinate of a body's joint: two rates of damping, and friction.

        T = -(forward + backward)/2 v - (forward - backward)/2 (s - slow) - friction v/s,
        s = sqrt(v^2 + slow^2)

    forward, backward: N m s/rad or N s/m for v > 0 and v < 0 (None: as forward): a shock absorber.
    friction: N m or N, constant or over time: a brake.  slow: rad/s or m/s over which either turns round, so
    a braked joint that is pulled creeps.
    """

    body: str
    coordinate: int = 0
    forward: float = 0.0
    backward: float | None = None
    friction: float | Callable[[float], float] = 0.0
    slow: float = 0.01

    def __post_init__(self) -> None:
        if self.slow <= 0.0:
            raise InvalidSystem(f"damper of '{self.body}' needs slow > 0, got slow={self.slow}")

    def numbers(self) -> tuple[float, float, float]:
        """Numbers of the kernel: half the sum and half the difference of the rates, and `slow`."""
        backward = self.forward if self.backward is None else self.backward
        return 0.5 * (self.forward + backward), 0.5 * (self.forward - backward), self.slow

    def friction_at(self, t: float) -> float:
        """Friction at a time."""
        return float(self.friction(t)) if callable(self.friction) else self.friction


def friction_samples(dampers: Sequence[CoordinateDamper], times: Sequence[float]) -> Array:
    """(times, dampers) friction; what is constant is not asked for at each time."""
    table = np.empty((len(times), len(dampers)))
    for i, damper in enumerate(dampers):
        given = damper.friction
        table[:, i] = [damper.friction_at(t) for t in times] if callable(given) else given
    return table


@dataclass(frozen=True, slots=True, kw_only=True)
class SphericalSpring:
    """Equal stiffness and damping about all axes of a spherical or floating joint's rotation.

    Torque -k x - c w in the body's frame, x the rotation vector from `rest` (None: the
    orientation at the start), shorter than pi.
    """

    body: str
    k: float = 0.0
    c: float = 0.0
    rest: Quaternion | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Coupling:
    """A spring and damper between two joint coordinates (an anti-roll bar): T = -k (q_a - q_b - rest) - c
    ()'.

    rest: None for the difference at the start.
    """

    a: str
    b: str
    coordinate_a: int = 0
    coordinate_b: int = 0
    k: float = 0.0
    c: float = 0.0
    rest: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialLoad:
    """A force at a point of a body, or a torque on it, constant or over time; in global axes, or in the
    body's where `follows`.
    """

    body: str
    point: Triple = ZERO
    force: Triple | Callable[[float], Any] | None = None
    torque: Triple | Callable[[float], Any] | None = None
    follows: bool = False

    def __post_init__(self) -> None:
        if (self.force is None) == (self.torque is None):
            raise InvalidSystem(f"load on '{self.body}' needs either force or torque")

    def sample(self, t: float) -> Any:
        """(3,) force or torque at time t."""
        given = self.force or self.torque
        return np.asarray(given(t) if callable(given) else given, float)
