"""The records in a file of SQLite and in its log, read page by page without SQLite.

SQLite follows pointers from the first page, so that one lost page hides all rows behind it. Here every page
is looked at by itself: a leaf of a table holds whole rows. Which table a row is of, and whether it is as it
was stored, its checksum tells. The format is that of https://sqlite.org/fileformat2.html; section numbers
are given below.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

__all__ = ["Pages", "Record"]

HEADER, LOG_HEADER, FRAME_HEADER = 100, 32, 24  # bytes: 1.3, 4.1
OTHERS = (b"\x02", b"\x05", b"\x0a")  # marks of indices and of inner pages: 1.6
SIZES = tuple(2**k for k in range(9, 17))
USUAL = 4096
SIZES_OF = (0, 1, 2, 3, 4, 6, 8, 8, 0, 0)  # bytes of a value by its type, below the texts: 2.1
LONGEST = 50_000_000  # bytes of a row: a longer one is a damaged length
SERIAL = {1: ">b", 2: ">h", 4: ">i", 6: ">q", 7: ">d"}  # 2.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """A row as it stands in a page: its number, its cells, and how late it was written (0: in the file)."""

    rowid: int
    cells: tuple[Any, ...]
    age: int


class Pages:
    """The pages of a database and of its log, oldest first. `len` is their number, index pages included."""

    def __init__(self, path: Path) -> None:
        data, log = _bytes(path), _bytes(path.with_name(f"{path.name}-wal"))
        size = _page_size(data, log)
        self._usable = size - (data[20] if data[:6] == b"SQLite" and len(data) > 20 and data[20] < 64 else 0)
        count = -(-len(data) // size)
        self._current = {n + 1: data[n * size : (n + 1) * size] for n in range(count)}
        self._pages = [(number, page, 0) for number, page in self._current.items()]
        for age, (number, page) in enumerate(_frames(log, size), start=1):
            self._current[number] = page
            self._pages.append((number, page, age))

    def __len__(self) -> int:
        return len(self._pages)

    def rows(self, k: int) -> list[Record]:
        """The rows that the k-th page names; of any table. A cell that cannot be read is left out."""
        number, page, age = self._pages[k]
        start = HEADER if number == 1 else 0
        if page[start : start + 1] in (b"", *OTHERS):
            return []
        count = int.from_bytes(page[start + 3 : start + 5], "big")
        places = range(start + 8, start + 8 + 2 * min(count, self._usable // 4), 2)
        found = (self._row(page, int.from_bytes(page[at : at + 2], "big"), age) for at in places)
        return [row for row in found if row is not None]

    def rows_anywhere(self, k: int) -> list[Record]:
        """What looks like a row at any place of the k-th page, whose head may be damaged; not of an index."""
        number, page, age = self._pages[k]
        start = HEADER if number == 1 else 0
        if page[start : start + 1] in OTHERS:
            return []
        found = (self._row(page, place, age) for place in range(len(page) - 4) if page[place])
        return [row for row in found if row is not None]

    def _row(self, page: bytes, place: int, age: int) -> Record | None:
        try:
            length, place = _varint(page, place)
            rowid, place = _varint(page, place)
            if not 0 < length <= LONGEST or not 0 < page[place] <= 127:
                return None
            payload = _payload(page, place, length, self._usable, self._current)
            return Record(rowid=rowid - (1 << 64) * (rowid >> 63), cells=_cells(payload), age=age)
        except (IndexError, KeyError, ValueError, struct.error):
            return None


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError:
        return b""


def _page_size(data: bytes, log: bytes) -> int:
    """Of the file's header (1.3.2), else of the log's (4.1), else the usual."""
    found = int.from_bytes(data[16:18], "big")
    candidates = (65536 if found == 1 else found, int.from_bytes(log[8:12], "big"))
    return next((size for size in candidates if size in SIZES), USUAL)


def _frames(log: bytes, size: int) -> Iterator[tuple[int, bytes]]:
    """Number and content of pages in the log; frames of an earlier round of it have other salts."""
    salts = {log[16:24], log[LOG_HEADER + 8 : LOG_HEADER + 16]}  # of the header, and of the first frame
    for place in range(LOG_HEADER, len(log), FRAME_HEADER + size):
        head = log[place : place + FRAME_HEADER]
        if len(head) == FRAME_HEADER and head[8:16] in salts:
            yield int.from_bytes(head[:4], "big"), log[place + FRAME_HEADER : place + FRAME_HEADER + size]


def _payload(page: bytes, place: int, length: int, usable: int, current: Mapping[int, bytes]) -> bytes:
    """The bytes of a row; what does not fit the leaf follows in a chain of pages (1.6, 1.7)."""
    most = usable - 35
    if length <= most:
        found = page[place : place + length]
    else:
        least = (usable - 12) * 32 // 255 - 23
        local = least + (length - least) % (usable - 4)
        local = local if local <= most else least
        parts = [page[place : place + local]]
        got, follows = local, int.from_bytes(page[place + local : place + local + 4], "big")
        while got < length:
            more = current[follows]
            parts.append(more[4:usable])
            got += usable - 4
            follows = int.from_bytes(more[:4], "big")
            if len(more) < 4:
                raise ValueError("a chain that ends early")
        found = b"".join(parts)[:length]
    if len(found) < length:
        raise ValueError("a row that is cut off")
    return found


def _cells(payload: bytes) -> tuple[Any, ...]:
    """The values of a row (2.1)."""
    end, place = _varint(payload, 0)
    types = []
    left = len(payload) - end  # bytes for the values that are not named yet; most places end the search here
    while place < end and left >= 0:
        kind, place = _varint(payload, place)
        types.append(kind)
        left -= _size(kind)
    if place != end or left != 0:
        raise ValueError("no row begins here")
    cells: list[Any] = []
    for kind in types:
        if kind in (0, 8, 9):
            cells.append(None if kind == 0 else kind - 8)
            continue
        size = _size(kind)
        part = payload[place : place + size]
        place += size
        if kind in SERIAL:
            cells.append(struct.unpack(SERIAL[kind], part)[0])
        elif kind in (3, 5):
            cells.append(int.from_bytes(part, "big", signed=True))
        else:
            cells.append(part if kind % 2 == 0 else part.decode())
    return tuple(cells)


def _size(kind: int) -> int:
    """Bytes of a value (2.1)."""
    if kind in (10, 11):
        raise ValueError("a type that is not used")
    return SIZES_OF[kind] if kind < len(SIZES_OF) else (kind - 12) // 2


def _varint(data: bytes, place: int) -> tuple[int, int]:
    """A number of one to nine bytes (1.6), and the place behind it."""
    value = 0
    for k in range(8):
        byte = data[place + k]
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            return value, place + k + 1
    return value << 8 | data[place + 8], place + 9
