"""The stage `design` of a study: the points to run, made once, their place in the queue, and their runs.

The points come from a kind of design, from a file, or from a table of runs made elsewhere: `design.json`.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import compress, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

from workbench.campaign.runs import Asked, CampaignRuns
from workbench.campaign.view import StoredRuns
from workbench.errors import StudyError
from workbench.models.stored.evaluation import UNFINISHED
from workbench.models.table import TableModel, read_table
from workbench.report.lines.design import design_lines
from workbench.sampling.change import DesignChange, design_change, growth_model
from workbench.sampling.stored import ROWS, design_head, design_keys, design_points
from workbench.space.units import counted
from workbench.stages.work import Work
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.study.tables_of_runs import check_header_units, columns_left, dwarfing_of
from workbench.system.atomic import read_json, write_json

if TYPE_CHECKING:
    import pandas as pd

    from workbench.sampling.plan import Design
    from workbench.space.box import Space

__all__ = [
    "WORK",
    "answered_runs",
    "check_kind_of_table",
    "compared_designs",
    "design_table",
    "drawn_design",
    "evaluate",
    "given_rows",
    "queue_design",
    "waiting_rows",
]

AT_ONCE = 20_000  # rows of a design that are held in memory as runs

Rows = Callable[[slice], list[dict[str, Any]]]  # what a model is called with, some runs at a time


def design_table(study: Study) -> dict[str, Any]:
    """The table `[design]`; of a study without one, the table of runs that its model is."""
    return {"kind": "table", **(study.design or {})}


def _run(campaign: CampaignRuns, table: Mapping[str, Any]) -> dict[str, Any]:
    """Make the points. The document; without the rows of a design of more than AT_ONCE runs."""
    study = campaign.study
    later: list[list[float]] = []  # drawn with the others, to be made when the design grows
    if study.model["kind"] == "table":
        made, rows = _design_of_table(campaign, table)
    elif table["kind"] == "table":
        made, rows = _design_from_file(campaign, table)
    else:
        stored = read_json(campaign.folder / "design.json")
        change = None if stored is None else _change(campaign, table, stored)
        if change is None:
            made, rows, later = _design_of_kind(campaign, table)
        else:
            made, rows, later = _grown_design(campaign, table, stored, change)
    parts = [slice(begin, begin + AT_ONCE) for begin in range(0, len(made), AT_ONCE)]
    keys = [campaign.key(row) for part in parts for row in study.space.canonical_rows(rows(part))]
    beside = {"ignored_columns": columns_left(study), "dwarfing": dwarfing_of(study), "later": later}
    head = made.head() | {"run_keys": keys} | {name: value for name, value in beside.items() if value}
    # as given: a table's value would not survive the way to the unit cube and back to the last bit
    physical = ([[row[name] for name in study.space.names] for row in rows(part)] for part in parts)
    count = len(made)
    if count <= AT_ONCE:
        document = {**head, "unit": made.unit.tolist(), "physical": [p for piece in physical for p in piece]}
        write_json(campaign.folder / "design.json", document)
    else:
        unit = (made.unit[part].tolist() for part in parts)
        write_json(
            campaign.folder / "design.json", {**head, "unit": unit, "physical": physical}, compact=True
        )
        document = {name: value for name, value in head.items() if name not in ROWS}
    campaign.progress.stage(
        "design",
        f"{counted(count, 'run')} of {counted(study.space.dimension, 'parameter')} ({made.algorithm})",
    )
    return document


def _inputs(campaign: StoredRuns, table: Mapping[str, Any]) -> Iterable[str]:
    return [campaign.spec.version] if campaign.study.model["kind"] == "table" else []


def _planned_runs(study: Study, folder: Path) -> int | None:
    """As many as the design has, or as it is to grow to; None where that is up to its kind."""
    document = design_head(folder / "design.json")
    counts = (document["n"] if document else None, (study.design or {}).get("runs"))
    return max((count for count in counts if count is not None), default=None)


def _check_file(study: Study) -> None:
    """Refuse a design whose CSV is not there, or holds points outside the space."""
    table = study.design or {}
    if table.get("kind") != "table" or study.model["kind"] == "table":
        return
    given_rows(study.space, _rows_of_file(study)[: table.get("runs")], file=table["file"])


WORK = Work(run=_run, inputs=_inputs, lines=design_lines, planned_runs=_planned_runs, check=_check_file)


def queue_design(campaign: CampaignRuns, document: Mapping[str, Any]) -> int:
    """Put the design's rows in the queue; how many of them wait. A table answers its rows at once."""
    if campaign.study.model["kind"] == "table":
        evaluate(campaign)
    keys: list[str] = []
    for rows in _some_rows(campaign, document):
        keys += campaign.enqueue(rows, batch="design")
    return sum(status == "queued" for status in campaign.store.statuses(keys).values())


