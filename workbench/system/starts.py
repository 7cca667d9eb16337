"""Which runs were under way when their coordinator went: `.runs.sqlite.starts`, a line before and after each.

`+key` is written before a run begins, `-key` when its answer has come, to the page cache and not to the disk:
the death of a process keeps both, and the loss of power kills no coordinator a second time. A run whose end
cannot take the coordinator with it (`~key`) is not counted. When the coordinator ends as it should, the file
goes.
"""

import os
from contextlib import suppress
from pathlib import Path

__all__ = ["Starts", "unanswered_starts"]

LONGEST = 1_000_000  # bytes after which the lines of answered runs are dropped


def unanswered_starts(path: Path) -> list[str]:
    """Keys of runs that were begun and not answered by the last coordinator of the database at `path`."""
    found: dict[str, None] = {}
    try:
        lines = _beside(path).read_text(errors="replace").split("\n")
    except OSError:
        return []
    for line in lines[:-1]:  # what is not ended by a new line was not written whole
        if line.startswith("+"):
            found[line[1:]] = None
        elif line.startswith("-"):
            found.pop(line[1:], None)
    return list(found)


class Starts:
    """The starts of this coordinator. Where they cannot be written, nothing is counted."""

    def __init__(self, path: Path) -> None:
        self._path = _beside(path)
        self._under_way: dict[str, str] = {}
        self._size = 0
        self._handle: int | None = None
        with suppress(OSError):
            self._handle = os.open(self._path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o644)

    def begin(self, key: str, *, apart: bool = False) -> None:
        """A run is about to begin; `apart`: in a process whose end is not the coordinator's."""
        self._under_way[key] = "~" if apart else "+"
        self._write(f"{self._under_way[key]}{key}\n")

    def end(self, key: str) -> None:
        """A run was answered, or is not made after all."""
        if self._under_way.pop(key, None) is None:
            return
        self._write(f"-{key}\n")
        if self._size > LONGEST and self._handle is not None:
            with suppress(OSError):
                os.ftruncate(self._handle, 0)
            self._size = 0
            self._write("".join(f"{mark}{key}\n" for key, mark in self._under_way.items()))

    def close(self) -> None:
        """The coordinator ends as it should."""
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None
            self._path.unlink(missing_ok=True)

    def _write(self, text: str) -> None:
        if self._handle is not None:
            with suppress(OSError):
                self._size += os.write(self._handle, text.encode())


def _beside(path: Path) -> Path:
    return path.with_name(f".{path.name}.starts")
