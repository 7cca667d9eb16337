"""What all stages of a study found."""

from collections.abc import Mapping
from typing import Any

from workbench.report.lines.design import design_lines
from workbench.report.lines.layout import layout_lines
from workbench.report.lines.robust import robust_lines
from workbench.report.lines.robust_layout import robust_layout_lines
from workbench.report.lines.screening import screening_lines
from workbench.report.lines.worst_case import worst_case_lines

__all__ = ["run_lines"]


def run_lines(found: Mapping[str, Any]) -> list[str]:
    """What all stages of a study found, and where the report is."""
    text = design_lines(found["design"]) if "design" in found else []
    for stage, lines in (
        ("screen", screening_lines),
        ("worst_case", worst_case_lines),
        ("layout", layout_lines),
        ("robust", robust_lines),
        ("robust_layout", robust_layout_lines),
    ):
        if stage in found:
            text += ["", *lines(found[stage])]
    return [*text, "", f"report: {found['report']}"]
