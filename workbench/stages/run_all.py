"""The stages of a study: design, evaluate, screen, worst case, layout, robust, robust layout, report.

A stage whose table is absent from the study is skipped. `run_all` leaves a stage alone when its document is
there and what went into it (its table, the space, the seed, the runs it read) is what it was.
"""

import json
from collections import Counter
from collections.abc import Callable, Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.campaign.failures import what_is_missing
from workbench.campaign.runs import Asked, CampaignRuns, outcome
from workbench.campaign.store import Evaluation
from workbench.campaign.thinning import spread_runs
from workbench.errors import NotEnoughRuns, StudyError
from workbench.space.groups import chosen
from workbench.space.streams import stream
from workbench.stages.design import design_from_file, design_of_kind, design_of_table
from workbench.study.worst_case_targets import targets
from workbench.system.atomic import read_json, write_json

__all__ = [
    "design",
    "evaluate",
    "layout",
    "queue_design",
    "report",
    "robust",
    "robust_layout",
    "run_all",
    "screen",
    "screening_runs",
    "worst_case",
]

FEWEST_RUNS = 3
# runs with a value that a screening and the start of a search take; of more, those that spread most
MOST_SCREENED = 500
MOST_SEARCHED = 300
FINGERPRINTS = "stages.json"


def run_all(campaign: CampaignRuns) -> dict[str, Any]:
    """All stages of the study in order; their documents by name, and the path of the report."""
    study = campaign.study
    found: dict[str, Any] = {}
    if study.has_points:
        found["design"] = design(campaign)
        found["evaluate"] = evaluate(campaign)
    for name, stage, table in (
        ("screen", screen, study.screen),
        ("worst_case", worst_case, study.worst_case),
    ):
        if table is not None:
            found[name] = _unless_current(campaign, name, table, stage)
    if study.layout is not None:
        found["layout"] = _unless_recorded(campaign, "layout", _layout_fingerprint(campaign), layout)
    if study.robust is not None:
        found["robust"] = _unless_recorded(campaign, "robust", _robust_fingerprint(campaign), robust)
    if study.robust_layout is not None:
        found["robust_layout"] = _unless_recorded(
            campaign, "robust_layout", _loop_fingerprint(campaign), robust_layout
        )
    found["report"] = str(report(campaign))
    found["failures"] = campaign.failures()
    return found


def design(campaign: CampaignRuns) -> dict[str, Any]:
    """The points to run, made once: `design.json`."""
    study = campaign.study
    table = dict(study.design or {})
    is_table = study.model["kind"] == "table"
    table.setdefault("kind", "table")
    fingerprint = _fingerprint(campaign, table, campaign.spec.version if is_table else "")
    document = read_json(campaign.folder / "design.json")
    if document is not None and _recorded(campaign, "design") == fingerprint:
        return _as_document(document)
    if is_table:
        made, rows = design_of_table(campaign, table)
    elif table["kind"] == "table":
        made, rows = design_from_file(campaign, table)
    else:
        made, rows = design_of_kind(campaign, table)
    document = {
        **made.to_dict(),
        "quality": made.quality().to_dict() if len(rows) > 1 else {},
        # as given: a table's value would not survive the way to the unit cube and back to the last bit
        "physical": [[row[name] for name in study.space.names] for row in rows],
        "run_keys": [campaign.key(study.space.canonical(row)) for row in rows],
    }
    _write(campaign, "design", document, fingerprint)
    campaign.progress.stage(
        "design", f"{len(rows)} runs of {study.space.dimension} parameters ({made.algorithm})"
    )
    return document


def queue_design(campaign: CampaignRuns, document: Mapping[str, Any]) -> list[Asked]:
    """Put the design's rows in the queue; those that have no answer yet. A table answers its rows at once.

    Of a model that others run, the rows that a search waits for are given behind the design's.
    """
    if campaign.study.model["kind"] == "table":
        evaluate(campaign)
    keys = set(campaign.enqueue(_rows(campaign, document), batch="design"))
    waiting = campaign.ask()
    others = [run for run in waiting if run.key not in keys] if campaign.study.model["kind"] == "ask" else []
    return [*(run for run in waiting if run.key in keys), *others]


def evaluate(campaign: CampaignRuns) -> dict[str, Any]:
    """Run the model at every point of the design; runs that are stored are not repeated."""
    document = read_json(campaign.folder / "design.json")
    if document is None:
        raise StudyError(
            "there is no design to evaluate; give the study a [design] table or run `holdfast design`"
        )
    rows, keys = _rows(campaign, document), document["run_keys"]
    known = sum(status not in ("queued", "running") for status in campaign.store.statuses(keys).values())
    campaign.progress.stage("evaluate", f"{len(rows)} runs, {known} of them known")
    if known < len(set(keys)):
        campaign.evaluate(rows, batch="table" if campaign.study.model["kind"] == "table" else "design")
    return {"runs": len(keys), "counts": dict(Counter(campaign.store.statuses(keys).values()))}


