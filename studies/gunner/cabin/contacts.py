"""Level L1: the hatch ring, the cabin and a seat shelf that touch the gunner, in place of the hanging seat.

Balls along his segments meet the ring, floor, walls and roof of the cabin; two more under the hips rest on
the shelf. All contacts are smooth: penetration to the power 3/2 with the damping of Hunt and Crossley, and
friction that builds up over a slow speed. Nothing of the vehicle's outside touches him, nor does the ground.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Annotated

import numpy as np

from workbench.engine import (
    Box,
    Capsule,
    Prescribed,
    Ring,
    Shape,
    SpatialBody,
    SpatialContact,
    SpatialMotion,
)

from ..figure import SIDES, pieces
from ..figure_numbers import Numbers
from ..manoeuvre import constant, smooth_step
from ..parameters import FILE, Number, read
from ..parts import GRAVITY, Parts, Triple, triple

__all__ = ["SHELF", "CabinNumbers", "balls", "cabin", "cabin_numbers", "shapes"]

SHELF = "shelf"  # the body
SINKS, WITHIN = 1.2, 0.1  # m, s: how a shelf that is let go drops out of his way
TRUNK = (0.25, 0.75)  # shares of a segment where its balls sit
# body: the joint at its far end, and where along it balls sit; a knee and an elbow belong to two segments
ALONG: tuple[tuple[str, str, tuple[float, ...]], ...] = (
    ("lower torso", "central torso", TRUNK), ("central torso", "upper torso", TRUNK),
    ("upper torso", "neck", TRUNK),
    *((f"{side} {of}", f"{side} {next_}", shares) for side in SIDES for of, next_, shares in (
        ("upper arm", "forearm", (0.5, 1.0)), ("forearm", "hand", (0.5,)),
        ("thigh", "shank", (0.33, 0.67)), ("shank", "foot", (0.0, 0.5)),
    )),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Cabin:
    """The ring of the hatch and the plates of a closed cabin; places in the vehicle's frame."""

    hatch: Annotated[Triple, Number("m", count=3)]
    ring_radius: Annotated[float, Number("m", positive=True)]
    ring_tube: Annotated[float, Number("m", positive=True)]
    floor: Annotated[float, Number("m")]
    roof: Annotated[float, Number("m")]
    front: Annotated[float, Number("m")]
    rear: Annotated[float, Number("m")]
    half_width: Annotated[float, Number("m", positive=True)]
    plate: Annotated[float, Number("m", positive=True)]
    rounding: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Shelf:
    """A seat that only pushes: a plate under two balls beside the middle of the hips."""

    half: Annotated[Triple, Number("m", positive=True, count=3)]
    apart: Annotated[float, Number("m", positive=True)]
    stiffness: Annotated[float, Number("N/m", positive=True)]
    damping: Annotated[float, Number("s/m", least=0.0)]
    friction: Annotated[float, Number("1", least=0.0)]
    slow: Annotated[float, Number("m/s", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Skin:
    """Radii of the balls, and how they yield."""

    head: Annotated[float, Number("m", positive=True)]
    trunk: Annotated[float, Number("m", positive=True)]
    arm: Annotated[float, Number("m", positive=True)]
    leg: Annotated[float, Number("m", positive=True)]
    foot: Annotated[float, Number("m", positive=True)]
    sole: Annotated[float, Number("m", positive=True)]
    stiffness: Annotated[float, Number("N/m^1.5", positive=True)]
    damping: Annotated[float, Number("s/m", least=0.0)]
    friction: Annotated[float, Number("1", least=0.0)]
    slow: Annotated[float, Number("m/s", positive=True)]
    width: Annotated[float, Number("m", positive=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class CabinNumbers:
    """All numbers of level L1."""

    cabin: Cabin
    shelf: Shelf
    skin: Skin


@dataclass(frozen=True, slots=True, kw_only=True)
class Ball:
    """A ball on a body, its centre in the body's frame, m."""

    body: str
    at: Triple
    radius: float


@cache
def cabin_numbers(path: Path | str = FILE) -> CabinNumbers:
    """The tables [gunner.cabin], [gunner.shelf], [gunner.skin] of a file; raises InvalidNumber."""
    return CabinNumbers(
        cabin=read(Cabin, "gunner.cabin", path), shelf=read(Shelf, "gunner.shelf", path),
        skin=read(Skin, "gunner.skin", path),
    )  # fmt: skip


def balls(numbers: Numbers, skin: Skin) -> tuple[Ball, ...]:
    """What of the gunner may touch the cabin: 25 balls; the hands are left to their bars."""
    body = pieces(numbers)
    found = [Ball(body="head", at=triple(body["head"].centre), radius=skin.head)]
    for name, far, shares in ALONG:
        reach = body[far].at - body[name].at
        limb = name.split(" ")[-1]
        radius = {"torso": skin.trunk, "arm": skin.arm, "forearm": skin.arm}.get(limb, skin.leg)
        found += [Ball(body=name, at=triple(share * reach), radius=radius) for share in shares]
    down = skin.foot - skin.sole  # of the balls' centres from the ankle
    for side in SIDES:
        for ahead in (0.0, 0.6 * numbers.figure.foot.length):  # heel and toes
            found.append(Ball(body=f"{side} foot", at=(ahead, 0.0, down), radius=skin.foot))
    return tuple(found)


def shapes(cabin: Cabin) -> tuple[Shape, ...]:
    """Ring, floor, four walls, and a roof of four plates and four bars around the hatch."""
    x, y, z = cabin.hatch
    r, t, half = cabin.ring_radius, cabin.plate, cabin.half_width
    middle, long = 0.5 * (cabin.front + cabin.rear), 0.5 * (cabin.front - cabin.rear)
    height = 0.5 * (cabin.roof - cabin.floor)
    level = cabin.floor + height

    def plate(centre: Triple, size: Triple) -> Box:
        return Box(centre=centre, half=size, rounding=cabin.rounding)

    def between(a: float, b: float, low: float, high: float) -> Box:
        """A plate of the roof over a < x < b, low < y < high."""
        centre = (0.5 * (a + b), 0.5 * (low + high), cabin.roof + t)
        return plate(centre, (0.5 * (b - a), 0.5 * (high - low), t))

    corner = 0.4 * r  # the bars cut the corners that a square hole leaves outside the ring
    bars = tuple(
        Capsule(
            start=(x + i * r, y + j * corner, cabin.roof + t),
            end=(x + i * corner, y + j * r, cabin.roof + t),
            radius=t,
        )
        for i in (1.0, -1.0)
        for j in (1.0, -1.0)
    )
    return (
        Ring(centre=(x, y, z), radius=r, tube=cabin.ring_tube),
        plate((middle, 0.0, cabin.floor - t), (long, half, t)),
        *(plate((middle, side * (half + t), level), (long, t, height)) for side in (1.0, -1.0)),
        plate((cabin.front + t, 0.0, level), (t, half, height)),
        plate((cabin.rear - t, 0.0, level), (t, half, height)),
        between(x + r, cabin.front, -half, half), between(cabin.rear, x - r, -half, half),
        between(x - r, x + r, y + r, half), between(x - r, x + r, -half, y - r),
        *bars,
    )  # fmt: skip


def cabin(
    numbers: Numbers, given: CabinNumbers, borne: Mapping[str, Triple], *, drops_at: float | None = None,
    vehicle: str = "vehicle",
) -> Parts:  # fmt: skip
    """Contacts of the gunner with the cabin, and the shelf that carries him where he sits.

    borne: what carries him at rest and where, see `figure.supports`: the shelf, or his feet on the floor.
    drops_at: s, when the shelf is let go; None: never.
    """
    skin = given.skin
    walls = tuple(
        SpatialContact(
            a=ball.body, b=vehicle, point=ball.at, radius=ball.radius, shape=shape, k=skin.stiffness,
            damping=skin.damping, width=skin.width, friction=skin.friction, slow=skin.slow,
        )
        for ball in standing(numbers, given, borne) for shape in shapes(given.cabin)
    )  # fmt: skip
    if "lower torso" not in borne:
        return Parts(contacts=walls)
    seat, shelf = borne["lower torso"], given.shelf
    sunk = 0.5 * numbers.figure.mass * GRAVITY / shelf.stiffness
    top = np.asarray(numbers.posture.hip) + seat + (0.0, 0.0, sunk - skin.trunk)
    plate = Box(centre=(0.0, 0.0, -shelf.half[2]), half=shelf.half, rounding=0.9 * shelf.half[2])
    carried = tuple(
        SpatialContact(
            a="lower torso", b=SHELF, point=triple(np.add(seat, (0.0, side * shelf.apart, 0.0))),
            radius=skin.trunk, shape=plate, k=shelf.stiffness, power=1.0, damping=shelf.damping,
            width=skin.width, friction=shelf.friction, slow=shelf.slow,
        )
        for side in SIDES.values()
    )  # fmt: skip
    # driven, not welded: so it may lie askew
    joint = Prescribed(motion=dropped(drops_at))
    body = SpatialBody(name=SHELF, parent=vehicle, at=triple(top), joint=joint)
    return Parts(bodies=(body,), contacts=walls + carried)


def standing(numbers: Numbers, given: CabinNumbers, borne: Mapping[str, Triple]) -> tuple[Ball, ...]:
    """The balls; those under feet that carry him press on the floor as his weight asks.

    Raises ValueError where his mass centre is not above his feet.
    """
    skin, body = given.skin, pieces(numbers)
    found = []
    for ball in balls(numbers, skin):
        if ball.body in borne and ball.body.endswith("foot"):
            toes = 0.6 * numbers.figure.foot.length
            share = borne[ball.body][0] / toes
            if not 0.0 < share < 1.0:
                raise ValueError(
                    f"a standing gunner needs his mass centre above his feet, 0 to {toes:.3f} m ahead of the "
                    f"ankles, got {borne[ball.body][0]:.3f} m; change the hip of [gunner.standing]"
                )
            force = (share if ball.at[0] > 0.0 else 1.0 - share) * numbers.figure.mass * GRAVITY / len(borne)
            depth = (force / skin.stiffness) ** (2.0 / 3.0)
            above = given.cabin.floor - numbers.posture.hip[2] - float(body[ball.body].at[2])
            found.append(replace(ball, at=(*ball.at[:2], above + skin.foot - depth)))
        else:
            found.append(ball)
    return tuple(found)


def dropped(at: float | None) -> SpatialMotion:
    """At rest, then down out of the way from a time on."""
    fall = constant(0.0) if at is None else smooth_step(start=at, duration=WITHIN, height=-SINKS)
    return SpatialMotion(position=lambda t: (0.0, 0.0, fall(t)))
