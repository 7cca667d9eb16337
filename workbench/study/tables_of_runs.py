"""A study beside its CSV of runs or points: units in the header, columns that nobody reads, dwarfing runs."""

from typing import Any

from workbench.errors import StudyError
from workbench.models.stored.dwarfing import dwarfing_runs
from workbench.models.table import ignored_columns, read_cells
from workbench.space.unit_scales import contradiction, unit_in_header
from workbench.study.record import Study

__all__ = ["check_header_units", "columns_left", "dwarfing_of"]


def check_header_units(study: Study) -> None:
    """Refuse a column whose header names another unit than the study: its numbers would be read wrongly.

    Units that nobody knows, and those of a study that says none, are left alone.
    """
    file = _file(study)
    if file is None or not (study.folder / file).is_file():
        return
    header, _ = read_cells(study.folder / file)
    is_model = study.model["kind"] == "table"
    columns = study.model.get("columns", {}) if is_model else {}
    given = [("parameter", p.name, p.unit) for p in study.space.parameters]
    given += [("response", r.name, r.unit) for r in study.responses] if is_model else []
    for what, name, unit in given:
        column = columns.get(name, name)
        if column in header and contradiction(column, unit):
            theirs = unit_in_header(column)
            raise StudyError(
                f"{file}: the column {column!r} is in {theirs}, and {what} {name!r} of the study in {unit}. "
                f'Convert the column or write unit = "{theirs}" in the study, with bounds and limits in it; '
                "if it is only the name that is wrong, rename the column"
            )


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
