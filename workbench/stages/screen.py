"""The stage `screen` of a study: which parameters matter, from the stored runs: `screening.json`."""

from collections.abc import Iterable, Mapping
from typing import Any

from workbench.campaign.results.functionals import functional_notes
from workbench.campaign.runs import CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.models.evaluator import response_reader
from workbench.report.lines.screening import screening_lines
from workbench.space.groups import chosen
from workbench.stages.stored_runs import refuse_without_values, runs_as_text, screening_columns, thinned
from workbench.stages.work import Work
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.system.atomic import write_json

__all__ = ["WORK", "screening_document"]

MOST_RUNS = 500  # with a value that a screening takes; of more, those that spread most


def screening_document(campaign: StoredRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """What the table `screen` finds in the stored runs; nothing is written."""
    from workbench.screening.kriging import screen

    study = campaign.study
    response = study.target(table["response"])
    stored = screening_columns(campaign, {response.name: response_reader(response.name)})
    refuse_without_values(campaign, response.name, stored.values[response.name][stored.is_ok], stored.counts)
    runs = stored.at(thinned(campaign, stored, response.name, most=MOST_RUNS))
    used = sum(row.status == "ok" for row in runs)
    campaign.progress.stage("screen", f"{response.name} on {used} of {len(runs)} runs")
    return screen(
        [row.as_outcome() for row in runs],
        study.space,
        response,
        method=table["method"],
        transform=table.get("transform"),
        regimes=table.get("regimes", "auto"),
        seed=study.seed,
        **chosen(table),
    ).to_dict() | functional_notes(campaign, [response.name])


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    document = screening_document(campaign, table)
    write_json(campaign.folder / "screening.json", document)
    return document


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> Iterable[str]:
    return runs_as_text(campaign)


def _check(study: Study) -> None:
    """The method is one of those that there are."""
    from workbench.screening.kriging import checked_method

    with placed(study.text, study.where, ("screen", "method")):
        checked_method((study.screen or {})["method"])


WORK = Work(run=_run, inputs=_inputs, lines=screening_lines, check=_check)
