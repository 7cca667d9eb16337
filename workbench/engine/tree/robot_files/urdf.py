"""URDF, the robot description of ROS: links with inertias on joints of one coordinate, or free.

A joint's axis stands in the joint frame; roll, pitch and yaw turn about the fixed axes x, y, z in this order.
Ranges are in radians and metres always. http://wiki.ros.org/urdf/XML
"""

from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...errors import InvalidSystem, NotSupported
from ..elements import CoordinateSpring
from ..joints import Floating, Joint, Planar, Prescribed, Prismatic, Revolute, Spherical, Welded
from ..system import GROUND, SpatialBody, TreeSystem, full_inertia
from .expansion import one_axis_each
from .record import Range, RobotFile, range_stops
from .xml_text import Element, listed, needed, number, numbers, parsed, text_of

__all__ = ["read_urdf", "write_urdf"]

Array = np.ndarray[Any, Any]
NONE = (0.0, 0.0, 0.0)
CHANGES_NO_MOTION = {"visual", "collision", "material"}


def read_urdf(path: str | Path, *, floating: bool = False, stop_stiffness: float | None = None) -> RobotFile:
    """A tree from a URDF file; a root link called "world" without mass is the ground.

    Args:
        floating: the root link moves freely; otherwise it stands on the ground.
        stop_stiffness: soft stops at the ends of all ranges, N m/rad (N/m for slides); None: no stops.

    Raises:
        InvalidSystem: the file is missing, is no URDF, or a link or joint lacks what it needs.

    >>> print(read_urdf("arm.urdf"))                                               # doctest: +SKIP
    2 bodies, 2 velocities
    upper: -1.571 to 1.571 rad (-90 to 90 deg)
    """
    root, left_out = parsed(path, "robot"), Counter[str]()
    links = {_name(link, f"{path}: a link"): link for link in root.findall("link")}
    joints = _joint_of_each(root, links, str(path))
    roots = [name for name in links if name not in joints]
    if len(roots) != 1:
        raise InvalidSystem(f"{path} needs one link that hangs on no joint, got {', '.join(roots) or 'none'}")
    (base,) = roots
    is_ground = base == "world" and links[base].find("inertial") is None
    bodies: list[SpatialBody] = []
    ranges: dict[str, Range] = {}
    springs: list[CoordinateSpring] = []
    for name, link in links.items():
        _count_others(link, {"inertial"}, left_out)
        if name == base:
            if not is_ground:
                bodies.append(_body(link, Floating() if floating else Welded(), f"{path}: link '{name}'"))
            continue
        joint = joints[name]
        where = f"{path}: joint '{joint.get('name')}'"
        parent = str(needed(joint, "parent", where).get("link"))
        parent = GROUND if parent == base and is_ground else parent
        place = _placed(joint.find("origin"), where)
        bodies.append(_body(link, _joint(joint, where), f"{path}: link '{name}'", parent, place))
        if joint.get("type") in ("revolute", "prismatic"):
            ranges[name] = _range(joint, where)
        damping, friction = (
            number(joint.find("dynamics"), key, 0.0, where) for key in ("damping", "friction")
        )
        if damping:
            springs.append(CoordinateSpring(body=name, c=damping))
        left_out["dry friction of a joint"] += friction != 0.0
        _count_others(joint, {"origin", "parent", "child", "axis", "limit", "dynamics"}, left_out)
    _count_others(root, {"link", "joint"}, left_out)
    if stop_stiffness is None:
        left_out["range without stops (see stop_stiffness)"] += len(ranges)
    else:
        springs += range_stops(ranges, ((b.name, b.joint) for b in bodies), stop_stiffness)
    system = TreeSystem(bodies=tuple(bodies), springs=tuple(springs))
    return RobotFile(system=system, ranges=ranges, left_out=listed(left_out))


