"""What the driver does and what lies under the wheels: smooth functions of time, a road, kerbs."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

from workbench.engine import Road, Shape

__all__ = ["Ground", "Manoeuvre", "constant", "smooth_step"]

Function = Callable[[float], float]


@lru_cache(maxsize=64)
def smooth_step(*, start: float, duration: float, height: float) -> Function:
    """0 before `start`, `height` after `duration` more, s^3 (10 - 15 s + 6 s^2) between (C2).

    The same step is the same function, so that cases which differ in something else share its samples.

    >>> turn = smooth_step(start=1.0, duration=0.5, height=2.0)
    >>> turn(0.9), turn(1.25), turn(2.0)
    (0.0, 1.0, 2.0)
    """

    def step(t: float) -> float:
        s = min(max((t - start) / duration, 0.0), 1.0)
        return height * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)

    return step


def constant(value: float) -> Function:
    """The same at all times."""
    return lambda t: value


FLAT, NOTHING = Road(), constant(0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """A road (its height over the plane), its friction, and obstacles that wheels strike with their sides.

    obstacles: shapes of the engine in global axes; a sphere at the foot of every wheel touches them.
    """

    road: Road = FLAT
    friction: float = 0.9
    obstacles: tuple[Shape, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvre:
    """What the driver does: C2 functions of time, and the speed at the start.

    speed, drift: m/s forward and to the left at t = 0.
    steering: t -> angle of the steering wheel, rad, positive to the left.
    braking: t -> deceleration that the driver asks for, m/s^2, at least 0.

    The vehicle rolls freely between; nothing drives it.
    """

    speed: float = 17.0
    drift: float = 0.0
    steering: Function = NOTHING
    braking: Function = NOTHING
