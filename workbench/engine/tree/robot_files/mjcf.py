"""Reading the part of MJCF, MuJoCo's format, that a tree can hold.

Bodies, inertias given or of primitive geoms, joints (free, ball, hinge, slide, several on one body), ranges,
stiffness and damping of joints, gravity, classes of defaults. A body without joint is welded to its parent.
Angles are degrees unless `compiler angle="radian"`. https://mujoco.readthedocs.io/en/stable/XMLreference.html
"""

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...errors import InvalidSystem, NotSupported
from ..elements import CoordinateSpring, SphericalSpring
from ..joints import ZERO, Floating, Joint, Prismatic, Revolute, Spherical, Welded
from ..system import GROUND, UNIT, SpatialBody, TreeSystem
from .geoms import Solid, geom_solid, together
from .mjcf_settings import Settings, settings_of
from .record import Range, RobotFile, range_stops
from .xml_text import Element, listed, number, numbers, parsed

__all__ = ["read_mjcf"]

Array = np.ndarray[Any, Any]
HEAD = {"compiler", "option", "default", "worldbody", "size", "statistic", "visual", "asset", "custom"}
CHANGES_NO_MOTION = {"site", "camera", "light", "sensor", "keyframe", "visual", "asset"}
LEFT_OUT = {
    "armature": "armature of a joint (inertia of a rotor)",
    "frictionloss": "dry friction of a joint",
}


def read_mjcf(path: str | Path, *, stop_stiffness: float | None = None) -> RobotFile:
    """A tree from an MJCF file, at the pose in which the file declares it.

    Args:
        stop_stiffness: soft stops at the ends of the ranges of hinges and slides, N m/rad or N/m; None: none.

    Raises:
        InvalidSystem: the file is missing, is no MJCF, or a body or joint lacks what it needs.
        NotSupported: it includes other files or replicates parts, has global coordinates, or a body without
            <inertial> has a geom whose mass needs a mesh.

    >>> print(read_mjcf("arm.xml"))                                                # doctest: +SKIP
    2 bodies, 2 velocities
    upper: -1.571 to 1.571 rad (-90 to 90 deg)
    """
    root = parsed(path, "mujoco")
    for tag in ("include", "replicate", "frame", "composite", "flexcomp", "attach"):
        if root.find(f".//{tag}") is not None:
            raise NotSupported(
                f"{path} has <{tag}>, which is not read; save the model from MuJoCo as one plain file first"
            )
    reading = _Reading(settings=settings_of(root, str(path)), path=str(path))
    for element in root:
        if element.tag not in HEAD | CHANGES_NO_MOTION:
            reading.left_out[element.tag] += max(1, len(element))
    for world in root.findall("worldbody"):
        for element in world.findall("body"):
            reading.body(element, GROUND, np.zeros(3), "main")
    if stop_stiffness is None:
        reading.left_out["range without stops (see stop_stiffness)"] += len(reading.ranges)
    else:
        joints = ((body.name, body.joint) for body in reading.bodies)
        reading.springs += range_stops(reading.ranges, joints, stop_stiffness)
    system = TreeSystem(
        bodies=tuple(reading.bodies), springs=tuple(reading.springs), gravity=reading.settings.gravity,
        spherical_springs=tuple(reading.ball_springs),
    )  # fmt: skip
    return RobotFile(system=system, ranges=reading.ranges, left_out=listed(reading.left_out))