def waiting_rows(campaign: CampaignRuns) -> list[Asked]:
    """The rows of the design that wait for an answer.

    Of a model that others run, the rows that a search waits for stand behind them.
    """
    keys = set(design_keys(campaign.folder / "design.json") or ())
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
    counts = Counter(statuses.values())
    known = sum(count for status, count in counts.items() if status not in UNFINISHED)
    campaign.progress.stage("evaluate", f"{counted(len(keys), 'run')}, {known} of them known")
    if known < len(keys) and known < len(set(keys)):  # runs of a discrete design may coincide
        wanted = [statuses.get(key, "queued") in UNFINISHED for key in keys]
        del statuses
        _make(campaign, design_head(campaign.folder / "design.json"), wanted)
        counts = Counter(campaign.store.statuses(keys).values())
    return {"runs": len(keys), "counts": dict(counts)}


def _make(campaign: CampaignRuns, document: Mapping[str, Any], wanted: Sequence[bool]) -> None:
    """Have those rows of a design run that have no answer: of very many, some after the other."""
    kind = campaign.study.model["kind"]
    batch = "table" if kind == "table" else "design"
    if kind == "ask" or len(wanted) <= AT_ONCE:
        (rows,) = _some_rows(campaign, document, at_once=len(wanted))
        campaign.evaluate(rows, batch=batch)
        return
    left = sum(wanted)
    done = len(wanted) - left
    for rows in _some_rows(campaign, document, wanted=wanted):
        left -= len(rows)
        campaign.evaluate(rows, batch=batch, beside=(done, left))
        done += len(rows)


