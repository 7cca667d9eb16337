"""Is a study file usable, without running the model? And do stored runs come out as they are stored?"""

import math
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.errors import StudyError
from workbench.models.protocol import Answer, ModelSpec
from workbench.models.stored.dwarfing import dwarfing_sentence
from workbench.models.table import TableModel, table_digest
from workbench.report.lines.tables import fitted
from workbench.space.streams import stream
from workbench.space.units import counted
from workbench.stages.design import check_kind_of_table, design_table, given_rows
from workbench.stages.table import Stage, asked_stages
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.study.tables_of_runs import check_header_units, dwarfing_of

__all__ = ["check_before_runs", "check_model", "check_study", "verification_lines", "verify_runs"]

CLOSE = 1e-9  # relative difference that rounding in another order, or on another processor, may leave


def check_before_runs(study: Study, folder: Path | None) -> None:
    """What can be refused before a campaign in `folder` spends a run, as `check_study` refuses it.

    A new campaign is checked whole, but for a model on a cluster, which may not be here. One that is there
    has opened its model: of it those stages are checked that have no document yet.

    Raises:
        StudyError: as `check_study`.
    """
    place = folder or study.campaign_folder
    stages = asked_stages(study)
    if (place / "runs.sqlite").exists():
        stages = [stage for stage in stages if not (place / f"{stage.document}.json").exists()]
    else:
        _check_design_is_there(study)
        if study.evaluate.get("engine") != "dask":
            check_model(study)
    _check_stages(study, stages)


def check_study(study: Study) -> dict[str, Any]:
    """Open the model (in a process of its own when it is code) and check that the tables fit together.

    Raises:
        StudyError: the model cannot be opened, or a stage asks for what the model does not offer.
    """
    kind, stages = study.model["kind"], asked_stages(study)
    _check_design_is_there(study)
    check_model(study)
    _check_stages(study, stages)
    notes = [dwarfing_sentence(seen) for seen in dwarfing_of(study)]
    for stage in stages:
        if stage.work.notes is not None:
            notes += stage.work.notes(study)
    names = ", ".join(stage.name for stage in stages)
    d = study.space.dimension
    sizes = f"{counted(d, 'parameter')}, {counted(len(study.responses), 'response')}"
    summary = f"{sizes}, model {kind}, stages {names}"
    return {"valid": True, "summary": summary, "notes": notes, **study.to_dict()}


def _check_stages(study: Study, stages: Sequence[Stage]) -> None:
    for stage in stages:
        if stage.work.check is not None:
            stage.work.check(study)


def _check_design_is_there(study: Study) -> None:
    """Refuse a study that has nothing to run, or stages that wait for a design."""
    kind, stages = study.model["kind"], asked_stages(study)
    if (
        kind != "table"
        and study.design is None
        and (not stages or any(stage.needs_design for stage in stages))
    ):
        raise StudyError(
            "the study has no [design] table, so there is nothing to run; add one such as runs = 50"
        )


def check_model(study: Study) -> None:
    """Open the model, in a process of its own when it is code; a table is read, and nothing is run.

    Raises:
        StudyError: it cannot be opened, or a table offers fewer rows than the design wants.
    """
    if study.model["kind"] == "table":
        _check_table(study)
    elif study.model["kind"] != "ask":
        _open_elsewhere(study.spec(version=study.model["version"]))


def _check_table(study: Study) -> None:
    """The table of runs can be read, and offers as many rows as the design wants, inside the space."""
    file = study.model["file"]
    with placed(study.text, study.where, ("model", "file")):
        version = table_digest(study.folder / file)
        check_header_units(study)
    inputs = TableModel.opened(study.spec(version=version)).inputs
    runs, offered = (study.design or {}).get("runs"), len(inputs)
    if runs is not None and runs > offered:
        with placed(study.text, study.where, ("design", "runs")):
            raise StudyError(f"[design] runs = {runs}, but the table {file} offers {offered} rows")
    with placed(study.text, study.where, ("design", "kind")):
        check_kind_of_table(design_table(study))
    with placed(study.text, study.where, ("model", "file")):
        given_rows(study.space, inputs[:runs], file=file)


