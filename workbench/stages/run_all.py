"""All stages of a study, or one of them: design, evaluate, screen, worst case, layout, robust, report.

A stage whose table is absent from the study is skipped. `run_all` leaves a stage alone when its document is
there and what went into it (its table, the space, the seed, the runs it read) is what it was.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench.campaign.exports import write_all
from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.errors import StudyError
from workbench.stages.design import design_table, evaluate
from workbench.stages.table import STAGES, Stage, asked_stages, stage_named
from workbench.stages.up_to_date import current_document, fingerprint, record_fingerprint

__all__ = ["report", "run_all", "run_lines", "run_stage"]


def run_all(campaign: CampaignRuns) -> dict[str, Any]:
    """All stages of the study in order; their documents by name, and the path of the report."""
    found: dict[str, Any] = {}
    if campaign.study.has_points:
        found["design"] = run_stage(campaign, "design")
        found["evaluate"] = evaluate(campaign)
    for stage in asked_stages(campaign.study):
        if stage.name != "design":
            found[stage.name] = _unless_current(campaign, stage)
    found["report"] = str(report(campaign))
    found["failures"] = campaign.failures()
    return found


def run_stage(campaign: CampaignRuns, name: str) -> dict[str, Any]:
    """One stage, though its document may be there; the document. A design that is there is not made anew.

    Raises:
        StudyError: the study has no table for it, or the table does not fit the study.
    """
    stage = stage_named(name)
    digest = _digest(campaign, stage)
    if name == "design":
        stored = current_document(campaign, name, stage.document, digest)
        if stored is not None:
            return stored
    return _run(campaign, stage, digest)


def run_lines(found: Mapping[str, Any]) -> list[str]:
    """What all stages of a study found, for a terminal, and where the report is."""
    text: list[str] = []
    for stage in STAGES:
        if stage.name in found:
            text += [*([] if stage.name == "design" else [""]), *stage.work.lines(found[stage.name])]
    return [*text, "", f"report: {found['report']}"]


def report(campaign: StoredRuns, *, folder: Path | None = None) -> Path:
    """Exports of all runs, and the report on what the campaign's folder holds; its path.

    `folder`: where they are written, the campaign's own by default.
    """
    from workbench.report.writing import write_report  # draws: matplotlib is loaded when it is needed

    campaign.progress.stage("report", "")
    write_all(campaign, folder=folder)
    return write_report(campaign.folder, into=folder)


def _unless_current(campaign: CampaignRuns, stage: Stage) -> dict[str, Any]:
    digest = _digest(campaign, stage)
    stored = current_document(campaign, stage.name, stage.document, digest)
    if stored is None:
        return _run(campaign, stage, digest)
    campaign.progress.stage(stage.name, "up to date")
    return stored


def _run(campaign: CampaignRuns, stage: Stage, digest: str) -> dict[str, Any]:
    document = stage.work.run(campaign, _table(campaign, stage))
    record_fingerprint(campaign, stage.name, digest)
    return document


def _digest(campaign: CampaignRuns, stage: Stage) -> str:
    table = _table(campaign, stage)
    return fingerprint(campaign, table, stage.work.inputs(campaign, table))


def _table(campaign: CampaignRuns, stage: Stage) -> Mapping[str, Any]:
    if stage.name == "design":
        return design_table(campaign.study)
    table: Mapping[str, Any] | None = getattr(campaign.study, stage.name)
    if table is None:
        raise StudyError(
            f"the study has no [{stage.name}] table; add one, such as [{stage.name}] response = ..."
        )
    return table
