"""Slopes of the gunner's and the vehicle's responses by what is uncertain, exact for the computed run.

    response_slopes("braking", {"hands": "one"}, ("deviation", "hic15"), ("grip", "mass"))
    -> {"deviation": {"grip": ..., "mass": ...}, "hic15": {...}}

One run, one backward sweep for all responses, no run for a parameter. A time at which something happens has
slopes where it does happen; whether it happens has none.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from math import degrees, sqrt
from types import MappingProxyType
from typing import Any

import numpy as np

from workbench.engine import (
    Coordinate,
    GeneralisedAlpha,
    Maximum,
    Terminal,
    TreeSystem,
    TreeTrajectory,
    parameter_jacobian,
    simulate,
)

from ..cases import numbers_of, system
from ..occupant_responses import STANDARD_GRAVITY, objectives
from ..uncertain import NOMINAL, STEPS, TIMES, case_of
from ..vehicle.quantities import VehicleHistory

__all__ = ["NO_SLOPES", "PARAMETERS", "SLOPED", "response_slopes", "value_of", "vehicle_objectives"]

SCHEME = GeneralisedAlpha(tolerance=1e-13)
LATE = 1e9  # s: what the driver asks for in the end
CHOICES = ("hands", "posture", "level", "start")
PARAMETERS = tuple(name for name in NOMINAL if name not in (*CHOICES, "fires_late"))

HAPPENS = "it is 0 or 1; take the slopes of the time at which it happens"
NO_SLOPES: Mapping[str, str] = MappingProxyType(
    {
        "ejected": HAPPENS, "grip_lost": HAPPENS, "seat_lost": HAPPENS,
        "rise_at": "the place of a maximum, not its height; take rise",
        "grip_force": "the largest of two bushings' forces at nodes; take deviation or grip_lost_at",
        "seat_force": "the largest force of what carries him at nodes; take deviation or seat_lost_at",
        "touch_force": "the largest sum of contact forces at nodes; take head_speed or hic15",
        "least_wheel_load": "the least of four tyres' forces at nodes; take peak_roll",
        "first_wheel_lift": "forces of tyres are known without slopes; take peak_roll",
    }
)  # fmt: skip


def _least(values: Sequence[float]) -> int:
    return int(np.argmin(values))


def _most(values: Sequence[float]) -> int:
    return int(np.argmax(values))


def _first(values: Sequence[float]) -> int:
    return 0


def _one(value: float) -> float:
    return 1.0


def _per_gravity(value: float) -> float:
    return 1.0 / STANDARD_GRAVITY


def _root(value: float) -> float:
    return 0.5 / sqrt(value)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sloped:
    """How a response follows from objectives: their names, the choice among them, and d(response)/d(it)."""

    of: tuple[str, ...]
    pick: Callable[[Sequence[float]], int] = _first
    chain: Callable[[float], float] = _one
    event: bool = False


SLOPED: Mapping[str, Sloped] = MappingProxyType(
    {
        "deviation": Sloped(of=("g1",), chain=_root),
        "g1": Sloped(of=("g1",)),
        "smooth_deviation": Sloped(of=("smooth_g1",), chain=_root),
        "g2": Sloped(of=("highest",)),
        "min_g2": Sloped(of=("lowest",)),
        "rise": Sloped(of=("rise",)),
        "smooth_rise": Sloped(of=("smooth_rise",)),
        "ejected_at": Sloped(of=("ejected_at",), event=True),
        "grip_lost_at": Sloped(of=("left_grip_lost_at", "right_grip_lost_at"), pick=_least, event=True),
        "seat_lost_at": Sloped(
            of=("seat_lost_at", "left_foot_lost_at", "right_foot_lost_at"), pick=_least, event=True
        ),
        "head_speed": Sloped(of=("head_speed",)),
        "smooth_head_speed": Sloped(of=("smooth_head_speed",)),
        "head_speed_rms": Sloped(of=("head_speed_rms",)),
        "hic15": Sloped(of=("hic15",)),
        "chest_3ms": Sloped(of=("chest_3ms",), chain=_per_gravity),
        "comfort": Sloped(of=("comfort",)),
        "health": Sloped(of=("health_x", "health_y", "health_z"), pick=_most),
        **{
            name: Sloped(of=(name,))
            for name in (
                "peak_roll", "peak_pitch", "peak_yaw_rate", "peak_lateral", "peak_forward", "peak_drift",
                "final_heave", "final_speed", "final_yaw",
            )
        },
    }
)  # fmt: skip


def vehicle_objectives() -> dict[str, Any]:
    """Objectives of the vehicle's states by name: rad, rad/s, m/s2, m/s, m."""
    heave = Coordinate(
        bodies=("vehicle",), shares=(1.0,), reference="ground", direction=(0.0, 0.0, 1.0), relative=True
    )
    return {
        **{
            f"peak_{name}": Maximum(quantity=VehicleHistory(name=name, size=True))
            for name in ("roll", "pitch", "yaw_rate", "lateral", "forward", "drift")
        },
        "final_heave": Terminal(quantity=heave),
        "final_speed": Terminal(quantity=VehicleHistory(name="speed")),
        "final_yaw": Terminal(quantity=VehicleHistory(name="yaw")),
    }  # fmt: skip


