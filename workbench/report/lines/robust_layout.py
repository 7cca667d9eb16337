"""Rounds of the robust loop, and its layouts beside each other."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.requirements import requirement_text
from workbench.report.lines.tables import format_number, format_share, table_lines, unit_suffix, wrapped

__all__ = ["NONE", "STOOD", "robust_layout_lines"]

NONE = "-"  # in place of the cases that the layout of a round was made for
STOOD = "no layout was made, one was as good in all cases known as what the last was made for"


def robust_layout_lines(document: Mapping[str, Any]) -> list[str]:
    """Rounds of the loop, and the layouts beside each other."""
    unit = unit_suffix(document["unit"])
    title = f"Robust layout of {document['title']}: worst {document['response']} by true runs"
    text = wrapped(title, 79)
    head = ("round", "", "cases", "bound", "worst found", "gap")
    rows = [
        (
            str(k + 1), "", str(r["cases"] or NONE), format_number(r["bound"]), format_number(r["worst"]),
            format_share(r["gap"]),
        )
        for k, r in enumerate(document["rounds"])
    ]  # fmt: skip
    text += table_lines(head, rows)
    if any(not r["cases"] for r in document["rounds"]):
        text += wrapped(f"{NONE}: {STOOD}", 79)
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
