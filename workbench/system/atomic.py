"""Files written whole: to a new name, synced, renamed. A reader sees old content or new, never a part."""

import json
import os
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from workbench.errors import StoreError
from workbench.system.collecting import without_collecting
from workbench.system.json_pieces import list_in_pieces, without_lists

__all__ = [
    "read_json",
    "read_json_list",
    "read_json_without",
    "replacing",
    "write_json",
    "write_text",
    "write_whole",
]

PIECE = 20_000  # entries of a list that are written at once


def write_whole(path: Path, content: bytes | Iterable[bytes]) -> None:
    """Replace the file at `path` by `content`, whole or in pieces, or leave it untouched.

    Raises:
        StoreError: the disk is full, the folder read-only or gone.
    """
    with replacing(path) as file:
        file.writelines([content] if isinstance(content, bytes) else content)


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """A new file, open for writing; at the end of the block it is the file at `path`, after an error nothing.

    Raises:
        StoreError: as `write_whole`.
    """
    new = path.with_name(f".{path.name}.new")
    try:
        with open(new, "wb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
        _sync_folder(path.parent)
    except StoreError:  # of what was to be written: it is no trouble with the disk
        new.unlink(missing_ok=True)
        raise
    except OSError as exc:
        new.unlink(missing_ok=True)
        raise StoreError(
            f"cannot write {path}: {exc.strerror or exc}. Free space or choose another --folder"
        ) from exc
    except BaseException:
        new.unlink(missing_ok=True)
        raise


def write_text(path: Path, text: str) -> None:
    """`write_whole` for text in UTF-8."""
    write_whole(path, text.encode())


def write_json(path: Path, data: Any, *, compact: bool = False) -> None:
    """`write_whole` for JSON: sorted keys, full precision, no NaN (it is not JSON).

    `compact`: in one line, a fifth of the time, for a mapping that nobody reads line by line; of its long
    lists only a part is held as text. A list may be given as an iterator of its pieces, which are lists.
    """
    if compact:
        write_whole(path, (text.encode() for text in _compact(data)))
    else:
        text = json.dumps(data, sort_keys=True, allow_nan=False, ensure_ascii=False, indent=1)
        write_text(path, text + "\n")


def _compact(data: Mapping[str, Any]) -> Iterator[str]:
    """A mapping in one line, its lists in pieces."""

    def dumped(value: Any) -> str:
        return json.dumps(value, sort_keys=True, allow_nan=False, ensure_ascii=False, separators=(",", ":"))

    for k, name in enumerate(sorted(data)):
        yield f"{',' if k else '{'}{dumped(name)}:"
        value = data[name]
        if not isinstance(value, list | Iterator):
            yield dumped(value)
            continue
        sign = "["
        for piece in filter(None, _parts(value) if isinstance(value, list) else value):
            yield f"{sign}{dumped(piece)[1:-1]}"
            sign = ","
        yield "]" if sign == "," else "[]"
    yield "}\n" if data else "{}\n"


def _parts(entries: list[Any]) -> Iterator[list[Any]]:
    for begin in range(0, len(entries), PIECE):
        yield entries[begin : begin + PIECE]


def read_json(path: Path) -> Any:
    """The content of a JSON file, None when there is no such file.

    Raises:
        StoreError: the file cannot be read or is not JSON.
    """
    with _readable(path), without_collecting():
        try:
            return json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            return None


def read_json_without(path: Path, names: Collection[str], *, above: int) -> Any:
    """`read_json`; of a file of more than `above` bytes that holds a mapping, without the entries `names`.

    What is left out is not held, nor is more than a part of the file at once.
    """
    try:
        if path.stat().st_size <= above:
            return read_json(path)
    except OSError:
        return read_json(path)
    with _readable(path), without_collecting(), path.open(encoding="utf-8") as file:
        return without_lists(file, names)


def read_json_list(path: Path, name: str) -> Iterator[list[Any]]:
    """The entries of a long list of a mapping, some at a time; nothing when it has none of that name.

    Raises:
        StoreError: the file cannot be read, or is not JSON so far.
    """
    with _readable(path), path.open(encoding="utf-8") as file:
        yield from list_in_pieces(file, name)


@contextmanager
def _readable(path: Path) -> Iterator[None]:
    try:
        yield
    except (OSError, ValueError) as exc:
        raise StoreError(f"cannot read {path}: {exc}. Remove the file to have it made anew") from exc


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        pass  # some network file systems cannot sync a folder; the file itself is synced
    finally:
        os.close(handle)
