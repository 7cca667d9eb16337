"""A study beside its CSV of runs or points: columns that nobody reads, dwarfing runs."""

from typing import Any

from workbench.models.stored.dwarfing import dwarfing_runs
from workbench.models.table import ignored_columns, read_cells
from workbench.study.record import Study

__all__ = ["columns_left", "dwarfing_of"]


def columns_left(study: Study) -> list[str]:
    """The columns with numbers of the table of runs, or of points, that the study does not read."""
    file, model, used = _file(study), study.model, set(study.space.names)
    if file is None:
        return []
    if model["kind"] == "table":
        columns = model.get("columns", {})
        used = {columns.get(n, n) for n in used | {response.name for response in study.responses}}
    return ignored_columns(*read_cells(study.folder / file), used)


def dwarfing_of(study: Study) -> list[dict[str, Any]]:
    """Runs of a table that dwarf all others, by response."""
    model, units = study.model, {response.name: response.unit for response in study.responses}
    if model["kind"] != "table":
        return []
    first = (study.design or {}).get("runs")
    return dwarfing_runs(study.folder / model["file"], units, columns=model.get("columns", {}), first=first)


def _file(study: Study) -> str | None:
    """The CSV of runs, or of points, None where there is none."""
    if study.model["kind"] == "table":
        return str(study.model["file"])
    design = study.design or {}
    return str(design["file"]) if design.get("kind") == "table" else None
