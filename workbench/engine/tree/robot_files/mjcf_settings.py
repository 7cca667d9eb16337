"""What stands at the head of an MJCF file: units, orders of turns, gravity, and the classes of defaults."""

import math
from dataclasses import dataclass
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...errors import InvalidSystem, NotSupported
from .xml_text import Element, numbers

__all__ = ["Settings", "settings_of"]

Array = np.ndarray[Any, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """angle: rad per unit of an angle; MJCF counts in degrees unless `compiler angle="radian"` is there.

    classes: attributes by (class, tag), those of the classes above included.
    """

    angle: float
    euler: str
    auto_limits: bool
    from_geoms: str
    gravity: tuple[float, float, float]
    classes: dict[tuple[str, str], dict[str, str]]

    def attributes(self, element: Element, around: str) -> dict[str, str]:
        """An element's own attributes over those of its class, or of the class around it."""
        name = element.get("class", around)
        return {**self.classes.get((name, element.tag), {}), **element.attrib}

    def turn(self, given: dict[str, str], where: str) -> Array:
        """(3, 3) from quat, axisangle, euler, xyaxes or zaxis; none of them is no turn."""
        found = [key for key in ("quat", "axisangle", "euler", "xyaxes", "zaxis") if key in given]
        if len(found) > 1:
            raise InvalidSystem(f"{where} has {' and '.join(found)}; one orientation was expected")
        if not found:
            return np.eye(3)
        (key,) = found
        count = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}[key]
        values = numbers(ElementTree.Element("x", given), key, (0.0,) * count, where)
        if key == "euler":
            return np.asarray(Rotation.from_euler(self.euler, self.angle * values).as_matrix())
        if not np.linalg.norm(values[:3] if key != "quat" else values) > 0.0:
            raise InvalidSystem(f'{where} needs a direction in {key}="{given[key]}"')
        if key == "quat":
            w, x, y, z = values
            return np.asarray(Rotation.from_quat([x, y, z, w]).as_matrix())
        if key == "axisangle":
            axis = values[:3] / np.linalg.norm(values[:3])
            return np.asarray(Rotation.from_rotvec(self.angle * values[3] * axis).as_matrix())
        if key == "zaxis":
            return _least_turn(values)
        x = values[:3] / np.linalg.norm(values[:3])
        y = values[3:] - (values[3:] @ x) * x
        if not np.linalg.norm(y) > 1e-10:
            raise InvalidSystem(f'{where} needs two directions in xyaxes="{given[key]}"')
        y /= np.linalg.norm(y)
        return np.column_stack([x, y, np.cross(x, y)])


def _least_turn(direction: Array) -> Array:
    """The smallest turn of z onto a direction."""
    z = direction / np.linalg.norm(direction)
    axis = np.cross((0.0, 0.0, 1.0), z)
    sine = np.linalg.norm(axis)
    axis = axis / sine if sine > 1e-12 else np.array([1.0, 0.0, 0.0])
    return np.asarray(Rotation.from_rotvec(math.atan2(sine, z[2]) * axis).as_matrix())


def settings_of(root: Element, where: str) -> Settings:
    """From <compiler>, <option> and <default>; several of them count from first to last."""
    compiler: dict[str, str] = {}
    for element in root.findall("compiler"):
        compiler |= element.attrib
    if compiler.get("coordinate", "local") != "local":
        raise NotSupported(f'{where} has coordinates "global"; save it with coordinate="local" first')
    unit = compiler.get("angle", "degree")
    if unit not in ("degree", "radian"):
        raise InvalidSystem(f'{where}: compiler angle="{unit}"; degree or radian was expected')
    order = compiler.get("eulerseq", "xyz")
    if len(order) != 3 or set(order.lower()) - set("xyz") or not (order.islower() or order.isupper()):
        raise NotSupported(
            f'{where}: compiler eulerseq="{order}"; three of xyz or three of XYZ were expected'
        )
    gravity = np.array([0.0, 0.0, -9.81])
    for element in root.findall("option"):
        gravity = numbers(element, "gravity", tuple(gravity), where)
    classes: dict[tuple[str, str], dict[str, str]] = {}
    for element in root.findall("default"):
        _read_class(element, element.get("class", "main"), {}, classes)
    x, y, z = (float(value) for value in gravity)
    return Settings(
        angle=math.pi / 180.0 if unit == "degree" else 1.0,
        euler=order.swapcase(),  # capitals mean fixed axes there, and moving ones here
        auto_limits=compiler.get("autolimits", "true") == "true",
        from_geoms=compiler.get("inertiafromgeom", "auto"),
        gravity=(x, y, z),
        classes=classes,
    )


def _read_class(
    element: Element,
    name: str,
    above: dict[str, dict[str, str]],
    classes: dict[tuple[str, str], dict[str, str]],
) -> None:
    own = {tag: dict(given) for tag, given in above.items()}
    for child in element:
        if child.tag != "default":
            own[child.tag] = {**own.get(child.tag, {}), **child.attrib}
    for tag, given in own.items():
        classes[name, tag] = {key: value for key, value in given.items() if key != "class"}
    for child in element.findall("default"):
        _read_class(child, child.get("class", ""), own, classes)