def value_of(name: str, row: Mapping[str, Any], parameter: str) -> float:
    """The value that a parameter has in a row, or the model's own where the row does not say.

    Raises ValueError for choices and strangers, which have no slopes.
    """
    if parameter in CHOICES:
        raise ValueError(f"'{parameter}' is a choice: no slopes; with slopes are {', '.join(PARAMETERS)}")
    if parameter not in PARAMETERS:
        raise ValueError(f"'{parameter}' is no parameter; those with slopes are {', '.join(PARAMETERS)}")
    case = case_of(name, row)
    seat, driver, ground = numbers_of(case).seat, case.on.manoeuvre, case.on.ground
    own = {
        "grip": case.grip, "facing": case.facing, "mass": numbers_of(case).figure.mass,
        "seat_rate": seat.stiffness, "seat_damping": seat.damping, "seat_cap": seat.cap,
        "friction": ground.friction, "deceleration": driver.braking(LATE),
        "turn": degrees(driver.steering(LATE)), **{f"k_{joint}": k for joint, k in case.factors.items()},
    }  # fmt: skip
    found = getattr(case, parameter, None)
    value = float(own[parameter] if found is None else found)
    if value == 0.0 and parameter in ("deceleration", "turn"):
        raise ValueError(f"'{parameter}' does nothing in {name}: no slopes")
    return value


def response_slopes(
    name: str,
    row: Mapping[str, Any],
    responses: Sequence[str],
    parameters: Sequence[str],
    *,
    t_end: float | None = None,
    step: float | None = None,
) -> dict[str, dict[str, float]]:
    """Slopes of some responses by some parameters in one run on a proving ground.

    Args:    name, row: as of `uncertain.responses`    responses: of `SLOPED`    parameters: of `PARAMETERS`
             t_end: s, None for the time of that proving ground    step: s, None for that of the row's level
    Returns: response -> parameter -> slope, in their units.
    Raises ValueError for what has no slopes, with the reason, and for a time of what does not happen.

    >>> found = response_slopes("braking", {}, ["rise"], ["mass"], t_end=0.1)
    >>> abs(found["rise"]["mass"]) < 1e-6  # m/kg: at rest until the brakes act
    True
    """
    for response in responses:
        if response not in SLOPED:
            why = NO_SLOPES.get(response, f"no such response; with slopes are {', '.join(SLOPED)}")
            raise ValueError(f"'{response}' has no slopes: {why}")
    values = {parameter: value_of(name, row, parameter) for parameter in parameters}
    case = case_of(name, row)
    t_end = TIMES[name] if t_end is None else t_end
    step = STEPS[case.level] if step is None else step
    run = simulate(system(case), np.zeros(0), t_end, round(t_end / step), scheme=SCHEME)
    ask = objectives(run.system, t_end=t_end) | vehicle_objectives()
    # a hand that never held has lost nothing
    never = [f"{b.name.replace(' ', '_')}_lost_at" for b in run.system.bushings if b.hold == 0.0]
    moved = {key: (value, _at(name, row, key)) for key, value in values.items()}
    taken = {response: _taken(run, response, ask, never, t_end) for response in responses}
    by = parameter_jacobian(run, [part for part, _ in taken.values()], moved)
    return {
        response: {key: factor * float(slopes[i]) for key, slopes in by.items()}
        for i, (response, (_, factor)) in enumerate(taken.items())
    }


def _taken(
    run: TreeTrajectory, response: str, ask: Mapping[str, Any], never: Sequence[str], t_end: float
) -> tuple[Any, float]:
    """The objective that a response follows in a run, and d(response)/d(it)."""
    how = SLOPED[response]
    parts = [ask[key] for key in how.of if key in ask and key not in never]
    heights = [float(part.value(run)) for part in parts]
    best = how.pick(heights) if parts else 0
    if how.event and not (parts and parts[best].happens(run)):
        raise ValueError(f"'{response}' has no slopes: it does not happen within {t_end:g} s")
    return parts[best], how.chain(heights[best])


def _at(name: str, row: Mapping[str, Any], parameter: str) -> Callable[[float], TreeSystem]:
    return cache(lambda value: system(case_of(name, {**row, parameter: value})))
