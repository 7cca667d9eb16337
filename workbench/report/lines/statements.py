"""Statements on a worst case that the terminal and the page make in the same words."""

from collections.abc import Mapping, Sequence
from typing import Any

from workbench.report.lines.tables import format_number, unit_suffix

__all__ = ["limits_text", "quantile_text"]


def limits_text(limits: Mapping[str, Sequence[float | None]]) -> str:
    """What keeps to its limits, as a person says it.

    >>> limits_text({"travel": [None, 0.6], "load": [1.0, 2.0]})
    'travel <= 0.6 and 1 <= load <= 2'
    """
    parts = []
    for name, (low, high) in limits.items():
        left = "" if low is None else f"{format_number(low)} <= "
        parts.append(left + name + ("" if high is None else f" <= {format_number(high)}"))
    return " and ".join(parts)


def quantile_text(quantile: Mapping[str, Any]) -> str:
    """What is exceeded with a small chance only, in a sentence without its full stop."""
    unit = unit_suffix(quantile["unit"])
    side = "above" if quantile["sense"] == "max" else "below"
    return (
        f"in {100 * (1 - quantile['share']):.3g} % of all cases {quantile['response']} lies {side} "
        f"{format_number(quantile['value'])}{unit} (between {format_number(quantile['lower'])} and "
        f"{format_number(quantile['upper'])}{unit}, by the Kriging of "
        f"{quantile['known'] + quantile['evaluations']} runs)"
    )
