"""A new store of what can be saved of a damaged one; the damaged files are kept beside it.

The new database is written whole under another name, the damaged one is copied into `damaged/`, its log is
removed and the new one takes its place, in this order: a kill in between leaves either the damaged files or
the new database, and the next `holdfast recover` goes on.
"""

import json
import os
import shutil
import sqlite3
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.campaign.integrity.checksums import CHECKED
from workbench.campaign.rescue.examination import DATABASES, Examination, examined
from workbench.campaign.rescue.stock import Exported, Stock, exported_rows, stock_of
from workbench.campaign.store_schema import SCHEMA, VERSION
from workbench.errors import StoreError
from workbench.models.stored.evaluation import UNFINISHED
from workbench.report.lines.tables import hanging
from workbench.space.units import counted
from workbench.study.record import Study
from workbench.system.atomic import read_json, write_json
from workbench.system.database import connected, explained
from workbench.system.one_writer import WriterLock, moment
from workbench.system.witness import Witness, witness_says

__all__ = ["Recovery", "recovered", "recovery_lines"]

ASIDE = "damaged"


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """What came of saving one database.

    saved: answered runs with their checksum.    exported: taken from the exports.    confirmed: of these, the
    same in both of them.    damaged: keys of runs of which only damaged copies were met and nothing was
    exported.    missing: runs of the design without an answer.    later: when the last answer was stored that
    the witness knows and that is missing.    aside: where the damaged files are; None when nothing was wrong.
    """

    database: str
    saved: int
    exported: int = 0
    confirmed: int = 0
    damaged: tuple[str, ...] = ()
    missing: int = 0
    later: str = ""
    aside: str | None = None

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__} | {
            "damaged": list(self.damaged)
        }


def recovered(study: Study, folder: Path) -> list[Recovery]:
    """Save what can be read of the databases in a campaign's folder; what was done, one each.

    A sound database is left as it is. `recovery.json` in the folder says what was saved and what was not.

    Raises:
        StoreError: somebody works on the campaign, or the disk cannot be written.
    """
    found = []
    for name in DATABASES:
        path = folder / name
        if not path.exists() and not witness_says(path) and not _new(path).exists():
            continue
        lock = WriterLock.taken(path)
        try:
            found.append(_recovered(study, path))
        finally:
            lock.close()
    if not found:
        raise StoreError(f"no database {folder / DATABASES[0]}; `holdfast run` makes it")
    if any(one.aside for one in found):
        write_json(folder / "recovery.json", [one.to_dict() for one in found])
    return found


def _recovered(study: Study, path: Path) -> Recovery:
    if path.exists() and not _new(path).exists():
        state: Examination = examined(path)
        if all(check.ok for check in state.checks if check.name != "file"):
            saved = sum(row["status"] not in UNFINISHED for row in stock_of(path).rows["evaluation"].values())
            _end(path, witness_says(path).get("last"))
            return Recovery(database=path.name, saved=saved)
    earlier = sorted((path.parent / ASIDE).glob(f"*/{path.name}")) if _new(path).exists() else []
    stock = stock_of(*earlier[-1:], path)
    exports: list[Exported] = []
    if path.name == DATABASES[0]:
        version = _version(study, stock)
        model = study.spec(version=version).identity
        names = [response.name for response in study.responses]
        exports = exported_rows(path.parent, study.space, names, model=model, version=version)
        known = stock.rows["evaluation"]
        exports = [e for e in exports if e.key not in known or known[e.key]["status"] in UNFINISHED]
        for row in exports:
            known[row.key] = _as_row(row, study, stock, model=model, version=version, path=path)
    _write(stock, _new(path))
    aside = _put_aside(path)
    for suffix in ("-wal", "-shm"):
        path.with_name(f"{path.name}{suffix}").unlink(missing_ok=True)
    os.replace(_new(path), path)
    rows = stock.rows["evaluation"]
    answered = {key: row for key, row in rows.items() if row["status"] not in UNFINISHED}
    said = witness_says(path).get("last")
    last = max(answered.values(), key=lambda row: row["finished"] or 0.0, default=None)
    _end(path, None if last is None else {"key": last["key"], "finished": last["finished"] or 0.0})
    design = read_json(path.parent / "design.json") if path.name == DATABASES[0] else None
    wanted = design.get("run_keys", []) if isinstance(design, dict) else []
    lost = said is not None and (
        said["key"] not in answered or (answered[said["key"]]["finished"] or 0) < said["finished"]
    )
    return Recovery(
        database=path.name,
        saved=len(answered) - len(exports),
        exported=len(exports),
        confirmed=sum(row.confirmed for row in exports),
        damaged=tuple(sorted(stock.damaged - answered.keys())),
        missing=sum(key not in answered for key in wanted),
        later=moment(said["finished"]) if said is not None and lost else "",
        aside=str(aside),
    )


