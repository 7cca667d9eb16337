"""Figures drawn as SVG for one page: the same bytes every time."""

import io
from collections.abc import Callable
from typing import Any

from workbench.figures.parts import text_where_no_math
from workbench.report.page.compact_svg import compact_svg

__all__ = ["STYLE", "draw_svg"]

STYLE = "workbench.style"
POINTS_PER_INCH = 72  # of SVG


def draw_svg(
    draw: Callable[[Any], Any],
    *,
    width: float,
    height: float,
    name: str,
    glyphs: dict[str, str] | None = None,
) -> str:
    """The SVG element of what `draw(ax)` draws on axes of `width` x `height` inches.

    `glyphs` gathers the outlines of letters for all figures of a page (see `compact_svg`).
    """
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
        if any(
            ax.get_aspect() != "auto" for ax in figure.axes
        ):  # what stands beside such axes moves with them
            engine.execute(figure)
        figure.set_layout_engine("none")
        file = io.StringIO()
        canvas.print_svg(file, metadata={"Date": None})
    return compact_svg(file.getvalue(), name, glyphs)
