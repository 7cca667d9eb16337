"""The sections of a page in their order: one table, and what a campaign's folder gives for each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from workbench.errors import StoreError
from workbench.report.histories.section import histories_section
from workbench.report.layout.bill import bill_section
from workbench.report.layout.section import layout_section
from workbench.report.page.blocks import Figure, Section, Table
from workbench.report.page.content import Content, Missing
from workbench.report.page.folder import CampaignFolder
from workbench.report.page.run_list import RunList
from workbench.report.sections.answers import answer_cards, question
from workbench.report.sections.design import design_section
from workbench.report.sections.effects import effects_section
from workbench.report.sections.findings import findings_section
from workbench.report.sections.fit import fit_section
from workbench.report.sections.motion import motion_section
from workbench.report.sections.profiler import profiler_section
from workbench.report.sections.reproduce import reproduce_section
from workbench.report.sections.robust import robust_section
from workbench.report.sections.robust_layout import robust_layout_section
from workbench.report.sections.runs import runs_section
from workbench.report.sections.screening import screening_section
from workbench.report.sections.sensitivity import sensitivity_section
from workbench.report.worst_case.section import further_worst_cases, worst_case_section

__all__ = ["DOCUMENTS", "ENTRIES", "Entry", "page_content"]

Make = Callable[[CampaignFolder], Section | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """One section of the page.

    make: the section, None without data.    command: what writes its data.
    document: whose data it shows, without ".json"; None for the runs.
    table: of the study file; where the study has it and the data are not there, the page says so. A section
    with neither a `table` nor `always` is missed by nobody.
    further: sections that follow it, such as one per other response.
    """

    title: str
    make: Make
    command: str
    document: str | None
    table: str | None = None
    always: bool = False
    further: Callable[[CampaignFolder], Sequence[Section]] | None = None


ENTRIES = (
    Entry(
        title="What was found", make=findings_section, document="robust_layout",
        command="holdfast robust-layout",
    ),
    Entry(
        title="The worst case", make=worst_case_section, document="worst_case", always=True,
        further=further_worst_cases, command="holdfast worst-case",
    ),
    Entry(
        title="The layout", make=layout_section, document="layout", table="layout", command="holdfast layout"
    ),
    Entry(
        title="The bill of materials", make=bill_section, document="bill_of_materials",
        command="holdfast layout",
    ),
    Entry(
        title="Layout and worst case in turn", make=robust_layout_section, document="robust_layout",
        table="robust_layout", command="holdfast robust-layout",
    ),
    Entry(
        title="Over the whole uncertainty", make=robust_section, document="robust", table="robust",
        command="holdfast robust",
    ),
    Entry(title="The motion", make=motion_section, document="motion", command="holdfast run"),
    Entry(
        title="Which parameters matter", make=screening_section, document="screening", always=True,
        command="holdfast screen",
    ),
    Entry(
        title="How far the Kriging can be trusted", make=fit_section, document="screening", always=True,
        command="holdfast screen",
    ),
    Entry(
        title="Main effects", make=effects_section, document="screening", always=True,
        command="holdfast screen",
    ),
    Entry(
        title="Indices by other methods", make=sensitivity_section, document="sensitivity",
        command="holdfast screen --method",
    ),
    Entry(
        title="Try other values", make=profiler_section, document="screening", always=True,
        command="holdfast screen",
    ),
    Entry(title="Over time", make=histories_section, document=None, command="holdfast run"),
    Entry(title="What ran", make=runs_section, document=None, always=True, command="holdfast run"),
    Entry(title="The design", make=design_section, document="design", always=True, command="holdfast design"),
)  # fmt: skip

# what the page reads of a campaign's folder, without ".json"
DOCUMENTS = tuple(dict.fromkeys(entry.document for entry in ENTRIES if entry.document is not None))


def page_content(folder: Path, *, runs: RunList | None = None) -> Content:
    """What the page shows of a campaign's folder; `runs`: see `CampaignFolder.opened`.

    Raises:
        StudyError: `folder` is not a campaign's folder.
        StoreError: a document cannot be read, or a section cannot be made from it.
    """
    campaign = CampaignFolder.opened(folder, documents=DOCUMENTS, runs=runs)
    sections: list[Section] = []
    missing = []
    asked = campaign.lock.get("resolved", {})
    for entry in ENTRIES:
        found = [_trimmed(section) for section in _made(entry, campaign)]
        sections += found
        if not found and (entry.always or (entry.table is not None and asked.get(entry.table))):
            missing.append(Missing(title=entry.title, command=entry.command))
    return Content(
        title=campaign.name,
        question=question(campaign),
        cards=answer_cards(campaign),
        sections=[*sections, reproduce_section(campaign)],
        missing=missing,
        version=str(campaign.lock.get("versions", {}).get("holdfast", "")),
        seed=campaign.lock.get("seed"),
        study_hash=str(campaign.lock.get("study_hash", "")),
        running=campaign.running,
    )


def _made(entry: Entry, campaign: CampaignFolder) -> list[Section]:
    """The section and those that follow it; none without data."""
    try:
        section = entry.make(campaign)
        further = [] if section is None or entry.further is None else entry.further(campaign)
    except (KeyError, TypeError, IndexError, AttributeError) as exc:
        raise StoreError(
            f"the section {entry.title!r} cannot be made from the documents in {campaign.path}: "
            f"{type(exc).__name__} {exc}. `{entry.command}` writes them anew"
        ) from exc
    return [] if section is None else [section, *further]


def _trimmed(section: Section) -> Section:
    def trim(block: Any) -> Any:
        if isinstance(block, Figure):
            return replace(block, table=block.table.trimmed)
        return block.trimmed if isinstance(block, Table) else block

    return replace(section, blocks=tuple(trim(block) for block in section.blocks))
