"""The points of a study: from a kind of design, from a file, or from a table of runs made elsewhere."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.campaign.runs import CampaignRuns
from workbench.errors import StudyError
from workbench.models.table import TableModel, read_table

if TYPE_CHECKING:
    import pandas as pd

__all__ = ["compared_designs", "design_from_file", "design_of_kind", "design_of_table", "drawn_design"]


def design_of_table(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    """The design that a table of runs is."""
    if table["kind"] != "table":
        raise StudyError(
            f"design kind {table['kind']!r} needs a model that can be run; a table has its runs: leave it out"
        )
    model = TableModel.opened(campaign.spec)
    return _given_design(campaign, model.inputs, table, str(campaign.study.model["file"]))


def design_from_file(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    """The design in a CSV of parameters."""
    if "file" not in table:
        raise StudyError("design kind 'table' needs file, a CSV with a column per parameter")
    space = campaign.study.space
    words = [p.name for p in space.parameters if not p.is_numeric]
    rows = read_table(campaign.study.folder / table["file"], space.names, (), words=words)
    return _given_design(campaign, rows, table, table["file"])


def _given_design(
    campaign: CampaignRuns, rows: list[dict[str, Any]], table: Mapping[str, Any], file: str
) -> tuple[Any, list[dict[str, Any]]]:
    from workbench.sampling.plan import Design, run_ids

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


def design_of_kind(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    """The design of a kind such as "ihs"."""
    from workbench.sampling.plan import DesignOptions, make_design

    options = {k: v for k, v in table.items() if k not in ("kind", "runs", "file")}
    made = make_design(
        campaign.study.space,
        table["kind"],
        table.get("runs"),
        seed=campaign.study.seed,
        options=DesignOptions(**options),
    )
    return made, made.rows()


def drawn_design(document: Mapping[str, Any], folder: Path) -> Path:
    """Draw the design of `design.json` into `folder`; gives the path of the picture."""
    from workbench.figures.design import plot_design
    from workbench.sampling.plan import Design

    path = folder / "design_quality.png"
    plot_design(Design.from_dict(document)).savefig(path, dpi=120)
    return path


def compared_designs(document: Mapping[str, Any], kinds: Sequence[str]) -> "pd.DataFrame":
    """The design of `design.json` beside others with as many runs: see `workbench.compare`."""
    from workbench.sampling.plan import Design, compare, make_design

    own = Design.from_dict(document)
    designs = {own.algorithm: own}
    for kind in (kind.strip() for kind in kinds):
        made = make_design(own.space, kind, len(own), seed=own.seed)
        designs[kind if kind != own.algorithm else f"{kind} (defaults)"] = made
    return compare(designs)
