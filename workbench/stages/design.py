"""The stage `design` of a study: the points to run, made once, their place in the queue, and their runs.

The points come from a kind of design, from a file, or from a table of runs made elsewhere: `design.json`.
"""

from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.campaign.runs import Asked, CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.errors import StudyError
from workbench.models.stored.evaluation import UNFINISHED
from workbench.models.table import TableModel, ignored_columns, read_cells, read_table
from workbench.report.lines.design import design_lines
from workbench.sampling.change import DesignChange, design_change, growth_model
from workbench.sampling.stored import LARGE, design_keys
from workbench.stages.work import Work
from workbench.study.record import Study
from workbench.system.atomic import read_json, read_json_without, write_json

if TYPE_CHECKING:
    import pandas as pd

__all__ = [
    "WORK",
    "answered_runs",
    "compared_designs",
    "design_table",
    "drawn_design",
    "evaluate",
    "queue_design",
]

AT_ONCE = 20_000  # rows of a design that are held in memory as runs


def design_table(study: Study) -> dict[str, Any]:
    """The table `[design]`; of a study without one, the table of runs that its model is."""
    return {"kind": "table", **(study.design or {})}


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """Make the points."""
    study = campaign.study
    if study.model["kind"] == "table":
        made, rows = _design_of_table(campaign, table)
    elif table["kind"] == "table":
        made, rows = _design_from_file(campaign, table)
    else:
        change = _change(campaign, table)
        made, rows = (
            _design_of_kind(campaign, table) if change is None else _grown_design(campaign, table, change)
        )
    # as given: a table's value would not survive the way to the unit cube and back to the last bit
    physical = [[row[name] for name in study.space.names] for row in rows]
    keys: list[str] = []
    for begin in range(0, len(rows), AT_ONCE):
        keys += map(campaign.key, study.space.canonical_rows(rows[begin : begin + AT_ONCE]))
    count = len(rows)
    del rows
    document = {**made.to_dict(physical=physical), "run_keys": keys}
    ignored = _ignored_columns(study, table)
    if ignored:
        document["ignored_columns"] = ignored
    write_json(campaign.folder / "design.json", document, compact=count > AT_ONCE)
    campaign.progress.stage(
        "design", f"{count} runs of {study.space.dimension} parameters ({made.algorithm})"
    )
    return document


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> str:
    return campaign.spec.version if campaign.study.model["kind"] == "table" else ""


def _planned_runs(study: Study, folder: Path) -> int | None:
    """As many as the design has, or as it is asked to have; None where that is up to its kind."""
    document = read_json(folder / "design.json")
    runs: int | None = document["n"] if document else (study.design or {}).get("runs")
    return runs


WORK = Work(run=_run, inputs=_inputs, lines=design_lines, planned_runs=_planned_runs)


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
    keys = design_keys(campaign.folder / "design.json")
    if keys is None:
        raise StudyError(
            "there is no design to evaluate; give the study a [design] table or run `holdfast design`"
        )
    statuses = campaign.store.statuses(keys)
    known = sum(status not in UNFINISHED for status in statuses.values())
    campaign.progress.stage("evaluate", f"{len(keys)} runs, {known} of them known")
    if known < len(set(keys)):
        document = read_json_without(campaign.folder / "design.json", ("unit", "run_ids"), above=LARGE)
        _make(campaign, document, {key for key, status in statuses.items() if status not in UNFINISHED})
        statuses = campaign.store.statuses(keys)
    return {"runs": len(keys), "counts": dict(Counter(statuses.values()))}


def _make(campaign: CampaignRuns, document: Mapping[str, Any], known: Collection[str]) -> None:
    """Have those rows of a design run that have no answer: of very many, some after the other."""
    kind = campaign.study.model["kind"]
    batch = "table" if kind == "table" else "design"
    if kind == "ask" or len(document["run_keys"]) <= AT_ONCE:
        campaign.evaluate(_rows(campaign, document), batch=batch)
        return
    left = [k for k, key in enumerate(document["run_keys"]) if key not in known]
    done = len(document["run_keys"]) - len(left)
    for begin in range(0, len(left), AT_ONCE):
        some = [document["physical"][k] for k in left[begin : begin + AT_ONCE]]
        rows = _rows(campaign, {**document, "physical": some})
        campaign.evaluate(rows, batch=batch, beside=(done + begin, len(left) - begin - len(rows)))