def screening_runs(campaign: CampaignRuns) -> list[Evaluation]:
    """What screening and the worst case start from: the design and what was told, never a search's runs."""
    document = read_json(campaign.folder / "design.json") or {"run_keys": []}
    keys = dict.fromkeys(document["run_keys"])
    keys |= dict.fromkeys(row.key for row in campaign.runs() if row.batch == "told")
    return [row for row in campaign.store.rows(keys=list(keys)) if row.status not in ("queued", "running")]


def screen(campaign: CampaignRuns) -> dict[str, Any]:
    """Which parameters matter: `screening.json`."""
    table = _required(campaign.study.screen, "screen")
    response = campaign.study.response(table["response"])
    runs = _thinned(campaign, _enough(screening_runs(campaign), response.name), response.name, MOST_SCREENED)
    from workbench.screening.screen import screen as screening

    used = sum(row.status == "ok" for row in runs)
    campaign.progress.stage("screen", f"{response.name} on {used} of {len(runs)} runs")
    result = screening(
        [outcome(row) for row in runs],
        campaign.study.space,
        response,
        method=table["method"],
        transform=table["transform"],
        seed=campaign.study.seed,
        **chosen(table),
    )
    document = result.to_dict()
    _write(campaign, "screen", document, _stage_fingerprint(campaign, table), file="screening.json")
    return _as_document(document)


def worst_case(campaign: CampaignRuns) -> dict[str, Any]:
    """The worst case, confirmed by true runs where the model can be run: `worst_case.json`."""
    table = _required(campaign.study.worst_case, "worst_case")
    from workbench.stages.worst_case import worst_case_document

    wanted = targets(campaign.study)
    reads = dict.fromkeys(name for target in wanted for name in target.reads)
    runs = _thinned(campaign, screening_runs(campaign), next(iter(reads)), MOST_SEARCHED)
    if campaign.study.model["kind"] == "table":
        for name in reads:
            _enough(runs, name)
    sought = ", ".join(f"{target.sense} {target.name}" for target in wanted)
    campaign.progress.stage("worst_case", f"{sought} from {len(runs)} runs")
    document = worst_case_document(campaign, table, wanted, runs)
    _write(campaign, "worst_case", document, _stage_fingerprint(campaign, table), file="worst_case.json")
    return _as_document(document)


def layout(campaign: CampaignRuns) -> dict[str, Any]:
    """The layout that holds fast, by the engine: `layout.json`. Resumes by itself."""
    from workbench.stages.layout import run_layout

    table = dict(_required(campaign.study.layout, "layout"))
    options = dict(table.pop("options", {}))
    if table.pop("scenarios", False):
        found = read_json(campaign.folder / "worst_case.json")
        if found is None:
            raise StudyError(
                "[layout] scenarios = true needs a worst case; give the study a [worst_case] table"
            )
        options["scenarios"] = [found["parameters"]]
    campaign.progress.stage("layout", f"{table['problem']} by {table['method']}")
    document = run_layout(campaign.folder, options=options, study_folder=campaign.study.folder, **table)
    _record(campaign, "layout", _layout_fingerprint(campaign))
    return document


def robust(campaign: CampaignRuns) -> dict[str, Any]:
    """Designs beside each other over the whole uncertainty, at the same points: `robust.json`."""
    from workbench.stages.robust import run_robust

    table = _required(campaign.study.robust, "robust")
    document = run_robust(campaign, table).to_dict()
    _write(campaign, "robust", document, _robust_fingerprint(campaign))
    return _as_document(document)


def robust_layout(campaign: CampaignRuns) -> dict[str, Any]:
    """The robust loop: layout and worst case in turn: `robust_layout.json`. Resumes by itself."""
    from workbench.stages.robust_layout import run_robust_layout

    table = _required(campaign.study.robust_layout, "robust_layout")
    fingerprint = _loop_fingerprint(campaign)
    document = run_robust_layout(campaign, table)
    _record(campaign, "robust_layout", fingerprint)
    return _as_document(document)


def report(campaign: CampaignRuns) -> Path:
    """Exports of all runs, and the report on what the folder holds."""
    from workbench.campaign.exports import write_all
    from workbench.report.writing import write_report

    campaign.progress.stage("report", "")
    write_all(campaign)
    return Path(write_report(campaign.folder))


def _rows(campaign: CampaignRuns, document: Mapping[str, Any]) -> list[dict[str, Any]]:
    if document["space_hash"] != campaign.study.space.hash:
        raise StudyError("the parameters changed since the design was made; `holdfast design` makes it anew")
    return [dict(zip(campaign.study.space.names, point, strict=True)) for point in document["physical"]]


