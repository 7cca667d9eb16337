"""All stages of a study, or one of them: design, evaluate, screen, worst case, layout, robust, report.

A stage whose table is absent from the study is skipped. `run_all` leaves a stage alone when its document is
there and what went into it (its table, the space, the seed, the runs it read) is what it was.
"""

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from workbench.campaign.results.exports import write_all
from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns, as_of
from workbench.errors import StudyError
from workbench.models.stored.evaluation import UNFINISHED
from workbench.sampling.stored import MOST_ROWS, ROWS, design_head, design_keys
from workbench.stages.design import design_table, evaluate
from workbench.stages.table import STAGES, Stage, asked_stages, stage_named
from workbench.stages.up_to_date import (
    current_document,
    fingerprint,
    is_outdated,
    record_fingerprint,
    record_settled,
    settled,
)

__all__ = [
    "in_study_order",
    "outdated_sentence",
    "report",
    "run_all",
    "run_lines",
    "run_stage",
    "stage_digest",
    "take_table",
]


def run_all(campaign: CampaignRuns) -> dict[str, Any]:
    """All stages of the study in order; their documents by name, and the path of the report."""
    known = settled(campaign)
    if known is not None:
        campaign.progress.stage("report", "up to date, like every stage before it")
        names = campaign.study.space.names
        return {part: in_study_order(found, names) for part, found in known.items()}
    found: dict[str, Any] = {}
    if campaign.study.has_points:
        found["design"] = _design(campaign)
        found["evaluate"] = evaluate(campaign)
    for stage in asked_stages(campaign.study):
        if stage.name != "design":
            found[stage.name] = _unless_current(campaign, stage)
    found["report"] = str(report(campaign))
    found["failures"] = campaign.failures()
    record_settled(campaign, found)
    return found


def _design(campaign: CampaignRuns) -> dict[str, Any]:
    """The document of the design; of a very large one without its points, which stand in `design.json`."""
    document = run_stage(campaign, "design")
    if document["n"] <= MOST_ROWS:
        return document
    return {name: value for name, value in document.items() if name not in ROWS} | {"rows_in": "design.json"}


def run_stage(campaign: CampaignRuns, name: str) -> dict[str, Any]:
    """One stage, though its document may be there; the document. A design that is there is not made anew.

    Of a very large design the document comes without its rows.

    Raises:
        StudyError: the study has no table for it, or the table does not fit the study.
    """
    stage = stage_named(name)
    if name != "design":
        _table(campaign, stage)
        take_table(campaign)
    digest = stage_digest(campaign, stage)
    if name == "design":
        stored = current_document(campaign, stage, digest, read=design_head)
        if stored is not None:
            return stored
    return _run(campaign, stage, digest)


def take_table(campaign: CampaignRuns) -> None:
    """Have the rows of a table of runs in the store, as `run_all` begins; of another model nothing is done.

    Reading a table costs nothing, so no stage has to be preceded by another to know them.
    """
    if campaign.study.model["kind"] != "table":
        return
    run_stage(campaign, "design")
    keys = design_keys(campaign.folder / "design.json") or []
    known = campaign.store.statuses(keys)
    if len(known) < len(set(keys)) or not set(UNFINISHED).isdisjoint(known.values()):
        evaluate(campaign)


def run_lines(found: Mapping[str, Any]) -> list[str]:
    """What all stages of a study found, for a terminal, and where the report is."""
    text: list[str] = []
    for stage in STAGES:
        if stage.name in found:
            text += [*([] if stage.name == "design" else [""]), *stage.work.lines(found[stage.name])]
    return [*text, "", f"report: {found['report']}"]


def outdated_sentence(campaign: StoredRuns) -> str:
    """Which documents were made before the study, its model or its runs changed, and what to do; "" where
    none was, or somebody works on them."""
    if as_of(campaign.store).holder is not None:
        return ""
    old = [
        stage.command
        for stage in asked_stages(campaign.study)
        if is_outdated(campaign, stage, partial(stage_digest, campaign, stage))
    ]
    if not old:
        return ""
    it = "it" if len(old) == 1 else "them"
    return (
        f"The study, its model or its runs changed since {' and '.join(old)} ran: what is told of {it}, and "
        f"of what rests on {it}, was found before. `holdfast run` makes it anew"
    )


def report(campaign: StoredRuns, *, folder: Path | None = None, outdated: str = "") -> Path:
    """Exports of all runs, and the report on what the campaign's folder holds; its path.

    `folder`: where they are written, the campaign's own by default.    `outdated`: see `outdated_sentence`.
    """
    from workbench.report.page.run_list import RunList
    from workbench.report.writing import write_report  # draws: matplotlib is loaded when it is needed

    campaign.progress.stage("report", "")
    spec, names = campaign.spec, campaign.study.space.names
    runs = RunList(campaign.store.path, model=(spec.identity, spec.version, *sorted(names)))
    write_all(campaign, folder=folder, beside=runs.take)  # read once: exports and report see the same
    return write_report(campaign.folder, into=folder, runs=runs, outdated=outdated)


def _unless_current(campaign: CampaignRuns, stage: Stage) -> dict[str, Any]:
    digest = stage_digest(campaign, stage)
    stored = current_document(campaign, stage, digest)
    if stored is None:
        return _run(campaign, stage, digest)
    campaign.progress.stage(stage.name, "up to date")
    document: dict[str, Any] = in_study_order(stored, campaign.study.space.names)
    return document


def _run(campaign: CampaignRuns, stage: Stage, digest: str) -> dict[str, Any]:
    document = stage.work.run(campaign, _table(campaign, stage))
    record_fingerprint(campaign, stage.name, digest)
    if stage.name == "design":  # rows in columns
        return document
    ordered: dict[str, Any] = in_study_order(document, campaign.study.space.names)
    return ordered


def in_study_order(found: Any, names: Sequence[str]) -> Any:
    """A document with the values of its `parameters` in the order of the study, wherever they stand in it.

    A file has them by the alphabet, and a run of the store as it was asked for.

    >>> in_study_order({"worst": [{"parameters": {"airbag": 0, "speed": 15}}]}, ["speed", "airbag"])
    {'worst': [{'parameters': {'speed': 15, 'airbag': 0}}]}
    """
    if isinstance(found, list | tuple):
        if not found or not isinstance(found[0], Mapping):
            return found
        return [in_study_order(part, names) for part in found]
    if not isinstance(found, Mapping):
        return found
    ordered = {key: in_study_order(part, names) for key, part in found.items()}
    values = ordered.get("parameters")
    if isinstance(values, dict):
        ordered["parameters"] = {n: values[n] for n in names if n in values} | values
    return ordered


def stage_digest(campaign: StoredRuns, stage: Stage) -> str:
    """A digest of all that decides the document of a stage."""
    table = _table(campaign, stage)
    return fingerprint(campaign, table, stage.work.inputs(campaign, table))


def _table(campaign: StoredRuns, stage: Stage) -> Mapping[str, Any]:
    if stage.name == "design":
        return design_table(campaign.study)
    table: Mapping[str, Any] | None = getattr(campaign.study, stage.name)
    if table is None:
        raise StudyError(
            f"the study has no [{stage.name}] table; add one, such as [{stage.name}] {stage.first_key} = ..."
        )
    return table
