"""The file of a database: its lock, the file system it is on, connections, errors as messages."""

import fcntl
import os
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workbench.errors import StoreError

__all__ = ["NETWORK", "connected", "explained", "file_system", "tables", "take_lock"]

# file systems on which a write-ahead log is not safe
NETWORK = frozenset(
    "9p afs beegfs ceph cifs fuse.glusterfs fuse.sshfs gpfs lustre nfs nfs4 orangefs panfs smb3 smbfs".split()
)


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


def take_lock(path: Path) -> int:
    """An exclusive lock beside the database, given up by the kernel when this process ends."""
    try:
        handle = os.open(path.with_name(f".{path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as exc:
        raise StoreError(f"cannot write in {path.parent}: {exc.strerror}. Choose another --folder") from exc
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(handle)
        raise StoreError(f"{path.parent} is in use by another holdfast; wait for it or stop it") from None
    return handle


def connected(path: Path) -> sqlite3.Connection:
    """A connection in which transactions are begun by hand."""
    try:
        return sqlite3.connect(path, isolation_level=None, timeout=30.0, check_same_thread=False)
    except sqlite3.Error as exc:
        raise StoreError(f"cannot open {path}: {exc}") from exc


def tables(db: sqlite3.Connection) -> set[str]:
    """The names of its tables."""
    return {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}


@contextmanager
def explained(path: Path) -> Iterator[None]:
    """Turn an error of the database into a StoreError."""
    try:
        yield
    except sqlite3.Error as exc:
        raise StoreError(
            f"{path}: {exc}. Nothing that was acknowledged is lost; free space or mend the disk, run again"
        ) from exc