def _open_elsewhere(spec: ModelSpec) -> None:
    from workbench.workers.processes import ProcessPool

    pool = ProcessPool(spec)
    try:
        pool.probe()
    finally:
        pool.close()


def verify_runs(campaign: CampaignRuns, sample: int) -> dict[str, Any]:
    """Run some stored runs with values once more and compare; the store keeps what it has.

    Each is "identical" to the bit, "close" within 1e-9 of its size, or "different"; with the state of the
    model that made it (a row of the table `model_state`), the present one beside it.

    Raises:
        StudyError: the model is not run here, or no run has a value.
    """
    if campaign.study.model["kind"] in ("ask", "table"):
        raise StudyError(
            f"a model of kind {campaign.study.model['kind']!r} is not run here; nothing to verify"
        )
    stored = [row for row in campaign.runs() if row.status == "ok"]
    if not stored:
        raise StudyError("no stored run has a value yet; nothing to verify")
    rng = stream(campaign.study.seed, "verification")
    chosen = rng.choice(len(stored), min(sample, len(stored)), replace=False)
    rows = [stored[k] for k in sorted(chosen.tolist())]
    answers = _made_anew(campaign, {row.key: row.inputs for row in rows})
    made_by = dict(campaign.store.select("SELECT key, state FROM evaluation WHERE state IS NOT NULL"))
    found = [
        {
            "key": row.key,
            "id": row.id,
            "verdict": _verdict(row.outputs, answers[row.key]),
            "stored": dict(row.outputs),
            "now": dict(answers[row.key].outputs),
            "error": answers[row.key].error,
            "state": made_by.get(row.key),
        }
        for row in rows
    ]
    verdicts = [run["verdict"] for run in found]
    counts = {verdict: verdicts.count(verdict) for verdict in ("identical", "close", "different")}
    return {"runs": found, "stored": len(stored), "state_now": campaign.store.state_now, **counts}


def verification_lines(document: Mapping[str, Any]) -> list[str]:
    """What `verify_runs` found, for a terminal."""
    runs = document["runs"]
    shown = ", ".join(f"{document[word]} {word}" for word in ("identical", "close", "different"))
    lines = [f"{len(runs)} of {counted(document['stored'], 'stored run')} made once more: {shown}"]
    for run in runs:
        if run["verdict"] == "identical":
            continue
        by = "an unknown state of the model" if run["state"] is None else f"state {run['state']} of the model"
        now = run["error"] or ", ".join(f"{n} = {v!r}" for n, v in run["now"].items())
        before = ", ".join(f"{n} = {v!r}" for n, v in run["stored"].items())
        lines.append(f"run {run['id']} ({run['key'][:10]}) {run['verdict']}: {before} by {by}; now {now}")
    return fitted([*lines, f"the model is in state {document['state_now']} now"])


def _made_anew(campaign: CampaignRuns, rows: Mapping[str, Mapping[str, Any]]) -> dict[str, Answer]:
    engine = campaign.opened_engine()
    folders = {key: (campaign.folder / "work" / f"verify-{key}").resolve() for key in rows}
    waiting, running = list(rows), 0
    answers: dict[str, Answer] = {}
    try:
        while waiting or running:
            while waiting and running < engine.capacity:
                key = waiting.pop(0)
                engine.submit(key, rows[key], workdir=folders[key])
                running += 1
            for key, answer in engine.completed():
                running -= 1
                answers[key] = answer
    finally:
        engine.close()
        for folder in folders.values():
            shutil.rmtree(folder, ignore_errors=True)
    return answers


def _verdict(stored: Mapping[str, float], answer: Answer) -> str:
    if answer.status != "ok" or set(answer.outputs) != set(stored):
        return "different"
    if answer.outputs == stored:
        return "identical"
    is_close = all(math.isclose(answer.outputs[n], v, rel_tol=CLOSE) for n, v in stored.items())
    return "close" if is_close else "different"
