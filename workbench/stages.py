"""The stages of a study: design, evaluate, screen, worst case, report, each on the campaign's folder.

A stage whose table is absent from the study is skipped. `run_all` leaves a stage alone when its document is
there and what went into it (its table, the space, the seed, the runs it read) is what it was.
"""

import json
from collections import Counter
from collections.abc import Callable, Mapping
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.atomic import read_json, write_json
from workbench.campaign import Asked, Campaign, outcome
from workbench.errors import NotEnoughRuns, StudyError
from workbench.model_table import TableModel
from workbench.store import Evaluation

__all__ = [
    "design",
    "evaluate",
    "queue_design",
    "report",
    "run_all",
    "screen",
    "screening_runs",
    "worst_case",
]

FEWEST_RUNS = 3
FINGERPRINTS = "stages.json"


def run_all(campaign: Campaign) -> dict[str, Any]:
    """All stages of the study in order; their documents by name, and the path of the report."""
    study = campaign.study
    found: dict[str, Any] = {}
    if study.design is not None or study.model["kind"] == "table":
        found["design"] = design(campaign)
        found["evaluate"] = evaluate(campaign)
    for name, stage, table in (
        ("screen", screen, study.screen),
        ("worst_case", worst_case, study.worst_case),
    ):
        if table is not None:
            found[name] = _unless_current(campaign, name, table, stage)
    found["report"] = str(report(campaign))
    found["failures"] = campaign.failures()
    return found


def design(campaign: Campaign) -> dict[str, Any]:
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
        made, rows = _design_of_table(campaign, table)
    elif table["kind"] == "table":
        made, rows = _design_from_file(campaign, table)
    else:
        made, rows = _design_of_kind(campaign, table)
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


def queue_design(campaign: Campaign, document: Mapping[str, Any]) -> list[Asked]:
    """Put the design's rows in the queue; those that have no answer yet."""
    keys = set(campaign.enqueue(_rows(campaign, document), batch="design"))
    return [run for run in campaign.ask() if run.key in keys]


def evaluate(campaign: Campaign) -> dict[str, Any]:
    """Run the model at every point of the design; runs that are stored are not repeated."""
    document = read_json(campaign.folder / "design.json")
    if document is None:
        raise StudyError(
            "there is no design to evaluate; give the study a [design] table or run `holdfast design`"
        )
    rows = _rows(campaign, document)
    stored = campaign.store.rows(keys=document["run_keys"])
    known = sum(row.status not in ("queued", "running") for row in stored)
    campaign.progress.stage("evaluate", f"{len(rows)} runs, {known} of them known")
    done = campaign.evaluate(rows, batch="table" if campaign.study.model["kind"] == "table" else "design")
    return {"runs": len(done), "counts": dict(Counter(row.status for row in done))}


def screening_runs(campaign: Campaign) -> list[Evaluation]:
    """What screening and the worst case start from: the design and what was told, never a search's runs."""
    document = read_json(campaign.folder / "design.json") or {"run_keys": []}
    keys = dict.fromkeys(document["run_keys"])
    keys |= dict.fromkeys(row.key for row in campaign.runs() if row.batch == "told")
    return [row for row in campaign.store.rows(keys=list(keys)) if row.status not in ("queued", "running")]


def screen(campaign: Campaign) -> dict[str, Any]:
    """Which parameters matter: `screening.json`."""
    table = _required(campaign.study.screen, "screen")
    response = campaign.study.response(table["response"])
    runs = _enough(screening_runs(campaign), response.name)
    from workbench.screening import screen as screening

    used = sum(row.status == "ok" for row in runs)
    campaign.progress.stage("screen", f"{response.name} on {used} of {len(runs)} runs")
    result = screening(
        [outcome(row) for row in runs],
        campaign.study.space,
        response,
        method=table["method"],
        seed=campaign.study.seed,
    )
    document = result.to_dict()
    _write(campaign, "screen", document, _stage_fingerprint(campaign, table), file="screening.json")
    return _as_document(document)


def worst_case(campaign: Campaign) -> dict[str, Any]:
    """The worst case, confirmed by true runs where the model can be run: `worst_case.json`."""
    study = campaign.study
    table = _required(study.worst_case, "worst_case")
    from workbench.worst_case import search_worst_case, surrogate_worst_case

    response = study.response(table["response"])
    runs = screening_runs(campaign)
    start = [outcome(row) for row in runs]
    campaign.progress.stage("worst_case", f"{table['sense']} {response.name} from {len(runs)} runs")
    if study.model["kind"] == "table":
        _enough(runs, response.name)
        result = surrogate_worst_case(
            study.space,
            start,
            response=response.name,
            unit=response.unit,
            sense=table["sense"],
            seed=study.seed,
        )
    else:
        options = {key: table[key] for key in ("tolerance", "lipschitz") if key in table}
        result = search_worst_case(
            campaign.outcomes_of_search,
            study.space,
            response=response.name,
            unit=response.unit,
            sense=table["sense"],
            budget=table["budget"],
            seed=study.seed,
            start=start,
            workers=study.evaluate.get("workers", 1),
            progress=_search_progress(campaign, response.name, response.unit, table["budget"]),
            **options,
        )
    document = result.to_dict()
    _write(campaign, "worst_case", document, _stage_fingerprint(campaign, table), file="worst_case.json")
    return _as_document(document)


