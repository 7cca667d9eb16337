"""The tables of contacts, tyres and struts, from their records."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..elements._kernels_called_states import CONSTANTS, WIDTH
from ._kernels.members import NEAR
from ._kernels.surfaces import STRUT, TYRE
from .elements import SpatialStrut
from .start import start_frames
from .surfaces import Box, Capsule, Plane, Ring, Shape, Sphere

__all__ = ["surface_tables"]

Array = np.ndarray[Any, Any]


def surface_tables(
    system: Any,
    places: dict[str, Any],
    pair_of: Callable[[int, int, str], int],
    first_state: int,
) -> tuple[dict[str, Array], tuple[str, ...], tuple[float, ...]]:
    """`surface`, `surface_law`, `surface_shape` of the tables, names of the states of tyres and struts, and
    their values at the start.

    places: a link, rotation and position per body (`compiled.Place`).
    pair_of(link a, link b, where): the number of a pair.
    """
    rows: list[tuple[int, int, int, int]] = []
    laws: list[list[float]] = []
    shapes: list[list[float]] = []
    states: list[str] = []
    starts: list[float] = []
    for i, contact in enumerate(system.contacts):
        a, b = places[contact.a], places[contact.b]
        kind, numbers = carried(contact.shape, b.turn, b.at).numbers()
        rows.append((pair_of(a.link, b.link, f"contacts[{i}]"), -1, kind, 0))
        point = a.at + a.turn @ np.asarray(contact.point, float)
        laws.append([
            contact.k, contact.power, contact.damping, contact.width, contact.friction, contact.slow, *point,
            contact.radius, *np.zeros(21),
        ])  # fmt: skip
        shapes.append(list(numbers))
    for i, tyre in enumerate(system.tyres):
        place = places[tyre.body]
        axis = tuple(float(x) for x in place.turn @ np.asarray(tyre.axis, float))
        rows.append((pair_of(place.link, -1, f"tyres[{i}]"), first_state + len(states), TYRE, 2))
        laws.append(list(replace(tyre, axis=(axis[0], axis[1], axis[2])).numbers()))
        shapes.append(list(tyre.road.numbers()))
        states += [f"longitudinal slip of '{tyre.body}'", f"lateral slip of '{tyre.body}'"]
        starts += [0.0, 0.0]
    for i, strut in enumerate(system.struts):
        a, b, points = places[strut.a], places[strut.b], (strut.point_a, strut.point_b)
        ends = [place.at + place.turn @ np.asarray(x, float) for place, x in zip((a, b), points, strict=True)]
        if a.link < b.link:  # the ground, -1, stands second
            a, b, ends = b, a, ends[::-1]
        own = strut.law.states
        rows.append((pair_of(a.link, b.link, f"struts[{i}]"), first_state + len(states), STRUT, len(own)))
        constants = [*strut.law.constants.values(), *np.zeros(WIDTH - CONSTANTS - len(strut.law.constants))]
        laws.append([*strut.law.addresses(), *ends[0], *ends[1], _natural_length(system, strut), *constants])
        shapes.append([])
        starts += own.values()
        states += [f"{name} of strut '{strut.called}'" for name in own]
    width = max((len(shape) for shape in shapes), default=0)
    width = max(width, 11)  # further waves of roads stand behind
    shapes = [[*shape, *np.zeros(width - len(shape))] for shape in shapes]
    table = np.array(rows, np.int64).reshape(-1, 4)
    return {
        "surface": table, "contact": np.flatnonzero(table[:, 2] < TYRE),
        "tyre": np.flatnonzero(table[:, 2] == TYRE), "strut": np.flatnonzero(table[:, 2] == STRUT),
        "surface_law": np.array(laws).reshape(-1, WIDTH),
        "surface_shape": np.array(shapes).reshape(-1, width),
    }, tuple(states), tuple(starts)  # fmt: skip


def _natural_length(system: Any, strut: SpatialStrut) -> float:
    """As given, or as long as it is at the start, as the kernel measures it."""
    if strut.natural_length is not None:
        return strut.natural_length
    frames = start_frames(system.bodies)
    ends = [
        frames[body][1] + frames[body][0] @ np.asarray(point, float)
        for body, point in ((strut.a, strut.point_a), (strut.b, strut.point_b))
    ]
    return float(np.sqrt(((ends[0] - ends[1]) ** 2).sum() + NEAR))


def carried(shape: Shape, turn: Array, at: Array) -> Shape:
    """A shape given in a frame, in the frame that carries it (rotation, position)."""

    def point(x: Any) -> tuple[float, float, float]:
        a, b, c = (float(e) for e in at + turn @ np.asarray(x, float))
        return a, b, c

    def direction(x: Any) -> tuple[float, float, float]:
        a, b, c = (float(e) for e in turn @ np.asarray(x, float))
        return a, b, c

    match shape:
        case Plane():
            normal = direction(shape.normal)
            size = float(np.linalg.norm(normal))
            return replace(shape, normal=normal, offset=shape.offset + float(np.dot(normal, at)) / size)
        case Sphere():
            return replace(shape, centre=point(shape.centre))
        case Capsule():
            return replace(shape, start=point(shape.start), end=point(shape.end))
        case Ring():
            return replace(shape, centre=point(shape.centre), axis=direction(shape.axis))
        case Box():
            if not np.allclose(turn, np.eye(3)):
                raise ValueError("a box cannot lie on a body that is welded on at an angle; name its carrier")
            return replace(shape, centre=point(shape.centre))
