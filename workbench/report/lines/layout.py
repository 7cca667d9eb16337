"""The layout found and what to judge it by."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.tables import format_number, unit_suffix

__all__ = ["layout_lines"]


def layout_lines(document: Mapping[str, Any]) -> list[str]:
    """The layout found and what to judge it by."""
    unit = unit_suffix(document["unit"])
    start, value = format_number(document["start_value"], 6), format_number(document["value"], 6)
    text = [
        f"Layout of {document['title'] or document['problem']}: {document['response']} "
        f"{start} -> {value}{unit}"
    ]
    text.append(f"  {document['evaluations']} evaluations by {document['method']}: {document['status']}")
    for budget in document["budgets"]:
        price = format_number(document["shadow_prices"].get(budget["name"]), 4)
        used, limit = format_number(budget["used"]), format_number(budget["limit"])
        text.append(f"  {budget['name']}: {used} of {limit} used, shadow price {price}")
    for limit in document.get("limits") or ():
        side = "at most" if limit["upper"] else "at least"
        worst, bound = format_number(limit["value"]), format_number(limit["bound"])
        price = format_number(limit["price"], 4)
        text.append(f"  {limit['name']}: {worst}, {side} {bound}{unit_suffix(limit['unit'])}, price {price}")
    if document.get("purified"):
        value = format_number(document["purified"].get("value"), 6)
        loss = format_number(document["purified"]["loss"], 3)
        text.append(f"  with few fractional members: {value}{unit} (loss {loss})")
    if document.get("whole"):
        text += [f"  {said}" for said in document["whole"]["verdicts"]]
    return text
