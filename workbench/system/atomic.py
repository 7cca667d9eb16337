"""Files written whole: to a new name, synced, renamed. A reader sees old content or new, never a part."""

import json
import os
import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, BinaryIO

from workbench.errors import StoreError
from workbench.system.collecting import without_collecting

__all__ = ["read_json", "read_json_without", "replacing", "write_json", "write_text", "write_whole"]

SPACE, COLON, COMMA = (re.compile(p) for p in (r"\s*", r"\s*:\s*", r"\s*(?:,\s*|(?=\}))"))
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
    lists only a part is held as text.
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
        if not isinstance(value, list) or not value:
            yield dumped(value)
            continue
        for begin in range(0, len(value), PIECE):
            yield f"{',' if begin else '['}{dumped(value[begin : begin + PIECE])[1:-1]}"
        yield "]"
    yield "}\n" if data else "{}\n"


def read_json(path: Path) -> Any:
    """The content of a JSON file, None when there is no such file.

    Raises:
        StoreError: the file cannot be read or is not JSON.
    """
    try:
        with without_collecting():
            return json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as exc:
        raise StoreError(f"cannot read {path}: {exc}. Remove the file to have it made anew") from exc


def read_json_without(path: Path, names: Collection[str], *, above: int) -> Any:
    """`read_json`; of a file of more than `above` bytes that holds a mapping, without the entries `names`.

    Long lists of numbers, or of plain texts, are passed over unread: of a large file that takes no memory.
    """
    try:
        if path.stat().st_size <= above:
            return read_json(path)
    except OSError:
        return read_json(path)
    with without_collecting():
        try:
            return _read_without(path.read_text(encoding="utf-8"), names)
        except (OSError, ValueError) as exc:
            raise StoreError(f"cannot read {path}: {exc}. Remove the file to have it made anew") from exc


def _read_without(text: str, names: Collection[str]) -> Any:
    decode, found = json.JSONDecoder().raw_decode, {}
    at = SPACE.match(text, 0).end()  # type: ignore[union-attr]
    if text[at : at + 1] != "{":
        return json.loads(text)
    at = SPACE.match(text, at + 1).end()  # type: ignore[union-attr]
    while text[at : at + 1] != "}":
        name, at = decode(text, at)
        colon = COLON.match(text, at)
        if colon is None:
            raise json.JSONDecodeError("expecting ':'", text, at)
        if name in names:
            at = _end_of_list(text, colon.end()) or decode(text, colon.end())[1]
        else:
            found[name], at = decode(text, colon.end())
        comma = COMMA.match(text, at)
        if comma is None:
            raise json.JSONDecodeError("expecting ',' or '}'", text, at)
        at = comma.end()
    if text[at + 1 :].strip():
        raise json.JSONDecodeError("extra data", text, at + 1)
    return found


def _end_of_list(text: str, begin: int) -> int | None:
    """Behind a list of lists of numbers, or of texts without escapes; None where it may be another."""
    for start, end, strange in (("[[", "]]", '"'), ('["', '"]', "\\")):
        if text.startswith(start, begin):
            close = text.find(end, begin)
            if close > 0 and text.find(strange, begin, close) < 0:
                return close + 2
    return None


def _sync_folder(folder: Path) -> None:
    """Make the rename itself durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError:
        pass  # some network file systems cannot sync a folder; the file itself is synced
    finally:
        os.close(handle)