def _ignored_columns(study: Study, table: Mapping[str, Any]) -> list[str]:
    """The columns with numbers of the table of runs, or of points, that the study does not read."""
    model, used = study.model, set(study.space.names)
    if model["kind"] == "table":
        columns = model.get("columns", {})
        file, names = model["file"], used | {response.name for response in study.responses}
        used = {columns.get(name, name) for name in names}
    elif table["kind"] == "table":
        file = table["file"]
    else:
        return []
    return ignored_columns(*read_cells(study.folder / file), used)


def _design_of_table(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
    """The design that a table of runs is."""
    if table["kind"] != "table":
        raise StudyError(
            f"design kind {table['kind']!r} needs a model that can be run; a table has its runs: leave it out"
        )
    model = TableModel.opened(campaign.spec)
    return _given_design(campaign, model.inputs, table, str(campaign.study.model["file"]))


def _design_from_file(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
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


def _design_of_kind(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple[Any, list[dict[str, Any]]]:
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


def _change(campaign: CampaignRuns, table: Mapping[str, Any]) -> DesignChange | None:
    """What becomes of the design that is there; None: there is none, or none of its runs has an answer."""
    document = read_json(campaign.folder / "design.json")
    if document is None:
        return None
    change = design_change(
        campaign.study.space,
        table,
        document,
        answered_runs(document, campaign.statuses(), campaign.key),
        seed=campaign.study.seed,
        at_baseline=campaign.permissions.at_baseline,
    )
    if change is not None:
        campaign.progress.note(change.sentence)
    return change


def answered_runs(
    document: Mapping[str, Any],
    statuses: Mapping[str, str],
    key: Callable[[Mapping[str, Any]], str],
) -> list[bool]:
    """For every run of a design whether it has an answer by the present model, whose `statuses` are given."""
    names = [parameter["name"] for parameter in document["parameters"]]
    keys = [key(dict(zip(names, point, strict=True))) for point in document["physical"]]
    written = document["run_keys"]  # by an older schema perhaps, from the same rows
    return [
        any(statuses.get(name, "queued") not in UNFINISHED for name in pair)
        for pair in zip(keys, written, strict=True)
    ]


def _grown_design(
    campaign: CampaignRuns, table: Mapping[str, Any], change: DesignChange
) -> tuple[Any, list[dict[str, Any]]]:
    """The runs that serve on, and new ones that spread best among them."""
    from workbench.sampling.plan import Design

    space, seed = campaign.study.space, campaign.study.seed
    kept = [dict(row) for row in change.kept.values()]
    options = {k: v for k, v in table.items() if k not in ("kind", "runs", "file")}
    old = Design(
        space=space,
        unit=space.unit(kept),
        run_ids=tuple(change.kept),
        algorithm=table["kind"],
        options=options,
        seed=seed,
    )
    made = old.grown(change.new, seed=seed, model=growth_model(table)) if change.new else old
    return made, [*kept, *made.rows()[len(kept) :]]


def drawn_design(document: Mapping[str, Any], folder: Path) -> Path:
    """Draw the design of `design.json` into `folder`; gives the path of the picture."""
    from workbench.figures.design import plot_design
    from workbench.figures.parts import text_where_no_math
    from workbench.sampling.plan import Design

    path = folder / "design_quality.png"
    figure = plot_design(Design.from_dict(document))
    text_where_no_math(figure)
    figure.savefig(path, dpi=120)
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


def _rows(campaign: CampaignRuns, document: Mapping[str, Any]) -> list[dict[str, Any]]:
    if document["space_hash"] != campaign.study.space.hash:
        raise StudyError("the parameters changed since the design was made; `holdfast design` makes it anew")
    return [dict(zip(campaign.study.space.names, point, strict=True)) for point in document["physical"]]