def _enough(runs: list[Evaluation], response: str) -> list[Evaluation]:
    """The runs, or a refusal when their values cannot tell anything."""
    values = [row.outputs[response] for row in runs if row.status == "ok"]
    if len(values) < FEWEST_RUNS:
        raise NotEnoughRuns(
            f"{len(values)} of {len(runs)} runs gave a value, {FEWEST_RUNS} are needed: "
            f"{what_is_missing(Counter(row.status for row in runs))}"
        )
    if len(set(values)) == 1:
        raise StudyError(
            f"response {response!r} is {values[0]:g} in all {len(values)} runs; there is nothing to explain. "
            "Take another response, or parameters or wider ranges in which it changes"
        )
    return runs


def _thinned(campaign: CampaignRuns, runs: list[Evaluation], response: str, most: int) -> list[Evaluation]:
    """The runs, or of very many those that spread most over the box; it is said when some are left out."""
    if sum(row.status == "ok" for row in runs) <= most:
        return runs
    chosen = spread_runs(
        campaign.study.space, runs, response, most=most, rng=stream(campaign.study.seed, "thinning")
    )
    campaign.progress.note(f"{len(chosen)} of {len(runs)} runs are used: those that spread most over the box")
    return chosen


def _required(table: Mapping[str, Any] | None, name: str) -> Mapping[str, Any]:
    if table is None:
        raise StudyError(f"the study has no [{name}] table; add one, such as [{name}] response = ...")
    return table


def _unless_current(
    campaign: CampaignRuns,
    name: str,
    table: Mapping[str, Any],
    stage: Callable[[CampaignRuns], dict[str, Any]],
) -> dict[str, Any]:
    file = {"screen": "screening.json"}.get(name, f"{name}.json")
    document = read_json(campaign.folder / file)
    if document is not None and _recorded(campaign, name) == _stage_fingerprint(campaign, table):
        campaign.progress.stage(name, "up to date")
        return _as_document(document)
    return stage(campaign)


def _unless_recorded(
    campaign: CampaignRuns, name: str, fingerprint: str, stage: Callable[[CampaignRuns], dict[str, Any]]
) -> dict[str, Any]:
    document = read_json(campaign.folder / f"{name}.json")
    if document is not None and _recorded(campaign, name) == fingerprint:
        campaign.progress.stage(name, "up to date")
        return _as_document(document)
    return stage(campaign)


def _layout_fingerprint(campaign: CampaignRuns) -> str:
    table = campaign.study.layout or {}
    found = read_json(campaign.folder / "worst_case.json") if table.get("scenarios") else None
    return _fingerprint(
        campaign, table, json.dumps(None if found is None else found["parameters"], sort_keys=True)
    )


def _robust_fingerprint(campaign: CampaignRuns) -> str:
    # a document that compared designs in different scenarios is not up to date
    return _fingerprint(campaign, campaign.study.robust or {}, "common scenarios")


def _loop_fingerprint(campaign: CampaignRuns) -> str:
    from workbench.stages.robust_layout import model_identity

    table = campaign.study.robust_layout or {}
    found = read_json(campaign.folder / "worst_case.json") if table.get("start") == "worst_case" else None
    given = [model_identity(campaign, table), None if found is None else found["parameters"]]
    return _fingerprint(campaign, table, json.dumps(given, sort_keys=True))


def _stage_fingerprint(campaign: CampaignRuns, table: Mapping[str, Any]) -> str:
    rows = [[row.key, row.status, row.outputs] for row in screening_runs(campaign)]
    if "responses" in table:
        table = {**table, "responses": list(table["responses"].items())}  # their order decides
    return _fingerprint(campaign, table, json.dumps(rows))


def _fingerprint(campaign: CampaignRuns, table: Mapping[str, Any], data: str) -> str:
    """A digest of everything that a stage's document depends on."""
    spec = campaign.spec
    parts = [dict(table), campaign.study.seed, campaign.study.space.hash, spec.identity, spec.version, data]
    return blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=16).hexdigest()


def _recorded(campaign: CampaignRuns, stage: str) -> str | None:
    return (read_json(campaign.folder / FINGERPRINTS) or {}).get(stage)


def _write(
    campaign: CampaignRuns,
    stage: str,
    document: Mapping[str, Any],
    fingerprint: str,
    *,
    file: str | None = None,
) -> None:
    write_json(campaign.folder / (file or f"{stage}.json"), document)
    _record(campaign, stage, fingerprint)


def _record(campaign: CampaignRuns, stage: str, fingerprint: str) -> None:
    known = read_json(campaign.folder / FINGERPRINTS) or {}
    write_json(campaign.folder / FINGERPRINTS, {**known, stage: fingerprint})


def _as_document(data: Any) -> dict[str, Any]:
    return dict(data)
