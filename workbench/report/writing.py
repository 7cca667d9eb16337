"""The report of a campaign: one self-contained HTML page, a Markdown twin, and every table as CSV.

    write_report(folder)      report.html, report.md, tables/*.csv in the campaign's folder
    report_numbers(folder)    every number of the page by section, with the keys of the runs behind it

The page loads nothing from anywhere: figures are inline SVG, styles and scripts are allowed by their hashes
under `default-src 'none'`. The same folder gives the same bytes; there is no date on the page.
"""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from workbench.errors import StoreError
from workbench.report.contents import page_content
from workbench.report.page.blocks import Section
from workbench.report.page.html import html_text
from workbench.report.page.markdown import csv_text, markdown_text
from workbench.report.page.run_list import RunList
from workbench.system.atomic import write_text

__all__ = ["report_numbers", "write_report"]


def write_report(
    folder: Path, *, into: Path | None = None, runs: RunList | None = None, outdated: str = ""
) -> Path:
    """Write `report.html`, `report.md` and `tables/*.csv` from what the folder holds.

    `into`: the folder they are written into, by default the same.    `runs`: the runs of the folder as they
    were read just now; without them they are read.    `outdated`: a sentence on documents that were made
    before the study changed.

    Returns:
        the path of `report.html`.

    Raises:
        StudyError: `folder` is not a campaign's folder.
        StoreError: a document cannot be read, or the disk cannot be written.
    """
    folder = Path(folder)
    content = replace(page_content(folder, runs=runs), outdated=outdated)
    place = folder if into is None else Path(into)
    _write_tables(place / "tables", content.sections)
    write_text(place / "report.md", markdown_text(content))
    page = place / "report.html"
    write_text(page, html_text(content))
    return page


def report_numbers(folder: Path) -> dict[str, Any]:
    """The numbers of the report: a mapping per section, under the section's id."""
    content = page_content(Path(folder))
    return {
        "study": content.title,
        "question": content.question,
        "sections": {section.id: dict(section.numbers) for section in content.sections},
        "missing": [part.title for part in content.missing],
    }


def _write_tables(folder: Path, sections: Sequence[Section]) -> None:
    """One CSV per table with full precision, units in the heading; CSVs of an older report are removed."""
    try:
        folder.mkdir(exist_ok=True)
        kept = {f"{table.id}.csv" for section in sections for table in section.tables}
        for old in folder.glob("*.csv"):
            if old.name not in kept:
                old.unlink()
    except OSError as exc:
        raise StoreError(f"cannot write {folder}: {exc.strerror or exc}") from exc
    for section in sections:
        for table in section.tables:
            write_text(folder / f"{table.id}.csv", csv_text(table))