def recovery_lines(found: list[Recovery]) -> list[str]:
    """What was saved and what was not, for a person."""
    lines: list[str] = []
    for one in found:
        if one.aside is None:
            lines.append(f"{one.database}: sound, left as it is; {counted(one.saved, 'answered run')}")
            continue
        lines.append(f"{one.database}: {counted(one.saved, 'answered run')} saved, each as its checksum says")
        if one.exported:
            rest = one.exported - one.confirmed
            lines.append(
                f"  {one.exported} more from runs.csv, {one.confirmed} of them confirmed by results.nc"
            )
            lines += [f"  {rest} of these have values that nothing confirms: recovery.json"] if rest else []
        if one.damaged:
            shown = ", ".join(key[:10] for key in one.damaged[:5])
            lines.append(f"  {counted(len(one.damaged), 'run is', 'runs are')} damaged everywhere: {shown}")
        if one.later:
            lines.append(
                f"  an answer stored at {one.later} is not among them; others near it may be missing"
            )
        if one.missing:
            runs = counted(one.missing, "run of the design has", "runs of the design have")
            them = "it" if one.missing == 1 else "them"
            lines.append(f"  {runs} no answer; `holdfast run` makes {them}")
        lines.append(f"  the damaged files are in {one.aside}; whether other runs are missing cannot be told")
    return [part for line in lines for part in _in_columns(line)]


def _in_columns(line: str) -> list[str]:
    indent = len(line) - len(line.lstrip())
    return hanging(" " * indent, line.lstrip(), indent=indent + 2)


def _version(study: Study, stock: Stock) -> str:
    if study.model["kind"] == "table":
        from workbench.models.table import table_digest

        return table_digest(study.folder / study.model["file"])
    base = str(study.model["version"])
    return str(stock.rows["meta"].get(f"version {base}", {"value": base})["value"])


def _as_row(
    row: Exported, study: Study, stock: Stock, *, model: str, version: str, path: Path
) -> dict[str, Any]:
    """A run of the exports as a row of the table; when it ended is not known better than by the export."""
    exported = (path.parent / "runs.csv").stat().st_mtime
    text = json.dumps(study.readings, sort_keys=True)
    same = [r["id"] for r in stock.rows["reading"].values() if r["definition"] == text]
    return {
        **dict.fromkeys(CHECKED["evaluation"]),
        "key": row.key, "status": row.status, "attempt": 1, "batch": row.batch, "model": model,
        "version": version, "inputs": json.dumps(dict(row.inputs)),
        "outputs": json.dumps(dict(row.outputs)) if row.status == "ok" else None, "error": row.error or None,
        "created": exported, "finished": exported, "seed": study.seed, "reading": same[0] if same else None,
        "state": max(stock.rows["model_state"], default=None), "unanswered": 0,
    }  # fmt: skip


def _write(stock: Stock, new: Path) -> None:
    """The rows as a new database, whole and on the disk."""
    part = new.with_name(f"{new.name}.part")
    part.unlink(missing_ok=True)
    known = {name: set(stock.rows[name]) for name in ("reading", "model_state")}
    with explained(part):
        db = connected(part)
        try:
            db.execute("PRAGMA synchronous = FULL")
            db.executescript(f"BEGIN; {SCHEMA} PRAGMA user_version = {VERSION}; COMMIT;")
            db.execute("BEGIN IMMEDIATE")
            for table, columns in CHECKED.items():
                # the order of numbers is kept; an exported run has none and gets the next
                rows = sorted(
                    stock.rows[table].values(), key=lambda r: (r.get("id") is None, r.get("id") or 0)
                )
                for row in rows:
                    if table == "evaluation":
                        row = _released(row, known)
                    _insert(db, table, columns, row)
            db.execute("INSERT OR IGNORE INTO meta (key, value) VALUES ('created_with', 'recover')")
            db.execute("COMMIT")
        finally:
            db.close()
    os.replace(part, new)


def _insert(db: sqlite3.Connection, table: str, columns: tuple[str, ...], row: dict[str, Any]) -> None:
    text = f"INSERT INTO {table} ({', '.join(columns)}) VALUES ({', '.join('?' * len(columns))})"
    try:
        db.execute(text, [row[c] for c in columns])
    except sqlite3.IntegrityError:  # a number that two copies claim
        db.execute(text, [None if c == "id" else row[c] for c in columns])


def _released(row: dict[str, Any], known: dict[str, set[Any]]) -> dict[str, Any]:
    """A row whose owner is gone is queued; a reference to a row that was not saved is dropped."""
    row = {**row, "owner": None}
    if row["status"] == "running":
        row["status"] = "queued"
    for column, table in (("reading", "reading"), ("state", "model_state")):
        if row[column] not in known[table]:
            row[column] = None
    return row


def _put_aside(path: Path) -> Path:
    """A copy of the damaged files in a folder of their own."""
    place = path.parent / ASIDE / time.strftime("%Y%m%d-%H%M%S", time.gmtime())
    try:
        place.mkdir(parents=True, exist_ok=True)
        for suffix in ("", "-wal"):
            source = path.with_name(f"{path.name}{suffix}")
            if source.exists():
                shutil.copy2(source, place / source.name)
    except OSError as exc:
        raise StoreError(
            f"cannot keep a copy of {path} in {place}: {exc.strerror}. Free space, recover again"
        ) from exc
    return place


def _new(path: Path) -> Path:
    return path.with_name(f".{path.name}.recovered")


def _end(path: Path, last: dict[str, Any] | None) -> None:
    """The witness of the database as it is now."""
    Witness(path, last).close()
