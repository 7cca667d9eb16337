"""What is left of matplotlib's SVG in a page: nothing dangles, nothing is said twice."""

import re
from xml.etree import ElementTree

import numpy as np

from workbench.report.page.compact_svg import glyph_sheet
from workbench.report.page.drawing import draw_svg


def _points(ax):
    x = np.linspace(0, 1, 200)
    ax.scatter(x, np.sin(9 * x), c=x)
    ax.plot(x, x**2, "o-", label="$x^2$ against it")
    ax.fill_between(x, x**3, x, alpha=0.3)
    ax.set_xlabel("deviation [m]")
    ax.legend()


def _references(svg):
    return re.findall(r'href="#([^"]*)"', svg) + re.findall(r"url\(#([^)]*)\)", svg)


def test_every_reference_is_there_once_and_nothing_else_has_an_id():
    svg = draw_svg(_points, width=4, height=3, name="n")
    defined = re.findall(r' id="([^"]*)"', svg)
    assert len(defined) == len(set(defined))
    assert set(defined) == set(_references(svg))
    assert not re.search("style=|xmlns|xlink|<metadata|<!--", svg)


def test_figures_of_a_page_share_their_letters():
    glyphs: dict[str, str] = {}
    first = draw_svg(_points, width=4, height=3, name="a", glyphs=glyphs)
    many = len(glyphs)
    second = draw_svg(_points, width=4, height=3, name="b", glyphs=glyphs)
    assert len(glyphs) == many > 10
    page = f"<body>{first}{second}{glyph_sheet(glyphs)}</body>"
    ElementTree.fromstring(page)
    defined = re.findall(r' id="([^"]*)"', page)
    assert len(defined) == len(set(defined))
    assert set(_references(page)) == set(defined)
    assert "glyph-" not in "".join(re.findall(r' id="[^"]*"', first))


def test_every_mark_and_line_is_still_drawn():
    svg = ElementTree.fromstring(draw_svg(_points, width=4, height=3, name="n"))
    marks = [use for use in svg.iter("use") if "glyph-" not in use.get("href")]
    assert len(marks) >= 2 * 200  # points of the scatter and of the line
    filled = [group for group in svg.iter() if group.get("fill", "").startswith("#")]
    assert len({group.get("fill") for group in filled}) > 100  # the colours of the scatter are kept
    line = max((path.get("d", "") for path in svg.iter("path")), key=len)
    assert line.count("L") >= 199


def test_a_coordinate_is_given_to_a_hundredth_of_a_point():
    svg = ElementTree.fromstring(draw_svg(_points, width=4, height=3, name="n"))
    numbers = [n for element in svg.iter() for key in ("x", "y") for n in [element.get(key)] if n]
    assert numbers
    assert all(len(number.partition(".")[2]) <= 2 for number in numbers)


def test_a_picture_in_a_figure_stays():
    svg = draw_svg(lambda ax: ax.imshow(np.eye(3)), width=2, height=2, name="n")
    assert svg.count('href="data:image/png;base64,') == 1


def test_a_drawing_is_the_same_every_time():
    assert draw_svg(_points, width=4, height=3, name="n") == draw_svg(_points, width=4, height=3, name="n")


def test_a_page_without_figures_has_no_letters():
    assert glyph_sheet({}) == ""
