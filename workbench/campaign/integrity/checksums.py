"""A checksum per row of every table, kept by triggers, and how rows and a whole database are held against it.

A trigger writes the checksum in the statement that writes the row, whichever statement that is. It is taken
from the row as it is stored, with the name of its table (`workbench.system.database.row_checksum`).
"""

import sqlite3
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench.errors import StoreError
from workbench.space.units import counted
from workbench.system.database import explained, opened_for_reading, tables
from workbench.system.one_writer import moment
from workbench.system.witness import file_state, has_log

__all__ = ["CHECKED", "CHECKSUMS", "REALS", "check_file", "check_store", "is_sound", "wrong_rows"]

# table -> its columns in the order in which they stand in the file; the checksum follows
CHECKED = {
    "evaluation": (
        "id", "key", "status", "attempt", "batch", "model", "version", "inputs", "outputs", "error", "log",
        "created", "started", "finished", "wall", "cpu", "host", "seed", "owner", "reading", "state", "kept",
        "former", "unanswered",
    ),
    "attempt": (
        "id", "key", "attempt", "status", "reason", "outputs", "error", "log", "finished", "wall", "cpu",
        "host",
    ),
    "gradient": ("key", "slopes"),
    "reading": ("id", "definition"),
    "model_state": ("id", "digest", "same_as", "content", "seen"),
    "meta": ("key", "value"),
}  # fmt: skip
REALS = frozenset({"created", "started", "finished", "wall", "cpu", "seen"})
SMALL = 64_000_000  # bytes of a file whose digest is looked at whenever it is opened: 0.06 s


def is_sound(table: str) -> str:
    """The SQL expression that says whether a row of the table is as it was stored."""
    return f"row_checksum('{table}', {', '.join(CHECKED[table])}) IS checksum"


def _triggers(table: str) -> str:
    columns = ", ".join(CHECKED[table])
    kept = f"UPDATE {table} SET checksum = row_checksum('{table}', {columns}) WHERE rowid = NEW.rowid"
    return (
        f"CREATE TRIGGER {table}_added AFTER INSERT ON {table} BEGIN {kept}; END;\n"
        f"CREATE TRIGGER {table}_changed AFTER UPDATE OF {columns} ON {table} BEGIN {kept}; END;\n"
    )


CHECKSUMS = "".join(f"ALTER TABLE {table} ADD COLUMN checksum BLOB;\n{_triggers(table)}" for table in CHECKED)


def wrong_rows(db: sqlite3.Connection) -> dict[str, list[int]]:
    """Numbers of rows that are not as they were stored, by table; tables without any are left out.

    Raises:
        sqlite3.Error: a table cannot be read to its end.
    """
    found = {
        table: [n for (n,) in db.execute(f"SELECT rowid FROM {table} WHERE NOT ({is_sound(table)})")]
        for table in CHECKED
    }
    return {table: numbers for table, numbers in found.items() if numbers}


def _was_changed(path: Path, said: Mapping[str, Any]) -> bool:
    """Whether a file that is quick to read is not as it was when holdfast closed it."""
    closed = said.get("file")
    if closed is None or has_log(path) or not path.exists():
        return False
    if path.stat().st_size != closed["size"]:
        return True
    return closed["size"] <= SMALL and file_state(path) != closed


def check_store(db: sqlite3.Connection, path: Path, said: Mapping[str, Any], *, thoroughly: bool) -> None:
    """Hold a database against its witness; `thoroughly`: and every page and row against itself.

    Raises:
        StoreError: it lacks an answer that was stored, or is damaged.
    """
    last = said.get("last")
    if last is not None:
        there = (
            db.execute("SELECT finished FROM evaluation WHERE key = ?", [last["key"]]).fetchone()
            if "evaluation" in tables(db)
            else None
        )
        if there is None or there[0] is None or there[0] < last["finished"]:
            raise StoreError(
                f"{path} lacks answers that were stored: the last known, of run {last['key'][:10]}, was "
                f"stored at {moment(last['finished'])}. Its log was removed, or another copy was put in its "
                "place. `holdfast recover` saves what there is and says what is missing; to begin anew, "
                f"remove .{path.name}.witness with the database"
            )
    if not thoroughly:
        return
    wrong = [text for (text,) in db.execute("PRAGMA integrity_check") if text != "ok"]
    rows = wrong_rows(db)
    if wrong or rows:
        counts = ", ".join(
            counted(len(n), f"row of {table}", f"rows of {table}") for table, n in rows.items()
        )
        what = "; ".join([*wrong[:1], *([f"not as they were stored: {counts}"] if rows else [])])
        raise StoreError(
            f"{path} is damaged: {what}. `holdfast doctor --store` says what is wrong, "
            "`holdfast recover` saves what can be read"
        )


def check_file(path: Path, said: Mapping[str, Any]) -> None:
    """`check_store` of a file without touching it: a connection that may write drops a damaged log."""
    db, _ = opened_for_reading(path)
    try:
        with explained(path):
            check_store(db, path, said, thoroughly=_was_changed(path, said))
    finally:
        db.close()
