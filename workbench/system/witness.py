"""What a database must hold at least, in a small file beside it: `.runs.sqlite.witness`, JSON.

After every commit of an answer its key and time are put there, without waiting for the disk; so the file is
never ahead of the database. When the database is closed, its size and digest join them. A log that was
removed, an older copy, a bit that turned over on the disk: each shows against the witness.
"""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from hashlib import blake2b
from pathlib import Path
from typing import Any

__all__ = ["Witness", "file_state", "has_log", "witness_says"]

ROOM = 512  # bytes, written over in place
CHUNK = 1 << 20


def witness_says(path: Path) -> dict[str, Any]:
    """What the witness of the file at `path` says: `last` (key, finished) and `file` (size, digest).

    Empty when there is no witness, or when it cannot be understood: then it is none.
    """
    try:
        found = json.loads(_beside(path).read_text())
        last, file = found.get("last"), found.get("file")
        if last is not None:
            last = {"key": str(last["key"]), "finished": float(last["finished"])}
        if file is not None:
            file = {"size": int(file["size"]), "digest": str(file["digest"])}
    except (OSError, ValueError, TypeError, KeyError, AttributeError):
        return {}
    return {"last": last, "file": file}


def file_state(path: Path) -> dict[str, Any] | None:
    """Size and digest of a file; None when it cannot be read."""
    digest = blake2b(digest_size=16)
    size = 0
    try:
        with open(path, "rb") as file:
            while part := file.read(CHUNK):
                digest.update(part)
                size += len(part)
    except OSError:
        return None
    return {"size": size, "digest": digest.hexdigest()}


def has_log(path: Path) -> bool:
    """Whether commits stand in a log beside the database; one who only looks may leave an empty one."""
    try:
        return path.with_name(f"{path.name}-wal").stat().st_size > 0
    except OSError:
        return False


class Witness:
    """The witness of a database that is open for writing. It may fail; the database may not."""

    def __init__(self, path: Path, last: Mapping[str, Any] | None) -> None:
        self._path = path
        self._last = last
        self._handle: int | None = None
        with suppress(OSError):
            self._handle = os.open(_beside(path), os.O_RDWR | os.O_CREAT, 0o644)
        self._write(None)

    def saw(self, key: str, finished: float) -> None:
        """The answer of a run was committed."""
        self._last = {"key": key, "finished": finished}
        self._write(None)

    def close(self) -> None:
        """The database was closed: everything is in its file, unless a reader keeps the log."""
        self._write(None if has_log(self._path) else file_state(self._path))
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

    def _write(self, file: Mapping[str, Any] | None) -> None:
        if self._handle is None:
            return
        text = json.dumps({"last": self._last, "file": file})
        with suppress(OSError):
            os.pwrite(self._handle, text.ljust(ROOM).encode(), 0)


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.name}.witness")
