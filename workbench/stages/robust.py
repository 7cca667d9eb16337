"""The stage `robust` of a study: designs at the same points of the uncertainty: `robust.json`."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.models.evaluator import Evaluator, Outcome
from workbench.report.claims import known_values, refuse_contradictions, robust_claims
from workbench.report.lines.robust import robust_lines
from workbench.robust.re_evaluation import ReEvaluation, re_evaluate
from workbench.stages.work import Work
from workbench.study.record import Study
from workbench.study.robust_table import comparison_of
from workbench.system.atomic import write_json

__all__ = ["WORK"]


def _compared(campaign: CampaignRuns, table: Mapping[str, Any]) -> ReEvaluation:
    """Run the comparison of `[robust]`; runs that the store knows are not repeated.

    Raises:
        StudyError: a design does not fit the study.
        NotEnoughRuns: fewer than 10 scenarios in which every design gave a value.
    """
    study = campaign.study
    response, asked = study.response(table["response"]), comparison_of(study.space, table)
    names = ", ".join(asked.designs)
    campaign.progress.stage(
        "robust", f"{names} at {table['samples']} points of {asked.uncertainty.dimension} parameters"
    )
    result = re_evaluate(
        lambda design, u: None,
        asked.designs,
        asked.uncertainty,
        response=response.name,
        unit=response.unit,
        sense=table["sense"],
        samples=table["samples"],
        seed=study.seed,
        limit=table.get("limit"),
        screened=table.get("screened", 0),
        evaluators={name: _with_values(campaign, values) for name, values in asked.designs.items()},
        constraints=asked.constraints,
        nominal=asked.nominal,
    )
    if asked.no_nominal is None:
        return result
    return replace(result, warnings=(*result.warnings, asked.no_nominal))


def _with_values(campaign: CampaignRuns, values: Mapping[str, Any]) -> Evaluator:
    """Runs of uncertain rows with the design's values put in."""

    def evaluate(rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
        asked = [{**row, **values} for row in rows]
        return [row.as_outcome() for row in campaign.evaluate(asked, batch="robust", quiet=True)]

    return evaluate


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    document = _compared(campaign, table).to_dict()
    for claim, design in zip(robust_claims(document), document["designs"], strict=True):
        refuse_contradictions(claim, known_values(document, design))
    write_json(campaign.folder / "robust.json", document)
    return document


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> Iterable[str]:
    return ["common scenarios"]  # a document that compared designs in different scenarios is not up to date


def _planned_runs(study: Study, folder: Path) -> int:
    table = study.robust or {}
    at_nominal = comparison_of(study.space, table).nominal is not None
    return int(len(table["design"]) * (table["samples"] + at_nominal))


WORK = Work(run=_run, inputs=_inputs, lines=robust_lines, planned_runs=_planned_runs)