def _design_of_table(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple["Design", Rows]:
    """The design that a table of runs is."""
    check_kind_of_table(table)
    check_header_units(campaign.study)
    model = TableModel.opened(campaign.spec)
    return _given_design(campaign, model.inputs, table, str(campaign.study.model["file"]))


def check_kind_of_table(table: Mapping[str, Any]) -> None:
    """Refuse a design of another kind where the model is a table of runs."""
    if table["kind"] != "table":
        raise StudyError(
            f"design kind {table['kind']!r} needs a model that can be run; a table has its runs: leave it out"
        )


def _design_from_file(campaign: CampaignRuns, table: Mapping[str, Any]) -> tuple["Design", Rows]:
    """The design in a CSV of parameters."""
    return _given_design(campaign, _rows_of_file(campaign.study), table, table["file"])


def _rows_of_file(study: Study) -> list[dict[str, Any]]:
    """The rows of the CSV that a `[design]` of kind "table" names."""
    assert study.design is not None
    path, space = study.folder / study.design["file"], study.space
    with placed(study.text, study.where, ("design", "file")):
        if not path.is_file():
            raise StudyError(f"no table {path}: [design] file is looked up beside the study file")
        check_header_units(study)
    words = [p.name for p in space.parameters if not p.is_numeric]
    return read_table(path, space.names, (), words=words)


def given_rows(space: "Space", rows: Sequence[Mapping[str, Any]], *, file: str) -> list[dict[str, Any]]:
    """Rows of a CSV as points of the space; a StudyError for one that lies outside."""
    chosen = []
    for k, row in enumerate(rows):
        try:
            chosen.append(space.canonical(row))
        except StudyError as exc:
            raise StudyError(
                f"{file}, row {k + 1} below the header: {exc}. Mend it, widen the range or leave the row out"
            ) from None
    return chosen


def _given_design(
    campaign: CampaignRuns, rows: list[dict[str, Any]], table: Mapping[str, Any], file: str
) -> tuple["Design", Rows]:
    from workbench.sampling.plan import Design, run_ids

    space = campaign.study.space
    wanted = table.get("runs", len(rows))
    if wanted > len(rows):
        raise StudyError(f"[design] runs = {wanted}, but the table {file} offers {len(rows)} rows")
    chosen = given_rows(space, rows[:wanted], file=file)
    made = Design(
        space=space,
        unit=space.unit(chosen),
        run_ids=run_ids(len(chosen)),
        algorithm="table",
        options={"file": file},
        seed=campaign.study.seed,
    )
    return made, chosen.__getitem__


def _design_of_kind(
    campaign: CampaignRuns, table: Mapping[str, Any]
) -> tuple["Design", Rows, list[list[float]]]:
    """The design of a kind such as "ihs", and what is drawn with it for later."""
    from workbench.sampling.kinds import checked_up_to
    from workbench.sampling.parts import first_part
    from workbench.sampling.plan import DesignOptions, make_design

    up_to = checked_up_to(table)
    made = make_design(
        campaign.study.space,
        table["kind"],
        up_to or table.get("runs"),
        seed=campaign.study.seed,
        options=DesignOptions(**_options(table)),
    )
    if up_to is None:
        return made, made.rows, []
    part, later = first_part(made, table["runs"])
    return part, part.rows, later


def _options(table: Mapping[str, Any]) -> dict[str, Any]:
    return {k: v for k, v in table.items() if k not in ("kind", "runs", "up_to", "file")}


def _change(
    campaign: CampaignRuns, table: Mapping[str, Any], document: Mapping[str, Any]
) -> DesignChange | None:
    """What becomes of the design in `document`; None: none of its runs has an answer."""
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
    campaign: CampaignRuns, table: Mapping[str, Any], document: Mapping[str, Any], change: DesignChange
) -> tuple["Design", Rows, list[list[float]]]:
    """The runs of `document` that serve on, and new ones: drawn with them, or spread best among them."""
    from workbench.sampling.kinds import checked_up_to
    from workbench.sampling.parts import next_part
    from workbench.sampling.plan import Design

    checked_up_to(table)
    space, seed = campaign.study.space, campaign.study.seed
    kept = [dict(row) for row in change.kept.values()]
    is_same = document["space_hash"] == space.hash
    made = Design(
        space=space,
        unit=space.unit(kept),
        run_ids=tuple(change.kept),
        algorithm=table["kind"],
        options=_options(table),
        seed=seed,
        beside_fresh=document.get("beside_fresh", {}) if is_same and len(kept) == document["n"] else {},
    )
    later = document.get("later", []) if is_same else []
    drawn = min(change.new, len(later))
    if drawn:
        made, later = next_part(made, later, drawn, seed=seed)
    if change.new > drawn:
        made = made.grown(change.new - drawn, seed=seed, model=growth_model(table))
    return made, [*kept, *made.rows()[len(kept) :]].__getitem__, later


def drawn_design(document: Mapping[str, Any], folder: Path) -> Path:
    """Draw the design of `design.json` into `folder`; gives the path of the picture."""
    from workbench.figures.design import plot_design
    from workbench.figures.parts import text_where_no_math
    from workbench.sampling.plan import Design

    path = folder / "design_quality.png"
    figure = plot_design(Design.from_dict(_whole(document, folder)))
    text_where_no_math(figure)
    figure.savefig(path, dpi=120)
    return path


def _whole(document: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """The document with the rows that were left in `folder`."""
    if "unit" in document:
        return document
    found: Mapping[str, Any] = read_json(folder / "design.json")
    return found


def compared_designs(document: Mapping[str, Any], folder: Path, kinds: Sequence[str]) -> "pd.DataFrame":
    """The design of `design.json` beside others with as many runs: see `workbench.compare`."""
    from workbench.sampling.plan import Design, compare, make_design

    own = Design.from_dict(_whole(document, folder))
    designs = {own.algorithm: own}
    for kind in (kind.strip() for kind in kinds):
        made = make_design(own.space, kind, len(own), seed=own.seed)
        designs[kind if kind != own.algorithm else f"{kind} (defaults)"] = made
    return compare(designs)


def _some_rows(
    campaign: CampaignRuns,
    document: Mapping[str, Any],
    *,
    wanted: Iterable[bool] | None = None,
    at_once: int = AT_ONCE,
) -> Iterator[list[dict[str, Any]]]:
    """The rows of the stored design, `at_once` at a time; those that are `wanted`, one answer per row."""
    if document["space_hash"] != campaign.study.space.hash:
        raise StudyError("the parameters changed since the design was made; `holdfast design` makes it anew")
    names = campaign.study.space.names
    points = design_points(campaign.folder / "design.json")
    chosen = points if wanted is None else compress(points, wanted)
    while some := list(islice(chosen, at_once)):
        yield [dict(zip(names, point, strict=True)) for point in some]
