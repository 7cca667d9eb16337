"""What the figures share: colours that the colour-blind tell apart, labels with units, the current axes."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

from workbench.space.units import raised

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["any_label", "axis_label", "current_axes", "text_where_no_math", "whole_numbers"]

P = ParamSpec("P")
Drawn = TypeVar("Drawn", "Axes", "Figure")

BLUE, VERMILLION, GREEN, PURPLE, ORANGE = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00"
GREY, PALE = "#8a939d", "#c9d0d8"
NORMAL_95 = 1.959963984540054


def axis_label(name: str, unit: str = "1") -> str:
    """A name with its unit in brackets; nothing for the dimensionless unit.

    >>> axis_label("Tu", "m^2/yr"), axis_label("x1")
    ('Tu [m²/yr]', 'x1')
    """
    return name if unit in ("", "1") else f"{name} [{raised(unit)}]"


def current_axes(ax: "Axes | None") -> "Axes":
    """The given axes, or the current ones."""
    if ax is not None:
        return ax
    from matplotlib import pyplot as plt

    return plt.gca()


def any_label(plot: Callable[P, Drawn]) -> Callable[P, Drawn]:
    """A function that draws, whose labels may be any text: those that are no valid mathtext stay text."""

    @wraps(plot)
    def drawn(*given: P.args, **named: P.kwargs) -> Drawn:
        found = plot(*given, **named)
        figure = found.get_figure(root=True)
        if figure is not None:
            text_where_no_math(figure)
        return found

    return drawn


def text_where_no_math(figure: "Figure") -> None:
    """Let labels between dollars that are no valid mathtext be drawn as the text they are."""
    from matplotlib.mathtext import MathTextParser
    from matplotlib.text import Text

    parser = MathTextParser("path")
    for text in figure.findobj(Text):
        assert isinstance(text, Text)
        if text.get_text().count("$") < 2:
            continue
        try:
            parser.parse(text.get_text())
        except ValueError:
            text.set_parse_math(False)


def whole_numbers() -> Any:
    """A locator of ticks at whole numbers."""
    from matplotlib.ticker import MaxNLocator

    return MaxNLocator(integer=True)