def _joint_of_each(root: Element, links: dict[str, Element], path: str) -> dict[str, Element]:
    """The joint on which each link hangs."""
    joints: dict[str, Element] = {}
    for joint in root.findall("joint"):
        name = _name(joint, f"{path}: a joint")
        where = f"{path}: joint '{name}'"
        parent, child = (str(needed(joint, end, where).get("link")) for end in ("parent", "child"))
        for link in (parent, child):
            if link not in links:
                raise InvalidSystem(f"{where} refers to link '{link}'; links are {', '.join(sorted(links))}")
        if child in joints:
            raise InvalidSystem(f"{path}: link '{child}' hangs on two joints")
        joints[child] = joint
    return joints


def _range(joint: Element, where: str) -> Range:
    limit = needed(joint, "limit", where)
    low, high = (number(limit, key, 0.0, where) for key in ("lower", "upper"))
    if high < low:
        raise InvalidSystem(f"{where} has the range {low:g} to {high:g}: the ends are reversed")
    return low, high


def _name(element: Element, where: str) -> str:
    name = element.get("name")
    if not name:
        raise InvalidSystem(f"{where} needs a name")
    return name


def _count_others(element: Element, known: set[str], counts: Counter[str]) -> None:
    for child in element:
        if child.tag not in known and child.tag not in CHANGES_NO_MOTION:
            counts[child.tag] += 1


def _placed(origin: Element | None, where: str) -> tuple[Array, Array]:
    turn = Rotation.from_euler("xyz", numbers(origin, "rpy", NONE, where)).as_matrix()
    return np.asarray(turn), numbers(origin, "xyz", NONE, where)


def _body(
    link: Element,
    joint: Joint,
    where: str,
    parent: str = GROUND,
    place: tuple[Array, Array] | None = None,
) -> SpatialBody:
    axes, at = (np.eye(3), np.zeros(3)) if place is None else place
    name, inertial = str(link.get("name")), link.find("inertial")
    if inertial is None:
        return SpatialBody(name=name, parent=parent, joint=joint, at=tuple(at), axes=axes)
    turn, centre = _placed(inertial.find("origin"), where)
    xx, xy, xz, yy, yz, zz = (
        number(needed(inertial, "inertia", where), key, None, where)
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    )
    own = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    mass = number(needed(inertial, "mass", where), "value", None, where)
    return SpatialBody(
        name=name, parent=parent, joint=joint, at=tuple(at), axes=axes, centre=tuple(centre), mass=mass,
        inertia=turn @ own @ turn.T,
    )  # fmt: skip


def _joint(joint: Element, where: str) -> Joint:
    x, y, z = (float(value) for value in numbers(joint.find("axis"), "xyz", (1.0, 0.0, 0.0), where))
    match joint.get("type"):
        case "revolute" | "continuous":
            return Revolute(axis=(x, y, z))
        case "prismatic":
            return Prismatic(axis=(x, y, z))
        case "fixed":
            return Welded()
        case "floating":
            return Floating()
        case "planar":
            least = np.eye(3)[np.argmin(np.abs((x, y, z)))]
            first = np.cross((x, y, z), least)
            return Planar(axes=(tuple(first), tuple(np.cross((x, y, z), first))))
        case other:
            raise InvalidSystem(
                f"{where} has type '{other}'; types are revolute, continuous, prismatic, fixed, floating, "
                "planar"
            )


