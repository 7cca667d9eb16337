"""One uncertain case of the gunner, and the system it makes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

from workbench.engine import (
    Floating,
    NotConverged,
    SpatialBody,
    SpatialMotion,
    TreeSystem,
    equilibrium,
    restarted,
    simulate,
)

from .cab import driven_cab, straight
from .cabin.contacts import cabin, cabin_numbers
from .cabin.facing import faced, turned
from .figure import Start, centre_of_mass, figure, supports
from .figure_numbers import Numbers, figure_numbers
from .holds import holds
from .parameters import FILE, read
from .parts import Parts, joined, triple
from .proving_grounds import ProvingGround, braking
from .vehicle.assembly import vehicle
from .vehicle.numbers import Payload, VehicleParameters

__all__ = ["LEVELS", "Case", "carrier", "gunner", "numbers_of", "system"]


LEVELS = ("L0", "L1")
SINKING = 4.0  # s
NO_REST = (
    "a settled gunner sinks through his seat: start='settled' needs elbows, hips and a seat that carry him; "
    "take start='balanced'"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A point of the uncertainty and a choice of the model.

    on: a proving ground, over which the vehicle drives, or the motion of a driven cab (`cab`).
    grip: strength of a hand, N.  hands: "none", "one" (the right) or "both".
    factors: of the stiffness of the joints of Table 8.6, both sides.
    seat_rate N/m, seat_damping N s/m, seat_cap N, mass kg: None for those of the file.
    posture: "seated", that of Table 8.1, or "standing" on the floor of the cabin.
    facing: deg from forward to the left, figure, bars and seat together about the hatch: 90 is the left side.
    level: "L0", grips and a hanging seat; "L1", grips, a shelf that only pushes, and the cabin.
    shelf_drops_at: s, when the shelf of L1 is let go; None: never.
    start: "balanced", in the posture at rest; "torque-free", in the posture, from which he sinks; "settled",
        the same once he has sunk onto seat and hands.
    joint_unit: how Table 8.6 is read, "N.mm/rad" or "N.m/rad".
    file, figure: parameter files; the second replaces the table [gunner.figure], as `hybrid3.toml`.
    """

    on: ProvingGround | SpatialMotion = field(default_factory=braking)
    grip: float = 500.0
    hands: str = "both"
    factors: Mapping[str, float] = field(default_factory=dict)
    seat_rate: float | None = None
    seat_damping: float | None = None
    seat_cap: float | None = None
    mass: float | None = None
    posture: str = "seated"
    facing: float = 0.0
    level: Literal["L0", "L1"] = "L0"
    shelf_drops_at: float | None = None
    start: Start = "balanced"
    joint_unit: str = "N.mm/rad"
    file: Path | str = FILE
    figure: Path | str | None = None


def numbers_of(case: Case) -> Numbers:
    """The gunner's numbers in a case."""
    numbers = figure_numbers(case.file, case.figure, case.posture)
    return numbers if case.mass is None else replace(numbers, figure=numbers.figure.of_mass(case.mass))


def gunner(case: Case) -> Parts:
    """The gunner in a case: the parts that hang on the body "vehicle"; raises ValueError for no case."""
    if case.level not in LEVELS:
        raise ValueError(f"level needs one of {', '.join(LEVELS)}, got '{case.level}'")
    if case.shelf_drops_at is not None and case.level != "L1":
        raise ValueError("shelf_drops_at needs level='L1': the hanging seat of L0 lets go by itself")
    numbers = numbers_of(case)
    velocity = (
        triple(case.on.sample(0.0)[15:18])
        if isinstance(case.on, SpatialMotion)
        else (case.on.manoeuvre.speed, case.on.manoeuvre.drift, 0.0)
    )
    man = figure(
        numbers, start=case.start, factors=dict(case.factors), joint_unit=case.joint_unit, velocity=velocity
    )
    bushings = holds(
        numbers, start=case.start, grip=case.grip, hands=case.hands, seat_rate=case.seat_rate,
        seat_damping=case.seat_damping, seat_cap=case.seat_cap,
    )  # fmt: skip
    held = replace(man, bushings=bushings)
    if case.level == "L1":
        around = cabin(
            numbers, cabin_numbers(case.file), supports(numbers, case.start), drops_at=case.shelf_drops_at
        )
        # without hold they only tell when he has left his place
        loose = (*bushings[:2], *(replace(b, hold=0.0) for b in bushings[2:]))
        held = replace(man, bodies=man.bodies + around.bodies, bushings=loose, contacts=around.contacts)
    if case.facing != 0.0:
        held = turned(held, case.facing)
    return replace(held, bodies=_at_rest(held, velocity)) if case.start == "settled" else held


def _at_rest(held: Parts, velocity: tuple[float, float, float]) -> tuple[SpatialBody, ...]:
    """The bodies where seat and hands carry the figure in a cab that stands, moving on with it.

    Raises ValueError where the seat lets go before he rests.
    """
    still, seat = joined(driven_cab(straight(0.0)), held), held.bushings[-1]
    try:
        found = equilibrium(still, np.zeros(0)).system
    except NotConverged:
        # soft joints fold far: let him sink before the balance is looked for
        sunk = simulate(still, np.zeros(0), SINKING, round(SINKING / 2e-3))
        try:
            found = equilibrium(restarted(still, sunk.position[-1]), np.zeros(0)).system
        except NotConverged:
            raise ValueError(NO_REST) from None
    bodies = []
    for body, before in zip(found.bodies, still.bodies, strict=True):
        if isinstance(body.joint, Floating) and isinstance(before.joint, Floating):
            sinks = np.linalg.norm(np.subtract(body.joint.position, before.joint.position))
            if seat.release is not None and sinks > seat.release:
                raise ValueError(NO_REST)
            bodies.append(replace(body, joint=replace(body.joint, velocity=velocity)))
        elif body.name != "vehicle":
            bodies.append(body)
    return tuple(bodies)


@cache
def vehicle_numbers(path: Path | str) -> VehicleParameters:
    """The tables [vehicle. ...] of a file."""
    return read(VehicleParameters, "vehicle", path)


def carrier(case: Case) -> Parts:
    """What carries the gunner: the vehicle with his weight on its springs, or a driven cab."""
    if isinstance(case.on, SpatialMotion):
        return driven_cab(case.on)
    numbers = numbers_of(case)
    at = faced(centre_of_mass(numbers) + numbers.posture.hip, case.facing)
    return vehicle(
        vehicle_numbers(case.file), case.on.ground, case.on.manoeuvre,
        payload=(Payload(mass=numbers.figure.mass, at=at),),
    )  # fmt: skip


def system(case: Case | None = None) -> TreeSystem:
    """The gunner on what carries him; raises ValueError for a case that is none."""
    case = Case() if case is None else case
    return joined(carrier(case), gunner(case))
