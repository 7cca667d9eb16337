"""What is wrong with a store: a finding per check, and what a check could not look at. Nothing is written."""

import sqlite3
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.campaign.integrity.checksums import CHECKED, check_store, wrong_rows
from workbench.campaign.rescue.stock import stock_of
from workbench.campaign.store_schema import VERSION
from workbench.errors import StoreError
from workbench.histories.store import FILE, HistoryStore
from workbench.report.lines.tables import hanging
from workbench.space.units import counted
from workbench.system.database import explained, opened_for_reading, tables
from workbench.system.one_writer import holder_of
from workbench.system.witness import file_state, has_log, witness_says

__all__ = ["DATABASES", "Check", "Examination", "examined", "examined_histories"]

DATABASES = ("runs.sqlite", "layouts.sqlite")  # of a campaign's folder
SHOWN = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One look: at what, whether it found everything in order, and in which words."""

    name: str
    ok: bool
    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Examination:
    """The checks of the database at `path`."""

    path: Path
    checks: tuple[Check, ...]

    @property
    def is_sound(self) -> bool:
        """Whether no check found anything wrong."""
        return all(check.ok for check in self.checks)

    def lines(self) -> list[str]:
        """For a person."""
        lines = [str(self.path)]
        for check in self.checks:
            begin = f"{'ok ' if check.ok else 'BAD'}  {check.name:<11} "
            lines += hanging(begin, check.text, indent=len(begin))
        return lines

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        checks = [{"check": c.name, "ok": c.ok, "text": c.text} for c in self.checks]
        return {"database": str(self.path), "sound": self.is_sound, "checks": checks}


def examined(path: Path) -> Examination:
    """Look at the whole file: against its digest, its pages, the checksum of every row, and its witness.

    Raises:
        StoreError: there is no such file, or it may not be read.
    """
    said = witness_says(path)
    if not path.exists() and not said:
        raise StoreError(f"no database {path}; `holdfast run` makes it")
    checks = [_file(path, said)]
    try:
        db, unseen = opened_for_reading(path)
    except StoreError as exc:
        return Examination(
            path=path, checks=(*checks, Check(name="opening", ok=False, text=str(exc)), _stock(path))
        )
    try:
        checks += [_pages(db, path), *_rows(db, path), _last(db, path, said)]
    finally:
        db.close()
    if unseen:
        checks.append(Check(name="unseen", ok=False, text=unseen))
    if not all(check.ok for check in checks):
        checks.append(_stock(path))
    return Examination(path=path, checks=tuple(checks))


def examined_histories(folder: Path) -> Examination | None:
    """Look at every time history of the campaign in `folder`; None where there are none."""
    path = folder / FILE
    try:
        store = HistoryStore.reading(folder)
        if store is None:
            return None
        with store:
            wrong, counts = store.wrong(), store.names()
    except StoreError as exc:
        return Examination(path=path, checks=(Check(name="histories", ok=False, text=str(exc)),))
    if wrong:
        more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
        check = Check(name="histories", ok=False, text="; ".join(wrong[:SHOWN]) + more)
    else:
        said = ", ".join(f"{count} of {name}" for name, count in counts.items())
        check = Check(name="histories", ok=True, text=f"as they were stored: {said or 'none'}")
    return Examination(path=path, checks=(check,))


def _file(path: Path, said: dict[str, Any]) -> Check:
    """The file against what it was when it was closed."""
    closed = said.get("file")
    if holder_of(path) is not None or closed is None or has_log(path):
        why = (
            "it is open" if holder_of(path) is not None else "it was not closed, or before there were digests"
        )
        return Check(
            name="file", ok=True, text=f"not compared with its digest: {why}; unused bytes are unchecked"
        )
    now = file_state(path)
    if now == closed:
        return Check(name="file", ok=True, text=f"{closed['size']} bytes as they were when it was closed")
    size = "gone" if now is None else f"{now['size']} bytes, {closed['size']} when it was closed"
    return Check(name="file", ok=False, text=f"changed since holdfast closed it ({size})")


def _pages(db: sqlite3.Connection, path: Path) -> Check:
    try:
        with explained(path):
            wrong = [text for (text,) in db.execute("PRAGMA integrity_check") if text != "ok"]
    except StoreError as exc:
        return Check(name="pages", ok=False, text=str(exc))
    if not wrong:
        return Check(name="pages", ok=True, text="every page is in order for SQLite")
    more = f" and {len(wrong) - SHOWN} more" if len(wrong) > SHOWN else ""
    return Check(
        name="pages", ok=False, text="; ".join(" ".join(text.split()) for text in wrong[:SHOWN]) + more
    )


def _rows(db: sqlite3.Connection, path: Path) -> list[Check]:
    """The checksums of all tables."""
    try:
        with explained(path):
            (version,) = db.execute("PRAGMA user_version").fetchone()
            missing = set(CHECKED) - tables(db)
            if version < VERSION and "gradient" not in missing:
                text = f"none before schema {VERSION} (this is {version}); the next `holdfast run` makes them"
                return [Check(name="checksums", ok=not missing, text=text)]
            if missing or version != VERSION:
                text = f"schema {version}; tables missing: {', '.join(sorted(missing)) or 'none'}"
                return [Check(name="schema", ok=False, text=text)]
            wrong = wrong_rows(db)
            counts = {t: db.execute(f"SELECT COUNT(*) FROM {t}").fetchone()[0] for t in CHECKED}
    except StoreError as exc:
        return [Check(name="checksums", ok=False, text=str(exc))]
    if not wrong:
        runs = counted(counts.pop("evaluation"), "run")
        beside = counted(sum(counts.values()), "row")
        text = f"{runs} and {beside} beside them, all as they were stored"
        return [Check(name="checksums", ok=True, text=text)]
    parts = [
        f"{len(numbers)} of {table} ({', '.join(map(str, numbers[:SHOWN]))}"
        f"{', ...' if len(numbers) > SHOWN else ''})"
        for table, numbers in wrong.items()
    ]
    return [
        Check(name="checksums", ok=False, text=f"rows that are not as they were stored: {'; '.join(parts)}")
    ]


def _last(db: sqlite3.Connection, path: Path, said: dict[str, Any]) -> Check:
    """The last answer that the witness knows."""
    if said.get("last") is None:
        return Check(
            name="answers", ok=True, text="no witness names a last answer; the latest may be missing unseen"
        )
    try:
        with explained(path):
            check_store(db, path, said, thoroughly=False)
    except StoreError as exc:
        return Check(name="answers", ok=False, text=str(exc))
    return Check(name="answers", ok=True, text="the last answer that was stored is there")


def _stock(path: Path) -> Check:
    """What `holdfast recover` would find in the file and its log."""
    found = stock_of(path)
    good = sum(row["status"] not in ("queued", "running") for row in found.rows["evaluation"].values())
    damaged = f", {len(found.damaged)} damaged" if found.damaged else ""
    whole = counted(good, "answered run is", "answered runs are")
    text = f"{whole} whole{damaged}; `holdfast recover` saves them"
    return Check(name="to recover", ok=False, text=text)