def write_urdf(system: TreeSystem, path: str | Path, *, name: str = "tree") -> tuple[str, ...]:
    """Write the bodies and joints of a tree, at zero coordinates, and say what URDF cannot hold.

    Joints of two or three coordinates become chains of links without mass. Dampers of single coordinates are
    written; other forces, gravity and the start are not.

    Raises:
        NotSupported: a spherical or prescribed joint, for which URDF has no type.
    """
    left_out = Counter[str]()
    for body in system.bodies:
        if isinstance(body.joint, Spherical | Prescribed):
            kind = type(body.joint).__name__.lower()
            hint = "; write_mjcf has them" if kind == "spherical" else ""
            raise NotSupported(f"URDF has no {kind} joint, as body '{body.name}' has{hint}")
    root = ElementTree.Element("robot", name=name)
    ElementTree.SubElement(root, "link", name="world")
    link_of = {(body.name, i): link for body in system.bodies for i, link in _coordinates(body)}
    dampers: dict[str, float] = {}
    for spring in system.springs:
        link = link_of.get((spring.body, spring.coordinate))
        if link is not None:
            dampers[link] = dampers.get(link, 0.0) + spring.c
        left_out["damper of a floating body"] += link is None and bool(spring.c)
        left_out["spring, stop or torque of a joint"] += bool(spring.k or spring.k_stop or spring.torque)
    for body in one_axis_each(system.bodies):
        _write_link(root, body)
        _write_joint(root, body, dampers.get(body.name, 0.0))
    left_out["cut joint"] += len(system.cuts)
    for field in (
        "members",
        "bushings",
        "contacts",
        "tyres",
        "struts",
        "spherical_springs",
        "couplings",
        "loads",
    ):
        left_out[field.replace("_", " ").rstrip("s")] += len(getattr(system, field))
    left_out["start other than zero coordinates"] += any(_moved(body.joint) for body in system.bodies)
    ElementTree.indent(root)
    Path(path).write_bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True) + b"\n")
    return listed(left_out)


def _coordinates(body: SpatialBody) -> list[tuple[int, str]]:
    """The coordinates of a joint, and the link each is written to."""
    pieces = [piece.name for piece in one_axis_each((body,))]
    return list(enumerate(pieces)) if not isinstance(body.joint, Floating | Welded) else []


def _moved(joint: Joint) -> bool:
    """Whether it starts anywhere but at rest at zero coordinates."""
    axes = {key: getattr(joint, key) for key in ("axis", "axes") if hasattr(joint, key)}
    return joint != type(joint)(**axes)


def _origin(parent: Element, axes: Any, at: Any) -> None:
    rpy = Rotation.from_matrix(np.asarray(axes, float)).as_euler("xyz")
    ElementTree.SubElement(parent, "origin", xyz=text_of(at), rpy=text_of(rpy))


def _write_link(root: Element, body: SpatialBody) -> None:
    link = ElementTree.SubElement(root, "link", name=body.name)
    inertia = full_inertia(body.inertia)
    if body.mass == 0.0 and not inertia.any():
        return
    inertial = ElementTree.SubElement(link, "inertial")
    _origin(inertial, np.eye(3), body.centre)
    ElementTree.SubElement(inertial, "mass", value=text_of(body.mass))
    keys = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ElementTree.SubElement(inertial, "inertia", {key: text_of(inertia[at]) for key, at in keys.items()})


def _write_joint(root: Element, body: SpatialBody, damping: float) -> None:
    kind = {Revolute: "continuous", Prismatic: "prismatic", Welded: "fixed", Floating: "floating"}
    joint = ElementTree.SubElement(root, "joint", name=f"{body.name} joint", type=kind[type(body.joint)])
    _origin(joint, body.axes, body.at)
    ElementTree.SubElement(joint, "parent", link="world" if body.parent == GROUND else body.parent)
    ElementTree.SubElement(joint, "child", link=body.name)
    if isinstance(body.joint, Revolute | Prismatic):
        axis = np.asarray(body.joint.axis, float)
        ElementTree.SubElement(joint, "axis", xyz=text_of(axis / np.linalg.norm(axis)))
    if isinstance(body.joint, Prismatic):
        wide = {"lower": "-1e9", "upper": "1e9", "effort": "1e9", "velocity": "1e9"}
        ElementTree.SubElement(joint, "limit", wide)
    if damping:
        ElementTree.SubElement(joint, "dynamics", damping=text_of(damping))
