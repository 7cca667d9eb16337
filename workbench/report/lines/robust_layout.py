"""Rounds of the robust loop, and its layouts beside each other."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.requirements import requirement_text
from workbench.report.lines.tables import format_number, format_share, table_lines, unit_suffix, wrapped

__all__ = ["robust_layout_lines"]


def robust_layout_lines(document: Mapping[str, Any]) -> list[str]:
    """Rounds of the loop, and the layouts beside each other."""
    unit = unit_suffix(document["unit"])
    title = f"Robust layout of {document['title']}: worst {document['response']} by true runs"
    text = wrapped(title, 79)
    head = ("round", "", "cases", "bound", "worst found", "gap")
    rows = [
        (
            str(k + 1), "", str(r["cases"]), format_number(r["bound"]), format_number(r["worst"]),
            format_share(r["gap"]),
        )
        for k, r in enumerate(document["rounds"])
    ]  # fmt: skip
    text += table_lines(head, rows)
    text += wrapped(document["status"], 79)
    for reason in document["reasons"]:
        text += wrapped(f"amber: {reason}", 79)
    for asked in document.get("requirements", ()):
        text += ["", *wrapped(requirement_text(asked, attacked=document["response"]), 79)]
    beside = [
        (name, "", format_number(kept["worst"]), format_number(kept["nominal"]), str(kept["runs"]))
        for name, kept in document["layouts"].items()
    ]
    text += ["", *table_lines(("layout", "", f"worst{unit}", f"at nominal{unit}", "runs"), beside)]
    for variant in document["variants"]:
        worst = variant.get("failure") or f"worst {format_number(variant['worst'])}{unit}"
        text.append(f"  {variant['name']}: {worst}")
    return text
