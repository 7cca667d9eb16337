"""Reading XML files of robots: numbers with one clear error each."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from ...errors import InvalidSystem

__all__ = ["Element", "listed", "needed", "number", "numbers", "parsed", "text_of"]

Array = np.ndarray[Any, Any]
Element = ElementTree.Element


def parsed(path: str | Path, tag: str) -> Element:
    """The root of an XML file, which must be called `tag`. Entities are refused unread."""
    where = Path(path)
    if not where.is_file():
        raise InvalidSystem(f"{where}: no such file; a {tag} file in XML was expected")
    data = where.read_bytes()
    if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
        raise InvalidSystem(f"{where} declares a DOCTYPE or entities, which no {tag} file needs; remove them")
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise InvalidSystem(f"{where} is not XML: {error}") from None
    if root.tag != tag:
        raise InvalidSystem(f"{where} begins with <{root.tag}>; <{tag}> was expected")
    return root


def numbers(element: Element | None, key: str, default: tuple[float, ...] | None, where: str) -> Array:
    """Numbers of an attribute, as many as the default has (any number where that is None)."""
    text = None if element is None else element.get(key)
    if text is None:
        if default is None:
            raise InvalidSystem(f"{where} needs {key}")
        return np.array(default, float)
    try:
        values = np.array([float(word) for word in text.split()])
    except ValueError:
        raise InvalidSystem(f'{where} needs numbers in {key}="{text}"') from None
    if not np.isfinite(values).all() or (default is not None and len(values) != len(default)):
        many = "finite numbers" if default is None else f"{len(default)} finite numbers"
        raise InvalidSystem(f'{where} needs {many} in {key}="{text}"')
    return values


def number(element: Element | None, key: str, default: float | None, where: str) -> float:
    """One number of an attribute; without a default it must be there."""
    if default is None and (element is None or element.get(key) is None):
        raise InvalidSystem(f"{where} needs {key}")
    return float(numbers(element, key, (default or 0.0,), where)[0])


def needed(element: Element, tag: str, where: str) -> Element:
    """The one child with that tag."""
    child = element.find(tag)
    if child is None:
        raise InvalidSystem(f"{where} needs <{tag}>")
    return child


def text_of(values: Any) -> str:
    """Numbers for an attribute, to the last digit."""
    return " ".join(repr(float(x) + 0.0) for x in np.ravel(values))


def listed(counts: dict[str, int]) -> tuple[str, ...]:
    """What was left out, in lines: "2 x transmission"."""
    return tuple(f"{count} x {what}" for what, count in counts.items() if count)
