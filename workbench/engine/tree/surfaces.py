"""What a body may touch: shapes with smooth contact, roads, and tyres that roll on them."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import atan, cos, hypot, pi, sin
from typing import Any

import numpy as np
from scipy.optimize import brentq

from ..elements._kernels_contact import BOX, CAPSULE, PLANE, RING, SPHERE
from ..errors import InvalidSystem
from .joints import ZERO, Triple

__all__ = ["Box", "Capsule", "Plane", "Ring", "Road", "Shape", "SpatialContact", "Sphere", "Tyre"]

Array = np.ndarray[Any, Any]
GROUND = "ground"
SLIPS = np.geomspace(1e-3, 3.0, 40001)  # among which the largest force of a tyre is looked for


@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """The half space behind a plane: outward normal, and offset of the plane along it, m."""

    normal: Triple = (0.0, 0.0, 1.0)
    offset: float = 0.0

    def numbers(self) -> tuple[int, tuple[float, ...]]:
        """Kind and numbers of the kernel."""
        return PLANE, (*_unit(self.normal, "plane"), self.offset)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere:
    """A ball."""

    centre: Triple = ZERO
    radius: float

    def numbers(self) -> tuple[int, tuple[float, ...]]:
        """Kind and numbers of the kernel."""
        return SPHERE, (*self.centre, self.radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Capsule:
    """All points within a radius of a segment; its ends are rounded in C2 over a tenth of its length."""

    start: Triple
    end: Triple
    radius: float

    def __post_init__(self) -> None:
        if self.start == self.end:
            raise InvalidSystem(f"capsule needs two ends, got {self.start} twice; take a Sphere")

    def numbers(self) -> tuple[int, tuple[float, ...]]:
        """Kind and numbers of the kernel."""
        return CAPSULE, (*self.start, *self.end, self.radius)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ring:
    """A circle with a round tube: a hatch, a steering wheel."""

    centre: Triple = ZERO
    axis: Triple = (0.0, 0.0, 1.0)
    radius: float
    tube: float

    def numbers(self) -> tuple[int, tuple[float, ...]]:
        """Kind and numbers of the kernel."""
        return RING, (*self.centre, *_unit(self.axis, "ring"), self.radius, self.tube)


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box along the body's axes with rounded edges; it pushes from outside only."""

    centre: Triple = ZERO
    half: Triple
    rounding: float

    def __post_init__(self) -> None:
        if not 0.0 < self.rounding < min(self.half):
            raise InvalidSystem(
                f"box needs 0 < rounding < its half sizes, got rounding={self.rounding}, half={self.half}"
            )

    def numbers(self) -> tuple[int, tuple[float, ...]]:
        """Kind and numbers of the kernel; the rounding lies inside the given sizes."""
        return BOX, (*self.centre, *(h - self.rounding for h in self.half), self.rounding)


Shape = Plane | Sphere | Capsule | Ring | Box