@dataclass(slots=True)
class _Reading:
    """The file as far as it was read."""

    settings: Settings
    path: str
    bodies: list[SpatialBody] = field(default_factory=list)
    springs: list[CoordinateSpring] = field(default_factory=list)
    ball_springs: list[SphericalSpring] = field(default_factory=list)
    ranges: dict[str, Range] = field(default_factory=dict)
    left_out: Counter[str] = field(default_factory=Counter)

    def body(self, element: Element, parent: str, parent_origin: Array, around: str) -> None:
        """A body and all on it. parent_origin: of the parent's element in the frame of our parent body."""
        around = element.get("childclass", around)
        name = element.get("name") or f"body {len(self.bodies) + 1}"
        where = f"{self.path}: body '{name}'"
        axes = self.settings.turn(element.attrib, where)
        at = parent_origin + numbers(element, "pos", ZERO, where)
        joints: list[Element | None] = [x for x in element if x.tag in ("joint", "freejoint")]
        joints = joints or [None]
        solid = self._solid(element, around, where)
        # the frame of each of our bodies stands in the anchor of its joint, with the axes of the element
        origin = np.zeros(3)  # of the element in that frame
        for i, joint in enumerate(joints):
            last = i == len(joints) - 1
            link = name if last else f"{name} {i + 1}"
            made, anchor = self._joint(joint, around, link, where, parent)
            self.bodies.append(
                SpatialBody(
                    name=link, parent=parent, joint=made,
                    at=tuple(at + axes @ anchor if i == 0 else origin + anchor),
                    axes=axes if i == 0 else UNIT,
                    mass=solid.mass if last else 0.0,
                    centre=tuple(solid.centre - anchor) if last else ZERO,
                    inertia=solid.inertia if last else ZERO,
                )
            )  # fmt: skip
            parent, origin = link, -anchor
        for child in element.findall("body"):
            self.body(child, name, origin, around)

    def _joint(
        self, joint: Element | None, around: str, link: str, where: str, parent: str
    ) -> tuple[Joint, Array]:
        """The joint and its anchor in the frame of the element."""
        if joint is None:
            return Welded(), np.zeros(3)
        given = self.settings.attributes(joint, around)
        kind = "free" if joint.tag == "freejoint" else given.get("type", "hinge")
        where = f"{where}, joint '{given.get('name', kind)}'"
        self._count_left_out(given, where)
        if kind == "free":
            if parent != GROUND:
                raise InvalidSystem(f"{where} is free, but its body hangs on body '{parent}'")
            return Floating(), np.zeros(3)
        read = ElementTree.Element("joint", given)
        anchor = numbers(read, "pos", ZERO, where)
        stiffness, damping, reference, spring = (
            number(read, key, 0.0, where) for key in ("stiffness", "damping", "ref", "springref")
        )
        if kind == "ball":
            if stiffness or damping:
                self.ball_springs.append(SphericalSpring(body=link, k=stiffness, c=damping))
            return Spherical(), anchor
        if kind not in ("hinge", "slide"):
            raise InvalidSystem(f"{where} has type '{kind}'; types are free, ball, hinge, slide")
        x, y, z = (float(value) for value in numbers(read, "axis", (0.0, 0.0, 1.0), where))
        unit = self.settings.angle if kind == "hinge" else 1.0
        limited = given.get("limited", "auto")
        if "range" in given and (limited == "true" or (limited == "auto" and self.settings.auto_limits)):
            low, high = unit * (numbers(read, "range", (0.0, 0.0), where) - reference)
            if high < low:
                raise InvalidSystem(f"{where} has the range {given['range']}: the ends are reversed")
            self.ranges[link] = (float(low), float(high))
        if stiffness or damping:
            rest = unit * (spring - reference)
            self.springs.append(CoordinateSpring(body=link, k=stiffness, c=damping, rest=rest))
        axis = (x, y, z)
        return Revolute(axis=axis) if kind == "hinge" else Prismatic(axis=axis), anchor

    def _count_left_out(self, given: dict[str, str], where: str) -> None:
        read = ElementTree.Element("joint", given)
        for key, what in LEFT_OUT.items():
            self.left_out[what] += number(read, key, 0.0, where) != 0.0

    def _solid(self, element: Element, around: str, where: str) -> Solid:
        inertial = element.find("inertial")
        geoms = element.findall("geom")
        self.left_out["contact of a geom"] += sum(self._touches(geom, around) for geom in geoms)
        for child in element:
            known = {"inertial", "geom", "joint", "freejoint", "body"} | CHANGES_NO_MOTION
            self.left_out[child.tag] += child.tag not in known
        if inertial is not None and self.settings.from_geoms != "true":
            return self._given(inertial, where)
        if self.settings.from_geoms == "false":
            return together([])
        solids = []
        for i, geom in enumerate(geoms):
            given = self.settings.attributes(geom, around)
            label = f"{where}, geom '{given.get('name', i)}'"
            solid = geom_solid(given, self._geom_place(given, label), label)
            solids += [] if solid is None else [solid]
        return together(solids)

    def _touches(self, geom: Element, around: str) -> bool:
        given = self.settings.attributes(geom, around)
        return given.get("contype", "1") != "0" or given.get("conaffinity", "1") != "0"

    def _geom_place(self, given: dict[str, str], where: str) -> tuple[Array, Array]:
        read = ElementTree.Element("geom", given)
        if "fromto" not in given:
            return self.settings.turn(given, where), numbers(read, "pos", ZERO, where)
        ends = numbers(read, "fromto", (0.0,) * 6, where)
        way = ends[3:] - ends[:3]
        if not np.linalg.norm(way) > 0.0:
            raise InvalidSystem(f'{where} needs two different ends in fromto="{given["fromto"]}"')
        turn = self.settings.turn({"zaxis": " ".join(map(str, way))}, where)
        return turn, 0.5 * (ends[3:] + ends[:3])

    def _given(self, inertial: Element, where: str) -> Solid:
        turn = self.settings.turn(inertial.attrib, where)
        if "fullinertia" in inertial.attrib:
            xx, yy, zz, xy, xz, yz = numbers(inertial, "fullinertia", (0.0,) * 6, where)
            own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        else:
            own = np.diag(numbers(inertial, "diaginertia", ZERO, where))
        mass = number(inertial, "mass", None, f"{where}, inertial,")
        return Solid(mass=mass, centre=numbers(inertial, "pos", ZERO, where), inertia=turn @ own @ turn.T)
