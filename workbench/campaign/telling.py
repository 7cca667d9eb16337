"""Results that come from elsewhere: rows out as CSV, answers in as CSV or from Python."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from workbench.campaign.runs import Asked, CampaignRuns
from workbench.errors import StudyError
from workbench.models.stored.evaluation import FAILED, UNFINISHED
from workbench.models.table import check_columns, ignored_columns, read_cells
from workbench.models.values import number_in, what_is_wrong
from workbench.report.lines.tables import format_number, table_lines

__all__ = ["Told", "asked_csv", "asked_lines", "asked_rows", "tell_csv"]

MOST_SHOWN = 20
ROUNDED = 1e-3  # of the range: so far a sheet may round the parameters of an asked run
KEY_SHOWN = 10  # characters that tell runs of one campaign apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """How many rows of a file answered an asked run, were new, repeated what is stored, or failed.

    `ignored`: its columns with numbers that nobody reads.
    """

    answered: int
    new: int
    repeated: int
    failed: int
    ignored: tuple[str, ...] = ()


def asked_csv(asked: Sequence[Asked], names: Sequence[str], responses: Sequence[str]) -> str:
    """Rows to run as CSV: key, parameters, and an empty column per response to fill in."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["key", *names, *responses])
    for run in asked:
        writer.writerow([run.key, *(run.parameters[n] for n in names), *("" for _ in responses)])
    return out.getvalue()


def asked_rows(campaign: CampaignRuns) -> list[Asked]:
    """The rows that wait in a study without a design: those that its searches asked for.

    Raises:
        StudyError: the model runs here, so that nobody is asked; or no stage of the study asks for rows.
    """
    study = campaign.study
    if study.model["kind"] != "ask":
        raise StudyError("the study has no [design] table; add one, such as [design] runs = 50")
    waiting = campaign.ask()
    if not waiting and study.worst_case is None and study.robust is None:
        raise StudyError(
            "the study asks for no runs: give it a [design] table for points to run, or a [worst_case] "
            "table, whose search then asks for its own"
        )
    return waiting


def asked_lines(asked: Sequence[Asked], *, study: str, csv: Path | None) -> list[str]:
    """The waiting rows as a table, and how their results come back; `csv` is where they were written."""
    if not asked:
        return [f"no run waits for its result; `holdfast run {study}` goes on"]
    rows = [
        (
            run.key[:KEY_SHOWN],
            ", ".join(
                # a parameter and its value stay on one line
                f"{name}\u00a0=\u00a0{format_number(value, 6) if isinstance(value, float) else value}"
                for name, value in run.parameters.items()
            ),
        )
        for run in asked[:MOST_SHOWN]
    ]
    lines = table_lines(("key", "parameters"), rows)
    if len(asked) > MOST_SHOWN:
        lines.append(f"and {len(asked) - MOST_SHOWN} more")
    if csv is None:
        lines.append(f"`holdfast design {study} --csv ask.csv` writes them with all digits;")
    lines.append(
        f"fill in the responses in {csv or 'ask.csv'}, or in a column `error` why there are none, then"
    )
    return [*lines, f"`holdfast tell {study} {csv or 'ask.csv'}` and `holdfast run {study}`"]


def tell_csv(campaign: CampaignRuns, path: Path) -> Told:
    """Store the results in a CSV: a `key` column or all parameters, a column per response, and `error`.

    A row with an error is a failed run; a row without a key, an error and any response is left alone.

    Raises:
        StudyError: columns are missing, a cell is no number, a key is unknown. Nothing of the file is stored
        then.
    """
    names = campaign.study.space.names
    responses = tuple(campaign.study.reductions)
    header, lines = read_cells(path)
    keyed = "key" in header
    wanted = responses if keyed else (*responses, *names)
    check_columns(path.name, header, wanted)
    told: list[tuple[str | None, dict[str, Any] | None, dict[str, float] | None, str | None]] = []
    known = {row.key: row.inputs for row in campaign.runs()}
    for line, cells in lines:
        where = f"{path.name}, line {line}"
        if len(cells) != len(header):
            raise StudyError(f"{where}: {len(cells)} cells where the header has {len(header)}")
        cell = dict(zip(header, (c.strip() for c in cells), strict=True))
        key = cell["key"] if keyed and cell["key"] else None
        if key is not None and key not in known:
            whole = (
                ", which `holdfast design --csv` writes whole"
                if len(key) < len(next(iter(known), ""))
                else ""
            )
            raise StudyError(
                f"{where}: no run {key!r} was asked for{whole}; leave the key empty for a run of your own"
            )
        failure = cell.get("error") or None
        given = [cell[r] for r in responses]
        if failure is None and not any(given):
            continue
        outputs = None if failure else {r: _number(cell[r], where, r) for r in responses}
        parameters = None
        if key is not None:
            _check_asked(campaign, known[key], cell, where)
        else:
            try:
                parameters = campaign.study.space.canonical(
                    {n: _value(campaign, n, cell[n], where) for n in names}
                )
            except StudyError as exc:
                raise StudyError(f"{where}: {exc}") from None
        told.append((key, parameters, outputs, failure))
    ignored = ignored_columns(header, lines, {"key", "error", *names, *responses})
    return replace(_store(campaign, told, known), ignored=tuple(ignored))


def _check_asked(
    campaign: CampaignRuns, asked: Mapping[str, Any], cell: Mapping[str, str], where: str
) -> None:
    """Refuse a key beside other parameters than it was asked with, as where a part of a sheet was sorted."""
    for parameter in campaign.study.space.parameters:
        name, given = parameter.name, cell.get(parameter.name)
        if not given or name not in asked:
            continue
        value, wanted = _value(campaign, name, given, where), asked[name]
        if parameter.is_numeric:
            ends = parameter.levels or (parameter.lower, parameter.upper)
            is_same = abs(value - wanted) <= ROUNDED * (ends[-1] - ends[0])
        else:
            is_same = value == wanted
        if not is_same:
            raise StudyError(
                f"{where}: the run of this key was asked for with {name} = {wanted}, got {given}. Give the "
                "result of that run, or leave the key empty for a run of your own"
            )


def _store(
    campaign: CampaignRuns, told: Sequence[tuple[Any, Any, Any, Any]], known: Mapping[str, Any]
) -> Told:
    answered = new = repeated = failed = 0
    with campaign.store.transaction():
        for key, parameters, outputs, failure in told:
            name = key or campaign.key(parameters)
            before = campaign.store.rows(keys=[name])
            if before and before[0].status not in UNFINISHED:
                repeated += 1
                continue
            campaign.tell(key, outputs, parameters=parameters, failure=failure)
            answered += name in known
            new += name not in known
            failed += campaign.store.rows(keys=[name])[0].status in FAILED
    return Told(answered=answered, new=new, repeated=repeated, failed=failed)


def _number(cell: str, where: str, column: str) -> float:
    try:
        return number_in(cell)
    except ValueError:
        came = repr(cell) if cell else "an empty cell"
        cure = what_is_wrong(cell) or (
            "Leave all responses empty for a run that is not made, or fill in the column 'error'"
        )
        raise StudyError(f"{where}: column {column!r} needs a number, got {came}. {cure}") from None


def _value(campaign: CampaignRuns, name: str, cell: str, where: str) -> Any:
    return _number(cell, where, name) if campaign.study.space[name].is_numeric else cell
