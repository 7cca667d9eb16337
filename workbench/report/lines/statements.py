"""Statements on a screening and a worst case that the terminal and the page make in the same words."""

from collections.abc import Mapping, Sequence
from typing import Any

from workbench.report.lines.tables import format_number, unit_suffix

__all__ = ["limits_text", "open_text", "quantile_text", "screening_state", "state_text"]


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


def screening_state(screening: Mapping[str, Any]) -> str:
    """The state of a screening document, "" where it has none."""
    if state := screening.get("state"):
        return str(state)
    resolved = (screening.get("diagnosis") or {}).get("resolved")
    return "" if resolved is None else "resolved" if resolved else "not resolved"


def open_text(screening: Mapping[str, Any]) -> str:
    """Which selected parameters are open, with the most that each can do; "" where none is.

    >>> open_text({"diagnosis": {"open": ["grip"], "open_share": 0.034}})
    'Whether grip acts is open: at most 3.4 % of the variance.'
    """
    diagnosis = screening.get("diagnosis") or {}
    names = diagnosis.get("open") or []
    if not names:
        return ""
    act, each = ("act", "each ") if len(names) > 1 else ("acts", "")
    share = f"{max(100.0 * float(diagnosis['open_share']), 0.1):.2g} %"
    return f"Whether {' and '.join(names)} {act} is open: {each}at most {share} of the variance."


def state_text(screening: Mapping[str, Any]) -> str:
    """The state with its number.

    >>> state_text({"state": "partly resolved", "hidden_share": 0.034})
    'partly resolved, down to 3.4 % of the variance'
    >>> state_text({"state": "not resolved", "hidden_share": 0.6})
    'not resolved'
    """
    state, share = screening_state(screening), screening.get("hidden_share")
    if state not in ("resolved", "partly resolved") or share is None:
        return state
    return f"{state}, down to {max(100.0 * float(share), 0.1):.2g} % of the variance"
