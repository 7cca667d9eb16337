"""SVG that says nothing twice: what matplotlib writes, made fit to stand among thirty others in one page.

matplotlib writes `style="..."` on every element, which a strict content policy forbids; all of these
properties exist as plain attributes, so they are moved there. It writes ids that nothing refers to, groups
that hold nothing together, coordinates to a millionth of a point and the outline of every letter once per
figure; a page is half as large again with them. What is left looks the same.
"""

import re
from typing import Any
from xml.etree import ElementTree

__all__ = ["compact_svg", "glyph_sheet"]

_PIXELS_PER_POINT = 1.45  # on a wide screen: 9 point text is as large as the page's small text

_GLYPH = re.compile(r"^\w[\w-]*-[0-9a-f]+$")  # matplotlib's: the font, then the number of the glyph
_REFERENCE = re.compile(r"url\(#([^)]*)\)")
_INSIDE = re.compile(r"^#(.*)$")  # a reference to the same page
_LONG = re.compile(r"(\d+\.\d{2})\d+")
_SPACE = re.compile(r"\s*([MLHVCSQTAZz])\s*|\s+")
_ALONG = re.compile(r"^translate\(([-\d.]+)[ ,]0(?:\.0+)?\)$")
_PLACES = ("d", "x", "y", "width", "height", "points")  # a hundredth of a point is not seen
_INHERITED = {
    "fill", "fill-opacity", "stroke", "stroke-opacity", "stroke-width", "stroke-linecap", "stroke-linejoin",
    "stroke-dasharray", "stroke-dashoffset",
}  # fmt: skip


def glyph_sheet(glyphs: dict[str, str]) -> str:
    """The letters of a page's figures: an element without size that the figures refer to."""
    if not glyphs:
        return ""
    outlines = "".join(glyphs[key] for key in sorted(glyphs))
    return f'<svg width="0" height="0" class="glyphs" aria-hidden="true" focusable="false">{outlines}</svg>'


def compact_svg(text: str, name: str, glyphs: dict[str, str] | None = None) -> str:
    """The SVG element of one of matplotlib's files, with ids that begin with `name`.

    The outlines of its letters go into `glyphs` (name -> element) where one is given: a page prints them
    once, by `glyph_sheet`. Otherwise the element holds its own.
    """
    root = ElementTree.fromstring(text)
    for parent in root.iter():
        parent.tag = parent.tag.rpartition("}")[2]
        parent.text = parent.tail = None
        _plain_attributes(parent)
    _drop(root, {"metadata", "style"})
    _round(root)
    own: dict[str, str] = {}
    _take_glyphs(root, own if glyphs is None else glyphs)
    _short_ids(root, name)
    _join_groups(root)
    box = root.attrib["viewBox"]
    # the rule that was taken out: * {stroke-linejoin: round; stroke-linecap: butt}; both are inherited
    across = round(_PIXELS_PER_POINT * float(box.split()[2]))
    root.attrib.clear()
    root.attrib |= {
        "viewBox": box, "width": str(across), "class": "plot", "aria-hidden": "true", "focusable": "false",
        "stroke-linejoin": "round", "stroke-linecap": "butt",
    }  # fmt: skip
    drawing = ElementTree.tostring(root, encoding="unicode").replace(" />", "/>")
    return drawing.removesuffix("</svg>") + "".join(own[key] for key in sorted(own)) + "</svg>"


def _plain_attributes(element: Any) -> None:
    """Attributes without a namespace, and the properties of `style` among them."""
    given = {key.rpartition("}")[2]: value for key, value in element.attrib.items()}
    rules = given.pop("style", "")
    given |= {
        key.strip(): value.strip()
        for key, _, value in (rule.partition(":") for rule in rules.split(";") if ":" in rule)
    }
    element.attrib.clear()
    element.attrib |= given


def _drop(element: Any, tags: set[str]) -> None:
    for child in list(element):
        if child.tag in tags:
            element.remove(child)
        else:
            _drop(child, tags)
            if child.tag == "defs" and not len(child):
                element.remove(child)


def _round(root: Any) -> None:
    for element in root.iter():
        for key in _PLACES:
            if key in element.attrib:
                element.set(key, _LONG.sub(r"\1", element.get(key)))
        if "d" in element.attrib:
            element.set("d", _SPACE.sub(lambda found: found[1] or " ", element.get("d").strip()))
        if element.get("transform", "").startswith("translate("):
            place, end, rest = element.get("transform").partition(")")
            element.set("transform", _LONG.sub(r"\1", place) + end + rest)  # a scale keeps its digits
        if element.tag == "use" and (moved := _ALONG.match(element.get("transform", ""))):
            del element.attrib["transform"]  # a letter further along its line
            element.set("x", moved[1])


def _take_glyphs(element: Any, glyphs: dict[str, str]) -> None:
    """Move the outlines of letters out of the drawing."""
    for child in list(element):
        _take_glyphs(child, glyphs)
        if child.tag != "defs":
            continue
        for outline in list(child):
            if outline.tag == "path" and _GLYPH.match(outline.get("id", "")):
                child.remove(outline)
                name = _glyph_id(outline.get("id"))
                outline.set("id", name)
                glyphs[name] = f"<defs>{ElementTree.tostring(outline, encoding='unicode')}</defs>"
        if not len(child):
            element.remove(child)


def _glyph_id(name: str) -> str:
    """The id of a letter: of the font of all figures without the font's name, for a page has thousands."""
    return f"glyph-{name.removeprefix('DejaVuSans-')}"


def _short_ids(root: Any, name: str) -> None:
    """Keep the ids that something refers to, under the name of the drawing and a number."""
    used = {
        target
        for element in root.iter()
        for key, value in element.attrib.items()
        for target in (_INSIDE if key == "href" else _REFERENCE).findall(value)
    }
    named = [element.get("id") for element in root.iter() if element.get("id") in used]
    new = {old: f"{name}-{k}" for k, old in enumerate(named)}
    for element in root.iter():
        if "id" in element.attrib:
            old = element.attrib.pop("id")
            if old in new:
                element.set("id", new[old])
        for key, value in element.attrib.items():
            if key == "href":  # of a picture it holds the picture
                value = _INSIDE.sub(lambda found: f"#{new.get(found[1]) or _glyph_id(found[1])}", value)
            element.set(key, _REFERENCE.sub(lambda found: f"url(#{new[found[1]]})", value))


def _join_groups(element: Any) -> None:
    """Say once what marks of a group share, join alike neighbours, open groups that say nothing."""
    children: list[Any] = []
    for child in element:
        _join_groups(child)
        if child.tag == "g" and not child.attrib:
            children += list(child)
        elif children and _alike(children[-1], child):
            children[-1].extend(list(child))
        else:
            children.append(child)
    element[:] = children
    if element.tag == "g" and len(element) and all(mark.tag == "use" for mark in element):
        _share(element)


def _alike(before: Any, child: Any) -> bool:
    """Whether two groups of marks differ in nothing but their marks; an opacity is one of the whole group."""
    return (
        before.tag == child.tag == "g"
        and before.attrib == child.attrib
        and "opacity" not in child.attrib
        and all(mark.tag == "use" for group in (before, child) for mark in group)
    )


def _share(group: Any) -> None:
    for key in sorted(_INHERITED.difference(group.attrib)):
        values = {mark.get(key) for mark in group}
        if len(values) == 1 and None not in values:
            group.set(key, values.pop())
            for mark in group:
                del mark.attrib[key]
