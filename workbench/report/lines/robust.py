"""Designs beside each other over the uncertainty."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.tables import format_number, table_lines, unit_suffix, wrapped

__all__ = ["robust_lines"]


def robust_lines(document: Mapping[str, Any]) -> list[str]:
    """The designs beside each other, and what the failures among their runs leave open."""
    unit = unit_suffix(document["unit"]).strip()
    rows = []
    for s in document["summaries"]:
        beyond = s["beyond_limit"]
        share = "-" if beyond is None else f"{100 * beyond[0]:.3g} %"
        cells = (s["mean"], s["quantiles"]["P95"][0], s["worst"], s["largest_regret"])
        rows.append(("", s["design"], *(format_number(v) for v in cells), share, str(s["failed"])))
    head = ("", "design", "mean", "P95", "worst met", "most regret", "beyond", "failed")
    text = [f"{document['samples']} points of the uncertainty{f', {unit}' if unit else ''}"]
    text += [line.removeprefix("  ") for line in table_lines(head, rows)]  # long names wrap in second cells
    for name, (mean, low, high) in document["paired"].items():
        interval = f"(95 %: {format_number(low)} to {format_number(high)})"
        text += wrapped(f"{name}: {format_number(mean)} {interval}", 79)
    priced = [s for s in document["summaries"] if s.get("price_of_robustness") is not None]
    if len(priced) > 1:  # one design has nothing to pay for
        prices = [
            f"{s['design']} {format_number(s['nominal'])} ({format_number(s['price_of_robustness'])})"
            for s in priced
        ]
        text += wrapped(f"at nominal (price of robustness): {', '.join(prices)}", 79)
    inadmissible = document.get("inadmissible") or {}
    if any(inadmissible.values()):
        each = ", ".join(f"{name} {count}" for name, count in inadmissible.items())
        text += wrapped(f"points that break a constraint, run for no design: {each}", 79)
    if left_out := document.get("left_out"):
        text += wrapped(
            f"left out for every design: {left_out} of {document['drawn']} points, in which a run gave no "
            "value",
            79,
        )
        text += [line for s in document["summaries"] for line in _failed_lines(s, document)]
    for warning in document.get("warnings") or ():
        text += wrapped(f"note: {warning}".replace(" %", "\u00a0%"), 79)
    return text


def _failed_lines(summary: Mapping[str, Any], document: Mapping[str, Any]) -> list[str]:
    part, low, high = (100 * v for v in summary["failed_share"])
    text = f"{summary['design']} failed in {part:.3g} % (95 %: {low:.3g} to {high:.3g} %)"
    risk = summary.get("beyond_or_failed")
    if risk is not None:
        text += f"; failed or beyond {format_number(document['limit'])}: {100 * risk[0]:.3g} %"
    return [f"  {line}" for line in wrapped(text.replace(" %", "\u00a0%"), 77)]
