"""A file of SQLite: the file system it is on, connections that write or only read, errors as messages.

Whoever only looks needs no right to write. A store that somebody writes is read beside the writer
(`mode=ro`). Where that is impossible, because SQLite would have to make a file beside the database and must
not (a read-only mount, another user's folder), nobody else can be writing through this door either, and the
file is read as it stands; answers that are still in its log are then read from a copy of both.
"""

import os
import shutil
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from hashlib import blake2b
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from workbench.errors import StoreError

__all__ = [
    "NETWORK",
    "connected",
    "explained",
    "file_system",
    "opened_for_reading",
    "row_checksum",
    "tables",
    "transaction",
]

# file systems on which a write-ahead log is not safe
NETWORK = frozenset(
    "9p afs beegfs ceph cifs fuse.glusterfs fuse.sshfs gpfs lustre nfs nfs4 orangefs panfs smb3 smbfs".split()
)
WAIT = 30.0  # s that a connection waits for another's transaction
DAMAGE = {sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB}
UNREADABLE = ("decode to UTF-8", "user-defined function", "malformed")  # what a damaged text says
TRIES = 3  # copies that are begun while the file changes, before it is read as it stands


def file_system(folder: Path) -> str:
    """The type of the file system that holds `folder`, as the kernel lists it; empty when unknown."""
    best, kind = "", ""
    try:
        mounts = Path("/proc/mounts").read_text(errors="replace").splitlines()
    except OSError:
        return ""
    place = f"{folder.resolve()}/"
    for line in mounts:
        _, point, name, *_ = line.split(" ")
        point = point.replace("\\040", " ").rstrip("/") + "/"
        if place.startswith(point) and len(point) >= len(best):
            best, kind = point, name
    return kind


@contextmanager
def transaction(db: sqlite3.Connection) -> Iterator[None]:
    """All writes inside are on the disk at the end, or none; the first error is the one that is raised."""
    db.execute("BEGIN IMMEDIATE")
    try:
        yield
        db.execute("COMMIT")
    except BaseException:
        if db.in_transaction:
            with suppress(sqlite3.Error):
                db.execute("ROLLBACK")
        raise


def connected(path: Path) -> sqlite3.Connection:
    """A connection in which transactions are begun by hand."""
    try:
        db = sqlite3.connect(path, isolation_level=None, timeout=WAIT, check_same_thread=False)
    except sqlite3.Error as exc:
        raise StoreError(f"cannot open {path}: {exc}") from exc
    _add_checksums(db)
    return db


def row_checksum(*values: Any) -> bytes:
    """Eight bytes that follow the values of a row as SQLite gives them; also a function in our SQL.

    >>> row_checksum("meta", "key", "value").hex()
    'ec4070cbfd56c5b7'
    """
    return blake2b(repr(values).encode(errors="surrogatepass"), digest_size=8).digest()


def _add_checksums(db: sqlite3.Connection) -> None:
    db.create_function("row_checksum", -1, row_checksum, deterministic=True)


def opened_for_reading(path: Path) -> tuple[sqlite3.Connection, str]:
    """A connection that cannot write, and in words what it cannot see; empty when it sees everything.

    Raises:
        StoreError: there is no such file, or it may not be read.
    """
    if not path.exists():
        raise StoreError(f"no database {path}; `holdfast run` makes it")
    if not os.access(path, os.R_OK):
        raise StoreError(f"{path} may not be read by you; ask whom it belongs to for the right to read it")
    try:
        if not _would_be_strange(path):
            return _queried(f"{path.resolve().as_uri()}?mode=ro"), ""
    except sqlite3.OperationalError:
        pass  # SQLite would have to make or to write a file beside it
    except (sqlite3.Error, UnicodeDecodeError) as exc:
        with explained(path):
            raise exc
    log = path.with_name(f"{path.name}-wal")
    with explained(path):
        if not _size(log):
            return _queried(f"{path.resolve().as_uri()}?immutable=1"), ""
        for _ in range(TRIES):
            copy = _copied(path, log)
            if copy is not None:
                return copy, ""
        unseen = f"answers that are still in {log.name} ({_size(log)} bytes) cannot be seen from here"
        return _queried(f"{path.resolve().as_uri()}?immutable=1"), unseen


def _would_be_strange(path: Path) -> bool:
    """Whether SQLite would make a file beside the database that its owner then could not write."""
    owner, me = path.stat().st_uid, os.geteuid()
    return me not in (0, owner) and not path.with_name(f"{path.name}-shm").exists()


def tables(db: sqlite3.Connection) -> set[str]:
    """The names of its tables."""
    return {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn an error of the database into a StoreError."""
    try:
        yield
    except (sqlite3.Error, UnicodeDecodeError) as exc:  # the second: SQLite quotes what is no text any more
        if _is_damage(exc):
            raise StoreError(
                f"{path} is damaged ({exc}). `holdfast doctor --store` says what is wrong, `holdfast "
                "recover` saves what can be read"
            ) from exc
        raise StoreError(
            f"{path}: {exc}. Free space or mend the disk, then run again: it continues from what is stored"
        ) from exc


def _is_damage(exc: sqlite3.Error | UnicodeDecodeError) -> bool:
    if isinstance(exc, UnicodeDecodeError):
        return True
    code = getattr(exc, "sqlite_errorcode", None)
    return (code is not None and code & 0xFF in DAMAGE) or any(text in str(exc) for text in UNREADABLE)


def _queried(uri: str) -> sqlite3.Connection:
    """A connection that has answered a first query."""
    db = sqlite3.connect(uri, uri=True, isolation_level=None, timeout=WAIT, check_same_thread=False)
    try:
        _add_checksums(db)
        db.execute("PRAGMA query_only = ON")
        db.execute("SELECT COUNT(*) FROM sqlite_master").fetchone()
    except BaseException:
        db.close()
        raise
    return db


def _copied(path: Path, log: Path) -> sqlite3.Connection | None:
    """The database with what is in its log, in memory; None when they changed while they were copied."""
    before = _state(path), _state(log)
    with TemporaryDirectory(prefix="holdfast-look-") as name:
        place = Path(name)
        with suppress(FileNotFoundError):
            for file in (path, log):
                shutil.copyfile(file, place / file.name)
        if (_state(path), _state(log)) != before:
            return None
        whole = connected(place / path.name)
        memory = sqlite3.connect(":memory:", isolation_level=None, check_same_thread=False)
        try:
            _add_checksums(memory)
            whole.backup(memory)
            memory.execute("PRAGMA query_only = ON")
        except BaseException:
            memory.close()
            raise
        finally:
            whole.close()
    return memory


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _state(path: Path) -> tuple[int, int] | None:
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns
