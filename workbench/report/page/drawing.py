"""Figures as SVG that belong in one page: the same bytes every time, no ids that clash, no style attributes.

matplotlib writes `style="..."` on every element, which a strict content policy forbids; all of these
properties exist as plain attributes, so they are moved there. Ids get the panel's name as a prefix.
"""

import io
import re
from collections.abc import Callable
from typing import Any

from workbench.figures.parts import text_where_no_math

__all__ = ["STYLE", "draw_svg"]

STYLE = "workbench.style"
POINTS_PER_INCH = 72  # of SVG
PIXELS_PER_POINT = 1.45  # on a wide screen: 9 point text is as large as the page's small text

_PROLOGUE = re.compile(r"^.*?(?=<svg)", re.S)
_METADATA = re.compile(r"\s*<metadata>.*?</metadata>", re.S)
_RULES = re.compile(r"\s*<defs>\s*<style[^>]*>.*?</style>\s*</defs>", re.S)
_STYLE = re.compile(r' style="([^"]*)"')
_ID = re.compile(r'( id="|href="#|url\(#)')
_LONG = re.compile(r"(\d+\.\d{2})\d+")
_PATH = re.compile(r' d="[^"]*"')


def draw_svg(draw: Callable[[Any], Any], *, width: float, height: float, name: str) -> str:
    """The SVG element of what `draw(ax)` draws on axes of `width` x `height` inches."""
    from matplotlib import style
    from matplotlib.backends.backend_svg import FigureCanvasSVG
    from matplotlib.figure import Figure

    with style.context(STYLE, after_reset=True):
        figure = Figure(figsize=(width, height), dpi=POINTS_PER_INCH, layout="constrained")
        canvas: Any = FigureCanvasSVG(figure)
        draw(figure.add_subplot())
        text_where_no_math(figure)
        # savefig would lay out and draw everything twice
        engine = figure.get_layout_engine()
        assert engine is not None
        engine.execute(figure)
        figure.set_layout_engine("none")
        file = io.StringIO()
        canvas.print_svg(file, metadata={"Date": None})
    return _embedded(file.getvalue(), name)


def _embedded(svg: str, name: str) -> str:
    svg = _RULES.sub("", _METADATA.sub("", _PROLOGUE.sub("", svg)))
    svg = _STYLE.sub(_attributes, svg)
    svg = _ID.sub(rf"\g<1>{name}-", svg)
    svg = _PATH.sub(lambda path: _LONG.sub(r"\1", path[0]), svg)
    box = re.search(r'viewBox="([^"]*)"', svg)
    assert box is not None
    # the rule that was taken out: * {stroke-linejoin: round; stroke-linecap: butt}; both are inherited
    across = round(PIXELS_PER_POINT * float(box[1].split()[2]))
    opening = f'<svg viewBox="{box[1]}" width="{across}" class="plot" aria-hidden="true" focusable="false" '
    opening += 'stroke-linejoin="round" stroke-linecap="butt">'
    return re.sub(r"^<svg[^>]*>", opening, svg).strip()


def _attributes(match: re.Match[str]) -> str:
    pairs = [rule.split(":", 1) for rule in match[1].split(";") if ":" in rule]
    return "".join(f' {key.strip()}="{value.strip()}"' for key, value in pairs)
