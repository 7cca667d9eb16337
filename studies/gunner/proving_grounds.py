"""The proving grounds of chapter VIII and two of our own: a ground and a manoeuvre each.

    straight        17 m/s, nothing else
    braking         severe: 7 m/s^2 from 0.5 s on
    step steer      360 deg of the steering wheel within 0.5 s
    rollover        720 deg within 0.5 s, from 1 s on, friction 1.2: below about 1.15 it does not roll
    rough           waves of 8 m, three amplitudes
    kerb trip       sliding sideways against a kerb (ours)

Frictions are declared, the dissertation gives none; see docs/explanation/the-gunner.md.
"""

from dataclasses import dataclass
from math import radians

from workbench.engine import Box, Road

from .manoeuvre import Ground, Manoeuvre, smooth_step

__all__ = [
    "ProvingGround", "braking", "kerb_trip", "rollover", "rough", "step_steer", "straight",
]  # fmt: skip

SPEED = 17.0  # m/s, section 8.2
FRICTION = 0.9  # assumed: dry asphalt
HALF_TRACK, FOOT = 0.9095, 0.05  # m: where the left wheels strike, and the radius of what strikes
DEEP = 0.5  # m: how far a kerb reaches below the road


@dataclass(frozen=True, slots=True, kw_only=True)
class ProvingGround:
    """A ground, what the driver does on it, and how long, s."""

    name: str
    ground: Ground
    manoeuvre: Manoeuvre
    t_end: float = 3.0


def straight(*, speed: float = SPEED) -> ProvingGround:
    """Straight on over a plane."""
    return ProvingGround(name="straight", ground=Ground(friction=FRICTION), manoeuvre=Manoeuvre(speed=speed))


def braking(
    *, deceleration: float = 7.0, start: float = 0.5, within: float = 0.05, friction: float = FRICTION,
    speed: float = SPEED,
) -> ProvingGround:  # fmt: skip
    """Severe braking: the deceleration (m/s^2) is asked for within 50 ms."""
    manoeuvre = Manoeuvre(speed=speed, braking=smooth_step(start=start, duration=within, height=deceleration))
    return ProvingGround(name="braking", ground=Ground(friction=friction), manoeuvre=manoeuvre)


def step_steer(
    *, turn: float = 360.0, within: float = 0.5, start: float = 0.0, friction: float = FRICTION,
    speed: float = SPEED,
) -> ProvingGround:  # fmt: skip
    """A turn (deg, positive to the left) of the steering wheel."""
    manoeuvre = Manoeuvre(
        speed=speed, steering=smooth_step(start=start, duration=within, height=radians(turn))
    )
    return ProvingGround(name="step steer", ground=Ground(friction=friction), manoeuvre=manoeuvre)


def rollover(
    *, turn: float = 720.0, within: float = 0.5, start: float = 1.0, friction: float = 1.2,
    speed: float = SPEED,
) -> ProvingGround:  # fmt: skip
    """Two turns of the steering wheel on a road with more grip than roads have."""
    steered = step_steer(turn=turn, within=within, start=start, friction=friction, speed=speed)
    return ProvingGround(name="rollover", ground=steered.ground, manoeuvre=steered.manoeuvre)


def rough(
    *, amplitude: float = 0.05, wavelength: float = 8.0, ramp: float = 8.0, speed: float = SPEED,
    friction: float = FRICTION, t_end: float = 10.0,
) -> ProvingGround:  # fmt: skip
    """Waves of an amplitude (m) that begin 2 m ahead of the front axle and grow over `ramp`."""
    road = Road(amplitude=amplitude, wavelength=wavelength, start=2.0, ramp=ramp)
    return ProvingGround(
        name="rough",
        ground=Ground(road=road, friction=friction),
        manoeuvre=Manoeuvre(speed=speed),
        t_end=t_end,
    )


def kerb_trip(
    *, drift: float = 6.0, height: float = 0.15, distance: float = 0.05, friction: float = FRICTION
) -> ProvingGround:
    """Sliding to the left at `drift` (m/s) against a kerb `distance` beside the left wheels."""
    half = (10.0, 1.0, 0.5 * (height + DEEP))
    kerb = Box(
        centre=(0.0, HALF_TRACK + FOOT + distance + half[1], height - half[2]), half=half, rounding=0.02
    )
    return ProvingGround(
        name="kerb trip",
        ground=Ground(friction=friction, obstacles=(kerb,)),
        manoeuvre=Manoeuvre(speed=0.0, drift=drift),
    )
