"""Is a study file usable? Everything that can be told without running the model."""

from typing import Any

from workbench.errors import StudyError
from workbench.models.protocol import ModelSpec
from workbench.models.table import TableModel, table_digest
from workbench.stages.table import asked_stages
from workbench.study.record import Study

__all__ = ["check_study"]


def check_study(study: Study) -> dict[str, Any]:
    """Open the model (in a process of its own when it is code) and check that the tables fit together.

    Raises:
        StudyError: the model cannot be opened, or a stage asks for what the model does not offer.
    """
    kind, stages = study.model["kind"], asked_stages(study)
    if kind == "table":
        _check_table(study)
    elif study.design is None and (not stages or any(stage.needs_design for stage in stages)):
        raise StudyError(
            "the study has no [design] table, so there is nothing to run; add one such as runs = 50"
        )
    if kind not in ("table", "ask"):
        _open_elsewhere(study.spec(version=study.model["version"]))
    for stage in stages:
        if stage.work.check is not None:
            stage.work.check(study)
    names = ", ".join(stage.name for stage in stages)
    d = study.space.dimension
    summary = f"{d} parameters, {len(study.responses)} responses, model {kind}, stages {names}"
    return {"valid": True, "summary": summary, **study.to_dict()}


def _check_table(study: Study) -> None:
    """The table of runs can be read, and offers as many rows as the design wants."""
    file = study.model["file"]
    offered = len(TableModel.opened(study.spec(version=table_digest(study.folder / file))).rows)
    runs = (study.design or {}).get("runs")
    if runs is not None and runs > offered:
        raise StudyError(f"[design] runs = {runs}, but the table {file} offers {offered} rows")


def _open_elsewhere(spec: ModelSpec) -> None:
    from workbench.workers.processes import ProcessPool

    pool = ProcessPool(spec)
    try:
        pool.probe()
    finally:
        pool.close()
