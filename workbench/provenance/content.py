"""Digests of files by content, read once: a file of known size and times is not read again.

What was written within the last two seconds is: it may be written once more with the same size and time.
"""

import time
from collections.abc import Callable
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.system.atomic import read_json, write_json

__all__ = ["ContentCache", "digest_of"]

BLOCK = 1 << 18  # bytes read at a time: what the processor's own memory holds
SETTLED = 2_000_000_000  # ns; the coarsest clock of a file system


class ContentCache:
    """What was found in files, kept in a JSON file: path -> size, time, finding.

    keeps: whether `write` writes; a look at a campaign takes what is known there and leaves no trace
    """

    def __init__(self, path: Path | None, *, keeps: bool = True) -> None:
        self._path, self._keeps = path, keeps
        found = None if path is None else read_json(path)
        self._known: dict[str, list[Any]] = found if isinstance(found, dict) else {}
        self._changed = False

    def of(self, file: Path, find: Callable[[Path], Any]) -> Any:
        """What `find` says of the file, in plain types; asked again when its size or a time of it changed.

        Raises:
            OSError: the file cannot be read.
        """
        status = file.stat()
        name, stamp = f"{find.__name__} {file}", [status.st_size, status.st_mtime_ns, status.st_ctime_ns]
        known = self._known.get(name)
        if known is not None and known[0] == stamp:
            return known[1]
        finding = find(file)
        if time.time_ns() - status.st_mtime_ns > SETTLED:
            self._known[name] = [stamp, finding]
            self._changed = True
        return finding

    def write(self) -> None:
        """Keep what is new; without a place to write nothing is kept, and files are read again next time."""
        if self._path is not None and self._keeps and self._changed:
            write_json(self._path, self._known)
            self._changed = False


def digest_of(file: Path) -> str:
    """A digest of a file's bytes."""
    total = blake2b(digest_size=16)
    block = bytearray(BLOCK)
    seen = memoryview(block)
    with open(file, "rb", buffering=0) as source:
        while count := source.readinto(block):
            total.update(seen[:count])
    return total.hexdigest()