@dataclass(frozen=True, slots=True, kw_only=True)
class SpatialContact:
    """A sphere on `a` (radius 0: a point) against a shape on `b`, both in their bodies' frames.

        N = k R(d)^power R1(1 + damping d'),   friction mu N v/sqrt(v.v + slow^2),
        d the depth of penetration

    R is rounded in C2 over `width` (m). damping: s/m (Hunt and Crossley 1975), kept from pulling.
    friction mu, slow: m/s over which it builds up.
    """

    a: str
    b: str = GROUND
    point: Triple = ZERO
    radius: float = 0.0
    shape: Shape
    k: float
    power: float = 1.5
    damping: float = 0.0
    width: float = 1e-3
    friction: float = 0.0
    slow: float = 0.05

    def __post_init__(self) -> None:
        if self.a == self.b:
            raise InvalidSystem(f"contact needs two bodies, got '{self.a}' twice")
        if min(self.width, self.slow) <= 0.0 or self.power < 1.0 or self.radius < 0.0:
            raise InvalidSystem(
                f"contact '{self.a}'-'{self.b}' needs width > 0, slow > 0, power >= 1 and radius >= 0, got "
                f"width={self.width}, slow={self.slow}, power={self.power}, radius={self.radius}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Road:
    """Height over the global x, y: waves behind a smooth ramp, and a kerb; flat by default.

    amplitude sin(2 pi s/wavelength), s = distance beyond `start` along `heading` (rad from x), grown over
    `ramp` m.  waves: more of them, (amplitude m, wavelength m, phase rad) each, behind the same ramp;
    `with_profile` makes them of any smooth function.  kerb: a step of kerb_height at kerb_at along
    kerb_heading, over kerb_width m (C2).
    """

    amplitude: float = 0.0
    wavelength: float = 1.0
    heading: float = 0.0
    start: float = 0.0
    ramp: float = 1.0
    kerb_height: float = 0.0
    kerb_at: float = 0.0
    kerb_heading: float = 0.0
    kerb_width: float = 0.1
    waves: tuple[Triple, ...] = ()

    def __post_init__(self) -> None:
        if min(self.wavelength, self.ramp, self.kerb_width) <= 0.0:
            raise InvalidSystem(
                f"road needs wavelength, ramp and kerb_width > 0 m, got {self.wavelength}, {self.ramp}, "
                f"{self.kerb_width}"
            )
        if any(wavelength <= 0.0 for _, wavelength, _ in self.waves):
            raise InvalidSystem(f"road needs waves of (amplitude, wavelength > 0, phase), got {self.waves}")

    def with_profile(self, height: Callable[[float], float], *, length: float, count: int = 32) -> "Road":
        """This road with a profile height(s) instead of waves: its Fourier series over `length` m.

        height: m over s in [0, length], smooth and as high at the end as at the start, for it is repeated
        beyond; its mean counts as no height.  count: waves, down to a wavelength of length/count.

        >>> bump = Road().with_profile(lambda s: 0.1 * sin(pi * s / 8.0) ** 4, length=8.0, count=4)
        >>> round(bump.waves[1][0], 6)
        0.0125
        """
        if length <= 0.0 or count < 1:
            raise InvalidSystem(f"profile needs length > 0 m and count >= 1, got {length} and {count}")
        samples = np.array([height(length * i / (4 * count)) for i in range(4 * count)], float)
        parts = np.fft.rfft(samples)[1 : count + 1] / (2 * count)
        waves = tuple(
            (float(abs(part)), length / (i + 1), float(np.angle(part) + 0.5 * pi))
            for i, part in enumerate(parts)
        )
        return replace(self, amplitude=0.0, waves=waves)

    def height(self, x: float, y: float) -> float:
        """What a tyre rolls on at (x, y), m over the plane z = 0.

        >>> Road(kerb_height=0.1, kerb_at=5.0).height(6.0, 0.0)
        0.1
        """
        s = x * cos(self.heading) + y * sin(self.heading) - self.start
        wave = self.amplitude * sin(2.0 * pi * s / self.wavelength)
        wave += sum(a * sin(2.0 * pi * s / wavelength + phase) for a, wavelength, phase in self.waves)
        beyond = x * cos(self.kerb_heading) + y * sin(self.kerb_heading) - self.kerb_at
        return _step(s / self.ramp) * wave + self.kerb_height * _step(beyond / self.kerb_width)

    def numbers(self) -> tuple[float, ...]:
        """Numbers of the kernel."""
        return (
            self.amplitude, 2.0 * pi / self.wavelength, cos(self.heading), sin(self.heading), self.start,
            self.ramp, self.kerb_height, self.kerb_at, cos(self.kerb_heading), sin(self.kerb_heading),
            self.kerb_width,
            *(x for a, wavelength, phase in self.waves for x in (a, 2.0 * pi / wavelength, phase)),
        )  # fmt: skip


def _step(share: float) -> float:
    """0 below 0, 1 above 1, C2 between."""
    s = min(max(share, 0.0), 1.0)
    return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)


