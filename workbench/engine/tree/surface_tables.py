"""The tables of contacts and tyres, from their records."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .surfaces import Box, Capsule, Plane, Ring, Shape, SpatialContact, Sphere, Tyre

__all__ = ["surface_tables"]

Array = np.ndarray[Any, Any]
TYRE = 9


def surface_tables(
    contacts: tuple[SpatialContact, ...],
    tyres: tuple[Tyre, ...],
    places: dict[str, Any],
    pair_of: Callable[[int, int, str], int],
    first_state: int,
) -> tuple[dict[str, Array], tuple[str, ...]]:
    """`surface`, `surface_law`, `surface_shape` of the tables, and the names of the tyres' states.

    places: a link, rotation and position per body (`compiled.Place`).
    pair_of(link a, link b, where): the number of a pair.
    """
    rows: list[tuple[int, int, int]] = []
    laws: list[list[float]] = []
    shapes: list[list[float]] = []
    states: list[str] = []
    for i, contact in enumerate(contacts):
        a, b = places[contact.a], places[contact.b]
        kind, numbers = carried(contact.shape, b.turn, b.at).numbers()
        rows.append((pair_of(a.link, b.link, f"contacts[{i}]"), -1, kind))
        point = a.at + a.turn @ np.asarray(contact.point, float)
        laws.append([
            contact.k, contact.power, contact.damping, contact.width, contact.friction, contact.slow, *point,
            contact.radius, *np.zeros(21),
        ])  # fmt: skip
        shapes.append(list(numbers))
    for i, tyre in enumerate(tyres):
        place = places[tyre.body]
        axis = tuple(float(x) for x in place.turn @ np.asarray(tyre.axis, float))
        rows.append((pair_of(place.link, -1, f"tyres[{i}]"), first_state + len(states), TYRE))
        laws.append(list(replace(tyre, axis=(axis[0], axis[1], axis[2])).numbers()))
        shapes.append(list(tyre.road.numbers()))
        states += [f"longitudinal slip of '{tyre.body}'", f"lateral slip of '{tyre.body}'"]
    width = max((len(shape) for shape in shapes), default=0)
    width = max(width, 11)  # further waves of roads stand behind
    shapes = [[*shape, *np.zeros(width - len(shape))] for shape in shapes]
    table = np.array(rows, np.int64).reshape(-1, 3)
    return {
        "surface": table, "contact": np.flatnonzero(table[:, 2] != TYRE),
        "tyre": np.flatnonzero(table[:, 2] == TYRE), "surface_law": np.array(laws).reshape(-1, 31),
        "surface_shape": np.array(shapes).reshape(-1, width),
    }, tuple(states)  # fmt: skip


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