def report(campaign: Campaign) -> Path:
    """Exports of all runs, and the report on what the folder holds."""
    from workbench.exports import write_csv, write_netcdf
    from workbench.report import write_report

    study = campaign.study
    campaign.progress.stage("report", "")
    write_csv(campaign.folder / "runs.csv", campaign.runs(), study.space, study.responses)
    write_netcdf(campaign.folder / "results.nc", campaign.results())
    return Path(write_report(campaign.folder))


def _design_of_table(campaign: Campaign, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    """The design that a table of runs is."""
    if table["kind"] != "table":
        raise StudyError(
            f"design kind {table['kind']!r} needs a model that can be run; a table has its runs: leave it out"
        )
    model = TableModel.opened(campaign.spec)
    return _given_design(campaign, model.inputs, table, str(campaign.study.model["file"]))


def _design_from_file(campaign: Campaign, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    """The design in a CSV of parameters."""
    from workbench.model_table import read_table

    if "file" not in table:
        raise StudyError("design kind 'table' needs file, a CSV with a column per parameter")
    space = campaign.study.space
    words = [p.name for p in space.parameters if not p.is_numeric]
    rows = read_table(campaign.study.folder / table["file"], space.names, (), words=words)
    return _given_design(campaign, rows, table, table["file"])


def _given_design(
    campaign: Campaign, rows: list[dict[str, Any]], table: Mapping[str, Any], file: str
) -> tuple[Any, list[dict[str, Any]]]:
    from workbench.design import Design, run_ids

    space = campaign.study.space
    wanted = table.get("runs", len(rows))
    if wanted > len(rows):
        raise StudyError(f"[design] runs = {wanted}, but the table {file} offers {len(rows)} rows")
    chosen = []
    for k, row in enumerate(rows[:wanted]):
        try:
            chosen.append(space.canonical(row))
        except StudyError as exc:
            raise StudyError(f"{file}, row {k + 1}: {exc}. Widen the bounds or leave the row out") from None
    made = Design(
        space=space,
        unit=space.unit(chosen),
        run_ids=run_ids(len(chosen)),
        algorithm="table",
        options={"file": file},
        seed=campaign.study.seed,
    )
    return made, chosen


def _design_of_kind(campaign: Campaign, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    from workbench.design import DesignOptions, make_design

    options = {k: v for k, v in table.items() if k not in ("kind", "runs", "file")}
    made = make_design(
        campaign.study.space,
        table["kind"],
        table.get("runs"),
        seed=campaign.study.seed,
        options=DesignOptions(**options),
    )
    return made, made.rows()


def _rows(campaign: Campaign, document: Mapping[str, Any]) -> list[dict[str, Any]]:
    if document["space_hash"] != campaign.study.space.hash:
        raise StudyError("the parameters changed since the design was made; `holdfast design` makes it anew")
    return [dict(zip(campaign.study.space.names, point, strict=True)) for point in document["physical"]]


def _enough(runs: list[Evaluation], response: str) -> list[Evaluation]:
    """The runs, or a refusal when their values cannot tell anything."""
    values = [row.outputs[response] for row in runs if row.status == "ok"]
    if len(values) < FEWEST_RUNS:
        failed = dict(Counter(row.status for row in runs if row.status != "ok"))
        raise NotEnoughRuns(
            f"{len(values)} of {len(runs)} runs gave a value, {FEWEST_RUNS} are needed; others: {failed}"
        )
    if len(set(values)) == 1:
        raise StudyError(
            f"response {response!r} is {values[0]:g} in all {len(values)} runs; there is nothing to explain"
        )
    return runs


def _required(table: Mapping[str, Any] | None, name: str) -> Mapping[str, Any]:
    if table is None:
        raise StudyError(f"the study has no [{name}] table; add one, such as [{name}] response = ...")
    return table


def _search_progress(campaign: Campaign, name: str, unit: str, budget: int) -> Callable[[Any, float], None]:
    def tell(run: Any, best: float) -> None:
        campaign.progress.search(run.number, budget, run.proposal, run.value, best, name, unit)

    return tell


def _unless_current(
    campaign: Campaign, name: str, table: Mapping[str, Any], stage: Callable[[Campaign], dict[str, Any]]
) -> dict[str, Any]:
    file = {"screen": "screening.json"}.get(name, f"{name}.json")
    document = read_json(campaign.folder / file)
    if document is not None and _recorded(campaign, name) == _stage_fingerprint(campaign, table):
        campaign.progress.stage(name, "up to date")
        return _as_document(document)
    return stage(campaign)


def _stage_fingerprint(campaign: Campaign, table: Mapping[str, Any]) -> str:
    rows = [[row.key, row.status, row.outputs] for row in screening_runs(campaign)]
    return _fingerprint(campaign, table, json.dumps(rows))


def _fingerprint(campaign: Campaign, table: Mapping[str, Any], data: str) -> str:
    """A digest of everything that a stage's document depends on."""
    spec = campaign.spec
    parts = [dict(table), campaign.study.seed, campaign.study.space.hash, spec.identity, spec.version, data]
    return blake2b(json.dumps(parts, sort_keys=True).encode(), digest_size=16).hexdigest()


def _recorded(campaign: Campaign, stage: str) -> str | None:
    return (read_json(campaign.folder / FINGERPRINTS) or {}).get(stage)


def _write(
    campaign: Campaign, stage: str, document: Mapping[str, Any], fingerprint: str, *, file: str | None = None
) -> None:
    write_json(campaign.folder / (file or f"{stage}.json"), document)
    known = read_json(campaign.folder / FINGERPRINTS) or {}
    write_json(campaign.folder / FINGERPRINTS, {**known, stage: fingerprint})


def _as_document(data: Any) -> dict[str, Any]:
    return dict(data)