@dataclass(frozen=True, slots=True, kw_only=True)
class Tyre:
    """Pacejka's tyre of 1989 on a wheel that turns about `axis` (to the left, in the wheel's frame).

    Fz = stiffness R(deflection) R1(1 + damping/nominal_load deflection'), lateral and longitudinal forces
    from a0..a7 and b0..b8 (Fz in kN, degrees, per cent), scaled by friction/reference_friction; combined
    slip by similarity; both slips relax over `relaxation` m and are states. Camber shifts nothing in the
    formula, but the tyre's deflection and contact point follow the inclined wheel.
    slow: speed (m/s) below which slips fade as if it rolled at `slow`; a standing tyre creeps.
    """

    body: str
    radius: float
    stiffness: float
    damping: float
    nominal_load: float
    lateral: tuple[float, ...]
    longitudinal: tuple[float, ...]
    axis: Triple = (0.0, 1.0, 0.0)
    friction: float = 0.8
    reference_friction: float = 0.8
    relaxation: float = 0.8
    rolling_resistance: float = 0.0
    width: float = 1e-3
    slow: float = 0.1
    road: Road = Road()

    def __post_init__(self) -> None:
        if len(self.lateral) != 8 or len(self.longitudinal) != 9:
            raise InvalidSystem(
                f"tyre of '{self.body}' needs 8 lateral and 9 longitudinal coefficients, got "
                f"{len(self.lateral)} and {len(self.longitudinal)}"
            )
        sizes = (self.radius, self.stiffness, self.nominal_load, self.friction, self.relaxation, self.slow)
        if min(*sizes, self.width, self.reference_friction) <= 0.0:
            raise InvalidSystem(
                f"tyre of '{self.body}' needs radius, stiffness, nominal_load, friction, relaxation, slow "
                "and width > 0"
            )

    def force(self, slip: Any, load: float, *, lateral: bool) -> Any:
        """Force of a pure slip (tangent of the angle, or ratio) at a load in N and the reference friction.

        slip: float or (n,) slips, or complex for its slope by complex step.
        """
        z = 1e-3 * load
        if lateral:
            a = self.lateral
            c, d, bcd = a[0], a[1] * z * z + a[2] * z, a[3] * sin(2.0 * atan(z / a[4]))
            e, x = a[6] * z + a[7], 180.0 / pi * np.arctan(slip)
        else:
            b = self.longitudinal
            c, d = b[0], b[1] * z * z + b[2] * z
            bcd = (b[3] * z * z + b[4] * z) * float(np.exp(-b[5] * z))
            e, x = b[6] * z * z + b[7] * z + b[8], 100.0 * slip
        u = bcd / (c * d) * x
        return d * np.sin(c * np.arctan(u - e * (u - np.arctan(u))))

    def peak(self, *, lateral: bool) -> float:
        """Slip of the largest force at the nominal load."""
        top = int(np.argmax(self.force(SLIPS[::40], self.nominal_load, lateral=lateral))) * 40
        near = SLIPS[max(0, top - 40) : top + 41]

        def slope(slip: float) -> float:
            return float(self.force(complex(slip, 1e-30), self.nominal_load, lateral=lateral).imag)

        if slope(near[0]) <= 0.0 or slope(near[-1]) >= 0.0:  # the largest is the last
            return float(SLIPS[top])
        return float(brentq(slope, near[0], near[-1], xtol=1e-15, rtol=1e-14))

    def numbers(self) -> tuple[float, ...]:
        """Numbers of the kernel."""
        return (
            self.radius, self.stiffness, self.damping, self.nominal_load, self.width,
            self.friction / self.reference_friction, self.relaxation, self.slow, self.peak(lateral=False),
            self.peak(lateral=True), self.rolling_resistance, *self.lateral, *self.longitudinal,
            *_unit(self.axis, f"tyre of '{self.body}'"),
        )  # fmt: skip


def _unit(direction: Triple, where: str) -> tuple[float, float, float]:
    x, y, z = direction
    size = hypot(x, y, z)
    if size == 0.0:
        raise InvalidSystem(f"{where} needs a direction, got {direction}")
    return x / size, y / size, z / size
