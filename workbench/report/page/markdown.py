"""A page as Markdown, and its tables as CSV with full precision."""

import csv
import io
from typing import Any

from workbench.report.page.blocks import Html, Note, Table, number
from workbench.report.page.content import Content
from workbench.system.spreadsheet import spreadsheet_cell

__all__ = ["csv_text", "markdown_text"]

MOST_ROWS = 30  # of a table in Markdown; its CSV has all


def markdown_text(content: Content) -> str:
    """The page as Markdown: sentences and tables, no figures."""
    lines = [f"# {content.title}", "", content.question, ""]
    lines += [f"> **Not finished.** {content.running}", ""] if content.running else []
    lines += [f"> **Out of date.** {content.outdated}.", ""] if content.outdated else []
    for card in content.cards:
        lines += [f"**{card.question}** {card.answer}  ", card.detail, ""]
    for section in content.sections:
        lines += [f"## {section.title}", "", " ".join(section.sentences), ""]
        for block in section.blocks:
            if isinstance(block, Note):
                lines += [f"> {block.text}", ""]
            elif isinstance(block, Html):
                lines += [block.text, ""]
            elif isinstance(block, Table):
                lines += _markdown_table(block)
            else:
                lines += [f"*{block.title}.* {block.read_off}", "", *_markdown_table(block.table)]
    for part in content.missing:
        lines += [f"*{part.title}*: not there; `{part.command}` writes it.", ""]
    return "\n".join(lines).rstrip() + "\n"


def _markdown_table(table: Table) -> list[str]:
    def line(cells: list[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"

    head = [column.shown for column in table.columns]
    numeric = table.numeric
    rows = [
        [f"**{cell}**" if k in table.marked and cell else cell for cell in row]
        for k, row in enumerate(table.cells[:MOST_ROWS])
    ]
    out = [f"**{table.title}**", "", line(head), line(["---:" if n else "---" for n in numeric])]
    out += [line(row) for row in rows]
    if len(table.rows) > MOST_ROWS:
        out += ["", f"{len(table.rows) - MOST_ROWS} more rows in `tables/{table.id}.csv`."]
    return [*out, ""]


def csv_text(table: Table) -> str:
    """The table as CSV: units in the heading, numbers with all digits."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow([column.heading for column in table.columns])
    writer.writerows([[_cell(value) for value in row] for row in table.rows])
    return file.getvalue()


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else str(spreadsheet_cell(number(value)))
