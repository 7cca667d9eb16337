"""What can be saved of a damaged store: rows that are as they were stored, and rows of the exports.

A row in the file or in its log counts when its checksum is right, whatever happened to the pages around it.
Of several copies of a run the latest counts. `runs.csv` and `results.nc` have no checksums: the inputs of
their rows are right when they give the key; the values are confirmed when both files agree to the bit.
"""

import csv
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from workbench.campaign.integrity.checksums import CHECKED, REALS
from workbench.campaign.rescue.pages import Pages, Record
from workbench.campaign.store_schema import STATUSES, run_key
from workbench.errors import StudyError
from workbench.models.stored.evaluation import FAILED
from workbench.space.box import Space
from workbench.system.database import row_checksum
from workbench.system.spreadsheet import plain_cell

__all__ = ["Exported", "Stock", "exported_rows", "stock_of"]

NAMED_BY = {"gradient": "key", "meta": "key", "evaluation": "key"}  # else by its number
KEY_LENGTH = 32


@dataclass(slots=True, kw_only=True)
class Stock:
    """Rows by table and name, column -> value; and keys of runs of which only damaged copies were met."""

    rows: dict[str, dict[Any, dict[str, Any]]] = field(default_factory=lambda: {t: {} for t in CHECKED})
    damaged: set[str] = field(default_factory=set)


@dataclass(frozen=True, slots=True, kw_only=True)
class Exported:
    """A run in the exports; `confirmed`: by both of them."""

    key: str
    status: str
    batch: str
    inputs: Mapping[str, Any]
    outputs: Mapping[str, float]
    error: str
    confirmed: bool


def stock_of(*paths: Path) -> Stock:
    """The rows in these databases and their logs that are as they were stored."""
    found = Stock()
    ranks: dict[tuple[str, Any], tuple[Any, ...]] = {}
    for path in paths:
        pages = Pages(path)
        for k in range(len(pages)):
            records = pages.rows(k)
            rows = [_row_of(record) for record in records]
            if None in rows or not records:  # its head or one of its rows is damaged, or it is of an index
                found.damaged.update(key for record in records for key in _keys_in(record))
                records = [*records, *pages.rows_anywhere(k)]
                rows = [_row_of(record) for record in records]
            for record, whole in zip(records, rows, strict=True):
                if whole is None:
                    continue
                table, row = whole
                name = row[NAMED_BY[table]] if table in NAMED_BY else record.rowid
                rank = (row.get("finished") or 0.0, row.get("attempt") or 0, record.age, record.rowid)
                if rank >= ranks.get((table, name), rank):
                    ranks[table, name] = rank
                    found.rows[table][name] = row
    found.damaged -= found.rows["evaluation"].keys()
    return found


def _row_of(record: Record) -> tuple[str, dict[str, Any]] | None:
    """The table and the row whose checksum the record carries; None when it is of none."""
    for table, columns in CHECKED.items():
        if len(record.cells) != len(columns) + 1:
            continue
        row = dict(zip(columns, record.cells, strict=False))
        if "id" in row and row["id"] is None:
            row["id"] = record.rowid  # 2.4: it stands in the number of the row alone
        row |= {n: float(v) for n, v in row.items() if n in REALS and isinstance(v, int)}
        if row_checksum(table, *row.values()) == record.cells[-1]:
            return table, row
    return None


def _keys_in(record: Record) -> Iterable[str]:
    """The key in a damaged row of `evaluation`, when there is something that looks like one."""
    if len(record.cells) == len(CHECKED["evaluation"]) + 1:
        key = record.cells[1]
        if isinstance(key, str) and len(key) == KEY_LENGTH:
            yield key


def exported_rows(
    folder: Path, space: Space, names: Iterable[str], *, model: str, version: str
) -> list[Exported]:
    """Runs in `runs.csv` whose inputs give their key; `names` are of the responses."""
    try:
        with open(folder / "runs.csv", encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))
    except (OSError, ValueError, csv.Error):
        return []
    values = _values_in_netcdf(folder / "results.nc")
    found = []
    for cells in table:
        try:
            inputs = space.canonical(
                {
                    p.name: float(cells[p.name]) if p.is_numeric else plain_cell(cells[p.name])
                    for p in space.parameters
                }
            )
            key, status = cells["key"], cells["status"]
            if run_key(model, version, inputs) != key or status not in (*FAILED, "ok", "skipped"):
                continue
            outputs = {n: float(cells[n]) for n in names} if status == "ok" else {}
        except (KeyError, TypeError, ValueError, StudyError):
            continue
        twin = values.get(key)
        confirmed = (
            twin is not None
            and twin["status"] == status
            and all(twin.get(n) == v for n, v in outputs.items())
        )
        found.append(
            Exported(
                key=key, status=status, batch=cells.get("batch") or "design", inputs=inputs, outputs=outputs,
                error=plain_cell(cells.get("error") or ""), confirmed=confirmed,
            )
        )  # fmt: skip
    return found


def _values_in_netcdf(path: Path) -> dict[str, dict[str, Any]]:
    """Status and numbers of every run in `results.nc`; empty when it cannot be read."""
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="scipy") as data:
            data.load()
        keys = [_text(key) for key in data["run"].values]
        status = [_text(word) for word in data["status"].values]
        numbers = {
            str(name): data[name].values.tolist()
            for name in data.data_vars
            if data[name].attrs.get("role") == "response"
        }
        found = {
            key: {"status": word, **{name: column[k] for name, column in numbers.items()}}
            for k, (key, word) in enumerate(zip(keys, status, strict=True))
        }
    except Exception:
        return {}
    return {key: row for key, row in found.items() if row["status"] in STATUSES}


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
