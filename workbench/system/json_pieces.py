"""A JSON file of one mapping, read in pieces: of its long lists only a part is held, or nothing.

A window of text moves over the file. A list is cut behind one of its entries: text that ends in a bracket or
a quotation mark and is JSON up to there is a whole number of entries.
"""

import json
import re
from collections.abc import Collection, Iterator
from typing import Any, TextIO

__all__ = ["list_in_pieces", "without_lists"]

WINDOW = 1 << 20  # characters
BLANK = re.compile(r"\s*")
NEXT = (*",:]} \n\t\r",)  # what stands behind a value
ENDS = {"[": "]", '"': '"'}  # of an entry that begins so
UNSURE = {"[": '"{', '"': "\\"}  # signs in entries whose end is not known unread
DECODE = json.JSONDecoder().raw_decode


def without_lists(file: TextIO, names: Collection[str]) -> Any:
    """The content of the file; of a mapping without the entries `names`, which are passed over.

    Raises:
        ValueError: it is not JSON.
    """
    window = _Window(file)
    if window.next_sign() != "{":
        return window.value(last=True)
    found = {}
    for name in window.names():
        if name in names:
            window.pass_over()
        else:
            found[name] = window.value()
    return found


def list_in_pieces(file: TextIO, name: str) -> Iterator[list[Any]]:
    """The entries of the list `name` of a mapping, some at a time; nothing when it has no such entry.

    Raises:
        ValueError: it is not JSON as far as it was read, or the entry is no list.
    """
    window = _Window(file)
    if window.next_sign() != "{":
        return
    for found in window.names():
        if found == name:
            yield from window.pieces()
            return
        window.pass_over()


class _Window:
    """The part of the text that is held, and how far it was read."""

    def __init__(self, file: TextIO) -> None:
        self._file = file
        self._text = ""
        self._at = 0
        self._before = 0  # characters that were let go

    def names(self) -> Iterator[str]:
        """The names of a mapping; whoever takes one reads or passes over its value before the next."""
        self._at += 1
        while self.next_sign() != "}":
            name = self.value()
            if self.next_sign() != ":":
                raise self._strange("':'")
            self._at += 1
            yield name
            if self.next_sign() == ",":
                self._at += 1
            elif self.next_sign() != "}":
                raise self._strange("',' or '}'")
        self._at += 1
        if self.next_sign():
            raise self._strange("the end")

    def next_sign(self) -> str:
        """The next character that is not blank; empty at the end."""
        while True:
            self._at = BLANK.match(self._text, self._at).end()  # type: ignore[union-attr]
            if self._at < len(self._text) or not self._more():
                return self._text[self._at : self._at + 1]

    def value(self, *, last: bool = False) -> Any:
        """What stands here; `last`: nothing but blanks may follow."""
        self.next_sign()
        while True:
            try:
                found, end = DECODE(self._text, self._at)
            except ValueError:
                if not self._more():
                    raise
                continue
            if self._text[end : end + 1] in NEXT or not self._more():  # a number may go on behind the window
                break
        self._at = end
        if last and self.next_sign():
            raise self._strange("the end")
        return found

    def pass_over(self) -> None:
        """Leave the value that stands here: of a list next to nothing is read."""
        if self.next_sign() != "[":
            self.value()
            return
        self._at += 1
        for _ in self._entries(unread=True):
            pass

    def pieces(self) -> Iterator[list[Any]]:
        """The entries of the list that stands here, some at a time."""
        if self.next_sign() != "[":
            raise self._strange("a list")
        self._at += 1
        yield from self._entries(unread=False)

    def _entries(self, *, unread: bool) -> Iterator[list[Any]]:
        """Entries up to the end of the list; `unread`: but for those that were passed over as text."""
        tried = -1  # end of the window whose text was no whole number of entries
        while (sign := self.next_sign()) != "]":
            if sign == ",":
                self._at += 1
                continue
            last = ENDS.get(sign)
            if last and tried != self._before + len(self._text):
                close = self._close(sign, last)
                stop = 1 + (close if close >= 0 else self._text.rfind(last + ",", self._at))
                if stop == 0 and self._more():
                    continue
                part = self._text[self._at : stop]
                if unread and part and _is_plain(part, sign):
                    self._at = stop
                    continue
                try:
                    piece = json.loads(f"[{part}]") if part else []
                except ValueError:
                    piece = []
                if piece:
                    self._at = stop
                    yield piece
                    continue
                tried = self._before + len(self._text)
            yield [self.value()]
        self._at += 1

    def _close(self, sign: str, last: str) -> int:
        """Where the list may end behind an entry, -1 when it goes on behind the window.

        Behind a list of lists of numbers stands the next name of the mapping, or its end. One sign is looked
        for at a tenth of the cost of two.
        """
        if sign == "[" and all(self._text.find(behind, self._at) < 0 for behind in '"}'):
            return -1
        return self._text.find(last + "]", self._at)

    def _more(self) -> bool:
        """Let go what was read and take more of the file; whether there was more."""
        held = self._text[self._at :]
        more = self._file.read(max(WINDOW, len(held)))
        if not more:
            return False
        self._before, self._text, self._at = self._before + self._at, held + more, 0
        return True

    def _strange(self, wanted: str) -> ValueError:
        found = self._text[self._at : self._at + 1]
        return ValueError(f"expecting {wanted} at character {self._before + self._at}, found {found!r}")


def _is_plain(part: str, sign: str) -> bool:
    """Whether entries that begin with `sign` have no blanks and escapes, and end where the text does."""
    if any(found in part for found in UNSURE[sign] + " \n\t\r"):
        return False
    return part.count("[") == part.count("]") if sign == "[" else part.count('"') % 2 == 0
