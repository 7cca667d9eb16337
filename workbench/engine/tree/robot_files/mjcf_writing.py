"""Writing a tree as MJCF, for a second opinion by MuJoCo."""

from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...errors import NotSupported
from ..joints import (
    Cylindrical,
    Floating,
    Planar,
    Prescribed,
    Prismatic,
    Revolute,
    Spherical,
    Universal,
    Welded,
)
from ..system import GROUND, SpatialBody, TreeSystem, full_inertia
from .expansion import pieces
from .xml_text import listed, text_of

__all__ = ["write_mjcf"]


def write_mjcf(system: TreeSystem, path: str | Path, *, name: str = "tree") -> tuple[str, ...]:
    """Write bodies, joints, linear springs and dampers of joints, gravity and the start (keyframe "start"),
    and say what the format cannot hold.

    Raises:
        NotSupported: a prescribed joint, or a floating one that hangs on another body.
    """
    for body in system.bodies:
        if isinstance(body.joint, Prescribed):
            raise NotSupported(f"MJCF has no prescribed joint, as body '{body.name}' has")
        if isinstance(body.joint, Floating) and body.parent != GROUND:
            raise NotSupported(
                f"MJCF bodies float on the ground only; '{body.name}' hangs on '{body.parent}'"
            )
    left_out = Counter[str]()
    root = ElementTree.Element("mujoco", model=name)
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="false")
    ElementTree.SubElement(root, "option", gravity=text_of(system.gravity))
    springs, balls = _springs(system, left_out), _ball_springs(system, left_out)
    children: dict[str, list[SpatialBody]] = {}
    for body in reversed(system.bodies):
        children.setdefault(body.parent, []).append(body)
    positions, speeds = list[float](), list[float]()
    world = ElementTree.SubElement(root, "worldbody")
    # depth first, as the format counts coordinates
    waiting = [(body, world) for body in children.get(GROUND, [])]
    while waiting:
        body, into = waiting.pop()
        element = _write_body(into, body)
        _write_joints(element, body, springs, balls)
        q, v = _start(body)
        positions += q
        speeds += v
        waiting += [(child, element) for child in children.get(body.name, [])]
    frames = ElementTree.SubElement(root, "keyframe")
    ElementTree.SubElement(frames, "key", name="start", qpos=text_of(positions), qvel=text_of(speeds))
    left_out["cut joint"] += len(system.cuts)
    for field in ("members", "bushings", "contacts", "tyres", "struts", "couplings", "loads"):
        left_out[field.replace("_", " ").rstrip("s")] += len(getattr(system, field))
    ElementTree.indent(root)
    Path(path).write_bytes(ElementTree.tostring(root, encoding="utf-8") + b"\n")
    return listed(left_out)


def _springs(system: TreeSystem, left_out: Counter[str]) -> dict[tuple[str, int], dict[str, str]]:
    """Attributes of the joints of single coordinates by (body, coordinate)."""
    starts = {body.name: _scalars(body) for body in system.bodies}
    written: dict[tuple[str, int], dict[str, str]] = {}
    for spring in system.springs:
        at = (spring.body, spring.coordinate)
        left_out["stop or torque of a joint"] += bool(spring.k_stop or spring.torque)
        if not (spring.k or spring.c):
            continue
        if at in written or not starts[spring.body]:
            left_out["second spring of a coordinate, or spring of a floating body"] += 1
            continue
        rest = starts[spring.body][spring.coordinate] if spring.rest is None else spring.rest
        written[at] = {
            "stiffness": text_of(spring.k), "springref": text_of(rest), "damping": text_of(spring.c),
        }  # fmt: skip
    return written


def _ball_springs(system: TreeSystem, left_out: Counter[str]) -> dict[str, dict[str, str]]:
    joints = {body.name: body.joint for body in system.bodies}
    written: dict[str, dict[str, str]] = {}
    for spring in system.spherical_springs:
        joint = joints[spring.body]
        rest = spring.rest
        if rest is None and isinstance(joint, Spherical):
            rest = joint.orientation
        straight = rest is not None and np.allclose(np.asarray(rest)[1:], 0.0)
        if spring.body in written or not isinstance(joint, Spherical) or not straight:
            left_out["second spring of a ball, one turned at rest, or one of a floating body"] += 1
            continue
        written[spring.body] = {"stiffness": text_of(spring.k), "damping": text_of(spring.c)}
    return written


def _scalars(body: SpatialBody) -> tuple[float, ...]:
    """Coordinates at the start of a joint made of slides and turns, in the order of its pieces."""
    joint = body.joint
    match joint:
        case Revolute():
            return (joint.angle,)
        case Prismatic():
            return (joint.position,)
        case Universal():
            return joint.angles
        case Cylindrical():
            return joint.position, joint.angle
        case Planar():
            return (*joint.position, joint.angle)
    return ()


def _start(body: SpatialBody) -> tuple[list[float], list[float]]:
    """Entries of qpos and qvel of a body's joints: a free body counts in global axes, its spin in its own."""
    joint = body.joint
    match joint:
        case Floating():
            axes = np.asarray(body.axes, float)
            place = np.asarray(body.at) + axes @ np.asarray(joint.position)
            w, *v = joint.orientation
            turn = Rotation.from_matrix(axes) * Rotation.from_quat([*v, w])
            return [*place, *_quaternion(turn)], [*(axes @ np.asarray(joint.velocity)), *joint.spin]
        case Spherical():
            w, *v = joint.orientation
            return _quaternion(Rotation.from_quat([*v, w])), list(joint.spin)
        case Revolute() | Prismatic():
            return list(_scalars(body)), [joint.speed]
        case Universal():
            return list(joint.angles), list(joint.speeds)
        case Cylindrical():
            return list(_scalars(body)), [joint.speed, joint.angular_speed]
        case Planar():
            return list(_scalars(body)), [*joint.velocity, joint.angular_speed]
    return [], []


def _quaternion(turn: Rotation) -> list[float]:
    x, y, z, w = turn.as_quat()
    return [float(w), float(x), float(y), float(z)]


def _write_body(into: ElementTree.Element, body: SpatialBody) -> ElementTree.Element:
    turn = _quaternion(Rotation.from_matrix(np.asarray(body.axes, float)))
    element = ElementTree.SubElement(into, "body", name=body.name, pos=text_of(body.at), quat=text_of(turn))
    inertia = full_inertia(body.inertia)
    if body.mass or inertia.any():
        order = (0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)
        ElementTree.SubElement(
            element, "inertial", pos=text_of(body.centre), mass=text_of(body.mass),
            fullinertia=text_of([inertia[at] for at in order]),
        )  # fmt: skip
    return element


def _write_joints(
    element: ElementTree.Element,
    body: SpatialBody,
    springs: dict[tuple[str, int], dict[str, str]],
    balls: dict[str, dict[str, str]],
) -> None:
    for i, joint in enumerate(pieces(body.joint)):
        name = body.name if i == 0 else f"{body.name} {i + 1}"
        match joint:
            case Welded():
                continue
            case Floating():
                ElementTree.SubElement(element, "freejoint", name=name)
            case Spherical():
                ElementTree.SubElement(
                    element, "joint", {"name": name, "type": "ball", **balls.get(body.name, {})}
                )
            case Revolute() | Prismatic():
                kind = "hinge" if isinstance(joint, Revolute) else "slide"
                given = {"name": name, "type": kind, "axis": text_of(joint.axis)}
                ElementTree.SubElement(element, "joint", given | springs.get((body.name, i), {}))
