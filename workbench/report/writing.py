"""The report of a campaign: one self-contained HTML page, a Markdown twin, and every table as CSV.

    write_report(folder)      report.html, report.md, tables/*.csv in the campaign's folder
    report_numbers(folder)    every number of the page by section, with the keys of the runs behind it

The page loads nothing from anywhere: figures are inline SVG, styles and scripts are allowed by their hashes
under `default-src 'none'`. The same folder gives the same bytes; there is no date on the page.
"""

import csv
import hashlib
import io
from base64 import b64encode
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

from workbench.errors import StoreError
from workbench.report.page.blocks import (
    Figure,
    Html,
    Note,
    Section,
    Table,
    number,
)
from workbench.report.page.drawing import draw_svg
from workbench.report.page.folder import CampaignFolder
from workbench.report.sections.answers import answer_cards, question
from workbench.report.sections.design import design_section
from workbench.report.sections.effects import effects_section
from workbench.report.sections.findings import findings_section
from workbench.report.sections.fit import fit_section
from workbench.report.sections.layout import layout_section
from workbench.report.sections.motion import motion_section
from workbench.report.sections.profiler import profiler_section
from workbench.report.sections.reproduce import reproduce_section
from workbench.report.sections.robust import robust_section
from workbench.report.sections.robust_layout import robust_layout_section
from workbench.report.sections.runs import runs_section
from workbench.report.sections.screening import screening_section
from workbench.report.worst_case.section import further_worst_cases, worst_case_section
from workbench.system.atomic import write_text

__all__ = ["report_numbers", "write_report"]

TEMPLATE = "page.html.j2"
PAGE = Path(__file__).parent / "page"

# section -> what makes it, title and the command that writes its data; in the order of the page
SECTIONS: dict[str, tuple[Callable[[CampaignFolder], Section | None], str, str]] = {
    "findings": (findings_section, "What was found", "holdfast robust-layout"),
    "worst-case": (worst_case_section, "The worst case", "holdfast worst-case"),
    "layout": (layout_section, "The layout", "holdfast layout"),
    "robust_layout": (robust_layout_section, "Layout and worst case in turn", "holdfast robust-layout"),
    "robust": (robust_section, "Over the whole uncertainty", "holdfast robust"),
    "motion": (motion_section, "The motion", "holdfast run"),
    "screening": (screening_section, "Which parameters matter", "holdfast screen"),
    "fit": (fit_section, "How far the Kriging can be trusted", "holdfast screen"),
    "effects": (effects_section, "Main effects", "holdfast screen"),
    "profiler": (profiler_section, "Try other values", "holdfast screen"),
    "runs": (runs_section, "What ran", "holdfast run"),
    "design": (design_section, "The design", "holdfast design"),
}
# not every study has these: the page names them as missing only when the study asks for them
OPTIONAL = ("findings", "layout", "robust_layout", "robust", "motion")


def write_report(folder: Path) -> Path:
    """Write `report.html`, `report.md` and `tables/*.csv` from what the folder holds.

    Returns:
        the path of `report.html`.

    Raises:
        StudyError: `folder` is not a campaign's folder.
        StoreError: a document cannot be read, or the disk cannot be written.
    """
    folder = Path(folder)
    campaign = CampaignFolder.opened(folder)
    sections, missing = _sections(campaign)
    _write_tables(folder / "tables", sections)
    write_text(folder / "report.md", _markdown(campaign, sections, missing))
    page = folder / "report.html"
    write_text(page, _page(campaign, sections, missing))
    return page


def report_numbers(folder: Path) -> dict[str, Any]:
    """The numbers of the report: a mapping per section, under the section's id."""
    campaign = CampaignFolder.opened(Path(folder))
    sections, missing = _sections(campaign)
    return {
        "study": campaign.name,
        "question": question(campaign),
        "sections": {section.id: dict(section.numbers) for section in sections},
        "missing": [name for name, _ in missing],
    }


def _sections(campaign: CampaignFolder) -> tuple[list[Section], list[tuple[str, str]]]:
    """The sections there are data for, and title and command of the others."""
    sections, missing = [], []
    asked = campaign.lock.get("resolved", {})
    for name, (make, title, command) in SECTIONS.items():
        try:
            section = make(campaign)
            further = further_worst_cases(campaign) if name == "worst-case" else []
        except (KeyError, TypeError, IndexError, AttributeError) as exc:
            raise StoreError(
                f"the section {title!r} cannot be made from the documents in {campaign.path}: "
                f"{type(exc).__name__} {exc}. `{command}` writes them anew"
            ) from exc
        if section is not None:
            sections += [_trimmed(each) for each in (section, *further)]
        elif name not in OPTIONAL or asked.get(name):
            missing.append((title, command))
    return [*sections, reproduce_section(campaign)], missing


