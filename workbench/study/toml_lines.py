"""Where a key stands in a TOML file: tomllib gives the values only, a message needs the line.

A light scan of headers and keys; it looks at one line at a time and skips the inside of multi-line strings. A
key path that it cannot place (inside an inline table, say) gets the line of the longest prefix that it can.
"""

import re
from collections.abc import Mapping, Sequence
from functools import lru_cache

from workbench.study.expectations import ONE_EACH

__all__ = ["cure_of_line", "find_line"]

HEADER = re.compile(r"^\s*(\[\[?)\s*([^\[\]]+?)\s*\]\]?\s*(#.*)?$")
KEY = re.compile(
    r"""^\s*((?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*')(?:\s*\.\s*(?:[A-Za-z0-9_-]+|"[^"]*"|'[^']*'))*)\s*="""
)
COMMA = re.compile(r"=\s*([+-]?\d+),(\d+)\s*(?:#.*)?$")
WORD = re.compile(r"^\s*([\w.-]+)\s*=\s*([^\W\d][^\"'#=\[\]{}]*?)\s*(?:#.*)?$")
PART = re.compile(r"""[A-Za-z0-9_-]+|"[^"]*"|'[^']*'""")

Path = tuple[str | int, ...]


def cure_of_line(text: str, refused: str) -> str:
    """What to write in place of the line that tomllib `refused`, in a sentence; "" where that is not known.

    >>> cure_of_line("a = 1\\nupper = 1,5", "Expected newline (at line 2, column 10)")
    '. Numbers have a decimal point: 1.5'
    >>> cure_of_line("unit = kN", "Invalid value (at line 1, column 8)")
    '. Words stand in quotes: unit = "kN"'
    """
    at = re.search(r"at line (\d+)", refused)
    lines = text.splitlines()
    if at is None or int(at[1]) > len(lines):
        return ""
    line = lines[int(at[1]) - 1]
    if comma := COMMA.search(line):
        return f". Numbers have a decimal point: {comma[1]}.{comma[2]}"
    header = HEADER.match(line)
    if header and header[1] == "[" and _parts(header[2]) in ONE_EACH:
        return f". One of several has double brackets: [[{header[2]}]]"
    if word := WORD.match(line):
        return f'. Words stand in quotes: {word[1]} = "{word[2]}"'
    return ""


def find_line(text: str, path: Sequence[str | int]) -> int | None:
    """The line (from 1) of the key at `path`, for instance ("parameter", 2, "lower"); None when nothing fits.

    >>> find_line('[a]\\nx = 1\\n[[b]]\\n[[b]]\\ny = 2', ("b", 1, "y"))
    5
    """
    places = _places(text)
    for length in range(len(path), 0, -1):
        line = places.get(tuple(path[:length]))
        if line is not None:
            return line
    return None


@lru_cache(maxsize=4)  # a study is asked about key by key
def _places(text: str) -> Mapping[Path, int]:
    places: dict[Path, int] = {}
    table: Path = ()
    counts: dict[Path, int] = {}
    closing = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if closing:
            if closing in line:
                closing = ""
            continue
        if match := HEADER.match(line):
            table = _resolved(_parts(match[2]), counts)
            if match[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                table = (*table, counts[table])
            for length in range(1, len(table) + 1):
                places.setdefault(table[:length], number)
        elif match := KEY.match(line):
            path = (*table, *_parts(match[1]))
            for length in range(len(table) + 1, len(path) + 1):
                places.setdefault(path[:length], number)
            closing = next((q for q in ('"""', "'''") if line.count(q) == 1), "")
    return places


def _parts(dotted: str) -> tuple[str, ...]:
    return tuple(part.strip("\"'") for part in PART.findall(dotted))


def _resolved(parts: tuple[str, ...], counts: dict[Path, int]) -> Path:
    """`parts` with the current index behind every array of tables on the way to the last part."""
    out: Path = ()
    for part in parts[:-1]:
        out = (*out, part)
        if out in counts:
            out = (*out, counts[out])
    return (*out, *parts[-1:])
