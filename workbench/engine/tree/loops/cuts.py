"""Cut joints: what closes a loop of a tree, as conditions between two of its bodies; SI units."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np

from ...errors import InvalidSystem
from .._kernels.cuts import DISTANCE, POINT, TURN

__all__ = ["CUTS", "CutJoint", "CutRows", "cut_rows", "resolved_cut"]

Array = np.ndarray[Any, Any]
Triple = tuple[float, float, float]
ZERO: Triple = (0.0, 0.0, 0.0)
GROUND = "ground"
Kind = Literal["spherical", "revolute", "universal", "cylindrical", "distance"]

# conditions per kind, the axis of b along z: (kind of row, its direction on b)
CUTS: dict[str, tuple[tuple[int, str], ...]] = {
    "spherical": ((POINT, "x"), (POINT, "y"), (POINT, "z")),
    "revolute": ((POINT, "x"), (POINT, "y"), (POINT, "z"), (TURN, "x"), (TURN, "y")),
    "universal": ((POINT, "x"), (POINT, "y"), (POINT, "z"), (TURN, "z")),
    "cylindrical": ((POINT, "x"), (POINT, "y"), (TURN, "x"), (TURN, "y")),
    "distance": ((DISTANCE, "z"),),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class CutJoint:
    """A joint between two bodies that both hang elsewhere already: it closes a loop by conditions.

    kind: "spherical" (the points coincide), "revolute" (and the axes are parallel), "universal" (the points
    coincide and the axes are perpendicular), "cylindrical" (one axis in common), "distance" (the points stay
    `length` apart, a massless rod between two balls).
    point_a, axis_a: in a's frame; point_b, axis_b: in b's.
    axis_b: None for where axis_a points at the start.  length: m, None for the distance at the start.

    >>> CutJoint(a="coupler", b="rocker", point_a=(2.0, 0.0, 0.0), kind="revolute").label
    'coupler-rocker'
    """

    a: str
    b: str = GROUND
    point_a: Triple = ZERO
    point_b: Triple = ZERO
    kind: Kind
    axis_a: Triple = (0.0, 0.0, 1.0)
    axis_b: Triple | None = None
    length: float | None = None
    name: str = ""

    def __post_init__(self) -> None:
        where = f"cut joint '{self.label}'"
        if self.kind not in CUTS:
            raise InvalidSystem(f"{where} needs a kind of {', '.join(CUTS)}, got '{self.kind}'")
        if self.a == self.b:
            raise InvalidSystem(f"{where} joins body '{self.a}' to itself")
        for axis in (self.axis_a, self.axis_b):
            if axis is not None and np.linalg.norm(axis) == 0.0:
                raise InvalidSystem(f"{where} needs an axis, got {axis}")
        if self.kind == "universal" and self.axis_b is None:
            raise InvalidSystem(f"{where} needs axis_b, perpendicular to axis_a")
        if self.length is not None and self.length <= 0.0:
            raise InvalidSystem(f"{where} needs length > 0 m, got length={self.length}")

    @property
    def label(self) -> str:
        """Its name, or those of its bodies."""
        return self.name or f"{self.a}-{self.b}"


class CutRows(NamedTuple):
    """Conditions of all cut joints."""

    table: Array  # (m, 2) pair, kind
    place: Array  # (m, 10) as in `TreeTables.cut_place`
    joint: Array  # (m,) number of the cut joint
    names: tuple[str, ...]


def resolved_cut(cut: CutJoint, frames: dict[str, tuple[Array, Array]]) -> CutJoint:
    """The cut joint with axis and length as numbers, from axes and origins of the bodies at the start."""
    (turn_a, at_a), (turn_b, at_b) = frames[cut.a], frames[cut.b]
    if cut.axis_b is None:
        x, y, z = (float(e) for e in turn_b.T @ turn_a @ np.asarray(cut.axis_a, float))
        cut = replace(cut, axis_b=(x, y, z))
    if cut.kind == "distance" and cut.length is None:
        apart = (
            at_a + turn_a @ np.asarray(cut.point_a, float) - at_b - turn_b @ np.asarray(cut.point_b, float)
        )
        cut = replace(cut, length=float(np.linalg.norm(apart)))
    return cut


def cut_rows(
    cuts: Sequence[CutJoint], places: dict[str, Any], pair_of: Callable[[int, int, str], int]
) -> CutRows:
    """The conditions of resolved cut joints.

    places: a link, rotation and position per body (`Place`).
    pair_of(link a, link b, where): a pair's number.
    """
    table: list[tuple[int, int]] = []
    place: list[Array] = []
    joint: list[int] = []
    names: list[str] = []
    for i, cut in enumerate(cuts):
        a, b = places[cut.a], places[cut.b]
        pair = pair_of(a.link, b.link, f"cut joint '{cut.label}'")
        axes = {name: b.turn @ column for name, column in zip("xyz", _frame(cut.axis_b), strict=True)}
        turned = a.turn @ _unit(cut.axis_a)
        point_a = a.at + a.turn @ np.asarray(cut.point_a, float)
        point_b = b.at + b.turn @ np.asarray(cut.point_b, float)
        for kind, along in CUTS[cut.kind]:
            table.append((pair, kind))
            place.append(
                np.concatenate(
                    [turned if kind == TURN else point_a, point_b, axes[along], [cut.length or 0.0]]
                )
            )
            joint.append(i)
            what = {POINT: "place", TURN: "turn", DISTANCE: "length"}[kind]
            names.append(
                f"{what} of cut joint '{cut.label}'" + ("" if kind == DISTANCE else f" along {along}")
            )
    return CutRows(
        np.array(table, np.int64).reshape(-1, 2), np.array(place).reshape(-1, 10), np.array(joint, np.int64),
        tuple(names),
    )  # fmt: skip


def _unit(axis: Any) -> Array:
    given = np.asarray(axis, float)
    return np.asarray(given / np.linalg.norm(given))


def _frame(axis: Any) -> Array:
    """(3, 3) two perpendiculars of an axis and itself, as rows; they follow it smoothly."""
    z = _unit(axis)
    x = _unit(np.cross(np.eye(3)[int(np.abs(z).argmin())], z))
    return np.array([x, np.cross(z, x), z])
