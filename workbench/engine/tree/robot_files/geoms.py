"""Mass, centre and inertia of the primitive shapes of MJCF, solid and of one density."""

from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...errors import InvalidSystem, NotSupported
from .xml_text import number, numbers

__all__ = ["Solid", "geom_solid", "together"]

Array = np.ndarray[Any, Any]
WATER = 1000.0  # kg/m^3, the format's default
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}


@dataclass(frozen=True, slots=True, kw_only=True)
class Solid:
    """mass kg; centre (3,) m; inertia (3, 3) about the centre, kg m^2; in the axes of the body."""

    mass: float
    centre: Array
    inertia: Array


def geom_solid(given: dict[str, str], place: tuple[Array, Array], where: str) -> Solid | None:
    """The solid of a geom with these attributes at place (axes, origin); None for one without volume."""
    kind = given.get("type", "sphere")
    if kind in ("plane", "hfield"):
        return None
    if kind not in SIZES:
        raise NotSupported(
            f"{where} is a {kind}: its mass needs the shape itself; give its body an <inertial>, or "
            f"use {', '.join(SIZES)}"
        )
    volume, per_mass = _unit_solid(kind, _size(given, kind, where))
    read = ElementTree.Element("geom", given)
    mass = number(read, "mass", volume * number(read, "density", WATER, where), where)
    if mass < 0.0:
        raise InvalidSystem(f"{where} needs a mass >= 0, got {mass:g} kg")
    axes, centre = place
    return Solid(mass=mass, centre=centre, inertia=axes @ np.diag(mass * per_mass) @ axes.T)


def _size(given: dict[str, str], kind: str, where: str) -> Array:
    """Half sizes; with `fromto` the half length is half the distance of its ends."""
    size = numbers(ElementTree.Element("geom", given), "size", None, where)
    if "fromto" in given and kind in ("capsule", "cylinder", "box", "ellipsoid"):
        ends = numbers(ElementTree.Element("geom", given), "fromto", (0.0,) * 6, where)
        half = 0.5 * float(np.linalg.norm(ends[3:] - ends[:3]))
        size = np.array([size[0], half] if kind in ("capsule", "cylinder") else [size[0], size[0], half])
    if len(size) < SIZES[kind] or (size[: SIZES[kind]] <= 0.0).any():
        raise InvalidSystem(f"{where}, a {kind}, needs {SIZES[kind]} sizes > 0, got {size.tolist()}")
    return size[: SIZES[kind]]


def _unit_solid(kind: str, size: Array) -> tuple[float, Array]:
    """Volume, and principal inertias over the mass; the axis of revolution is z."""
    if kind == "sphere":
        (r,) = size
        return 4.0 / 3.0 * np.pi * r**3, np.full(3, 0.4 * r**2)
    if kind == "ellipsoid":
        squares = size**2
        return 4.0 / 3.0 * np.pi * float(np.prod(size)), (squares.sum() - squares) / 5.0
    if kind == "box":
        squares = size**2
        return 8.0 * float(np.prod(size)), (squares.sum() - squares) / 3.0
    r, half = size
    tube = np.pi * r**2 * 2.0 * half
    across = (3.0 * r**2 + 4.0 * half**2) / 12.0
    if kind == "cylinder":
        return tube, np.array([across, across, 0.5 * r**2])
    # a capsule: the tube and two half balls, their centres 3/8 r beyond its ends
    balls = 4.0 / 3.0 * np.pi * r**3
    share = np.array([tube, balls]) / (tube + balls)
    ball = 0.4 * r**2 + half**2 + 0.75 * r * half
    side = share @ [across, ball]
    return tube + balls, np.array([side, side, share @ [0.5 * r**2, 0.4 * r**2]])


def together(solids: list[Solid]) -> Solid:
    """One rigid solid of several (parallel axes)."""
    mass = sum(solid.mass for solid in solids)
    if not mass:
        return Solid(mass=0.0, centre=np.zeros(3), inertia=np.zeros((3, 3)))
    centre = sum((solid.mass * solid.centre for solid in solids), np.zeros(3)) / mass
    inertia = np.zeros((3, 3))
    for solid in solids:
        off = solid.centre - centre
        inertia += solid.inertia + solid.mass * (off @ off * np.eye(3) - np.outer(off, off))
    return Solid(mass=mass, centre=centre, inertia=inertia)
