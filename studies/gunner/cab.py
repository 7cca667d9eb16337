"""A driven cab in the place of the vehicle: the same name and frame, a motion over time instead of wheels."""

from workbench.engine import Prescribed, SpatialBody, SpatialMotion

from .parts import Parts

__all__ = ["ONSET", "SPEED", "braked", "driven_cab", "straight"]

SPEED = 17.0  # m/s
ONSET = 0.5  # s: the brakes
RAMP = 0.05  # s: smooth rise and fall of the deceleration


def straight(speed: float = SPEED) -> SpatialMotion:
    """Forward at constant speed, m/s."""
    return SpatialMotion(
        position=lambda t: (speed * t, 0.0, 0.0),
        velocity=lambda t: (speed, 0.0, 0.0),
        acceleration=lambda t: (0.0, 0.0, 0.0),
    )


def braked(deceleration: float, *, speed: float = SPEED) -> SpatialMotion:
    """At `speed` to 0.5 s, then braked (m/s2, C2 over 50 ms) until it stands.

    Raises ValueError where it would stand before the brakes are fully on.

    >>> motion = braked(7.0)
    >>> motion.velocity(3.0)[0]
    0.0
    """
    full = speed / deceleration - RAMP if deceleration > 0.0 else -1.0
    if full < 0.0:
        raise ValueError(f"deceleration needs 0 < value <= {speed / RAMP:g} m/s2, got {deceleration}")

    def pulse(t: float, order: int) -> float:
        fall = _ramp(t - ONSET - RAMP - full, order)
        return deceleration * (_ramp(t - ONSET, order) - fall)

    def velocity(t: float) -> float:
        return speed - pulse(t, 1) if t < ONSET + 2.0 * RAMP + full else 0.0

    return SpatialMotion(
        position=lambda t: (speed * t - pulse(t, 2), 0.0, 0.0),
        velocity=lambda t: (velocity(t), 0.0, 0.0),
        acceleration=lambda t: (-pulse(t, 0), 0.0, 0.0),
    )


def _ramp(t: float, order: int) -> float:
    """s^3 (10 - 15 s + 6 s^2), s = t/RAMP within 0 and 1, and its first and second integral over time."""
    s, late = min(max(t / RAMP, 0.0), 1.0), max(t - RAMP, 0.0)
    if order == 0:
        return s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    if order == 1:
        return RAMP * s**4 * (2.5 - 3.0 * s + s * s) + late
    return RAMP**2 * s**5 * (0.5 - 0.5 * s + s * s / 7.0) + 0.5 * RAMP * late + 0.5 * late * late


def driven_cab(motion: SpatialMotion) -> Parts:
    """The body "vehicle" on a motion; it neither pitches nor heaves unless the motion does."""
    return Parts(bodies=(SpatialBody(name="vehicle", joint=Prescribed(motion=motion)),))