def _trimmed(section: Section) -> Section:
    def trim(block: Any) -> Any:
        if isinstance(block, Figure):
            return replace(block, table=block.table.trimmed)
        return block.trimmed if isinstance(block, Table) else block

    return replace(section, blocks=tuple(trim(block) for block in section.blocks))


# ---- HTML -------------------------------------------------------------------------------------------------


def _page(campaign: CampaignFolder, sections: list[Section], missing: list[tuple[str, str]]) -> str:
    from jinja2 import Environment, FileSystemLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=FileSystemLoader(PAGE),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["code"] = _code
    environment.tests["figure"] = lambda block: isinstance(block, Figure)
    environment.tests["table"] = lambda block: isinstance(block, Table)
    environment.tests["note"] = lambda block: isinstance(block, Note)
    style = (PAGE / "page.css").read_text(encoding="utf-8")
    scripts = [(PAGE / name).read_text(encoding="utf-8") for name in _scripts(sections)]
    cards = answer_cards(campaign)
    return environment.get_template(TEMPLATE).render(
        title=campaign.name,
        question=question(campaign),
        cards=cards,
        poor=[card for card in cards if card.level == "poor"],
        sections=sections,
        missing=missing,
        svg=lambda figure: [_svg(figure, k) for k in range(len(figure.panels))],
        markup=lambda block: Markup(block.markup),
        numeric=_numeric_columns,
        policy=_policy(style, scripts),
        style=Markup(style),
        scripts=[Markup(script) for script in scripts],
        version=str(campaign.lock.get("versions", {}).get("holdfast", "")),
        seed=campaign.lock.get("seed"),
        hash=str(campaign.lock.get("study_hash", "")),
    )


def _scripts(sections: list[Section]) -> list[str]:
    """The scripts that the blocks of the page need."""
    wanted = {block.id for section in sections for block in section.blocks if isinstance(block, Html)}
    return [f"{name}.js" for name in ("profiler", "viewer") if name in wanted]


def _policy(style: str, scripts: list[str]) -> str:
    """The content policy: nothing from anywhere, this style and these scripts, images inside the page."""
    allowed = " ".join(_digest(script) for script in scripts) or "'none'"
    return (
        f"default-src 'none'; style-src {_digest(style)}; script-src {allowed}; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _digest(text: str) -> str:
    return f"'sha256-{b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


def _svg(figure: Figure, k: int) -> Any:
    from markupsafe import Markup

    panel = figure.panels[k]
    return Markup(draw_svg(panel.draw, width=panel.width, height=panel.height, name=f"{figure.id}-{k}"))


def _code(text: str) -> Any:
    """Text with `code` between backquotes."""
    from markupsafe import Markup, escape

    parts = text.split("`")
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if k % 2 else escape(part) for k, part in enumerate(parts)
    )


def _numeric_columns(table: Table) -> list[bool]:
    """Which columns hold numbers and stand to the right."""
    columns = [[row[j] for row in table.rows if row[j] not in (None, "")] for j in range(len(table.columns))]
    return [
        bool(values) and all(isinstance(v, (int, float)) and not isinstance(v, bool) for v in values)
        for values in columns
    ]


# ---- Markdown and CSV -------------------------------------------------------------------------------------


def _markdown(campaign: CampaignFolder, sections: list[Section], missing: list[tuple[str, str]]) -> str:
    lines = [f"# {campaign.name}", "", question(campaign), ""]
    for card in answer_cards(campaign):
        lines += [f"**{card.question}** {card.answer}  ", card.detail, ""]
    for section in sections:
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
    for title, command in missing:
        lines += [f"*{title}*: not there; `{command}` writes it.", ""]
    return "\n".join(lines).rstrip() + "\n"


MOST_MARKDOWN_ROWS = 30


def _markdown_table(table: Table) -> list[str]:
    def line(cells: list[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"

    head = [column.shown for column in table.columns]
    numeric = _numeric_columns(table)
    rows = [
        [f"**{cell}**" if k in table.marked and cell else cell for cell in row]
        for k, row in enumerate(table.cells[:MOST_MARKDOWN_ROWS])
    ]
    out = [f"**{table.title}**", "", line(head), line(["---:" if n else "---" for n in numeric])]
    out += [line(row) for row in rows]
    if len(table.rows) > MOST_MARKDOWN_ROWS:
        out += ["", f"{len(table.rows) - MOST_MARKDOWN_ROWS} more rows in `tables/{table.id}.csv`."]
    return [*out, ""]


def _write_tables(folder: Path, sections: list[Section]) -> None:
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
            file = io.StringIO()
            writer = csv.writer(file, lineterminator="\n")
            writer.writerow([column.heading for column in table.columns])
            writer.writerows([[_cell(value) for value in row] for row in table.rows])
            write_text(folder / f"{table.id}.csv", file.getvalue())


def _cell(value: Any) -> str:
    if value is None:
        return ""
    return repr(value) if isinstance(value, float) else number(value)
