"""Is a study file usable? Everything that can be told without running the model."""

from typing import Any

from workbench.errors import StudyError
from workbench.models.python import load_function
from workbench.models.table import TableModel, table_digest
from workbench.study.record import Study

__all__ = ["check_study"]

STAGES = ("design", "screen", "worst_case", "layout", "robust", "robust_layout")


def check_study(study: Study) -> dict[str, Any]:
    """Open the model (in a process of its own when it is code) and check that the tables fit together.

    Raises:
        StudyError: the model cannot be opened, or a stage asks for what the model does not offer.
    """
    kind = study.model["kind"]
    version = table_digest(study.folder / study.model["file"]) if kind == "table" else study.model["version"]
    spec = study.spec(version=version)
    runs = (study.design or {}).get("runs")
    if kind == "table":
        offered = len(TableModel.opened(spec).rows)
        if runs is not None and runs > offered:
            raise StudyError(
                f"[design] runs = {runs}, but the table {study.model['file']} offers {offered} rows"
            )
        runs = offered if runs is None else runs
    elif study.design is None and (study.screen is not None or not _needs_no_design(study)):
        raise StudyError(
            "the study has no [design] table, so there is nothing to run; add one such as runs = 50"
        )
    if kind not in ("table", "ask"):
        _open_elsewhere(spec)
    if study.worst_case is not None and "enclosure" in study.worst_case:
        try:
            load_function(study.worst_case["enclosure"], study.folder)
        except StudyError as exc:
            raise StudyError(f"[worst_case] enclosure: {exc}") from None
    if study.robust_layout is not None:
        _check_layout_model(study)
    stages = [name for name in STAGES if getattr(study, name) is not None]
    d = study.space.dimension
    summary = f"{d} parameters, {len(study.responses)} responses, model {kind}, stages {', '.join(stages)}"
    return {"valid": True, "summary": summary, **study.to_dict()}


def _needs_no_design(study: Study) -> bool:
    stages = (study.worst_case, study.layout, study.robust, study.robust_layout)
    return any(table is not None for table in stages)


def _check_layout_model(study: Study) -> None:
    from workbench.robust_layout.model import load_layout_model

    table = study.robust_layout or {}
    for options in (table["options"], *({**table["options"], **v["options"]} for v in table["variant"])):
        model = load_layout_model(table["model"], options, folder=study.folder)
        study.response(model.response)


def _open_elsewhere(spec: Any) -> None:
    from workbench.workers.processes import ProcessPool

    pool = ProcessPool(spec)
    try:
        pool.probe()
    finally:
        pool.close()
