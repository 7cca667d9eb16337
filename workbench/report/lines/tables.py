"""Numbers, units, tables and paragraphs as plain text."""

import textwrap
from collections.abc import Iterable, Sequence

__all__ = ["fitted", "format_number", "format_share", "hanging", "table_lines", "unit_suffix", "wrapped"]


def format_number(value: float | None, digits: int = 5) -> str:
    """A number for a person: significant digits, "-" for none.

    >>> format_number(-50.16789), format_number(0.0000123), format_number(None)
    ('-50.168', '1.23e-05', '-')
    """
    return "-" if value is None else f"{value:.{digits}g}"


def format_share(share: float) -> str:
    """A share in percent; "< 0.01 %" for what is less and not nothing.

    >>> format_share(0.11508), format_share(9.2e-7), format_share(0.0)
    ('11.5 %', '< 0.01 %', '0 %')
    """
    return "< 0.01 %" if 0.0 < share < 1e-4 else f"{100 * share:.3g} %"


def unit_suffix(unit: str) -> str:
    """The unit behind a number; nothing for 1."""
    return "" if unit == "1" else f" {unit}"


def table_lines(head: Sequence[str], rows: Sequence[Sequence[str]], *, width: int = 79) -> list[str]:
    """A table of at most `width` columns; a long second cell continues below itself."""
    others = sum(max(len(r[k]) for r in (head, *rows)) + 2 for k in range(len(head)) if k != 1)
    room = max(width - others, 14)
    split = [[[r[0]], wrapped(r[1], room), *([c] for c in r[2:])] for r in (head, *rows)]
    sizes = [max(len(line) for r in split for line in r[k]) for k in range(len(head))]
    text = []
    for n, row in enumerate(split):
        for line in range(max(map(len, row))):
            cells = [cell[line] if line < len(cell) else "" for cell in row]
            text.append(
                "  ".join(
                    f"{c:<{s}}" if k < 2 else f"{c:>{s}}"
                    for k, (c, s) in enumerate(zip(cells, sizes, strict=True))
                ).rstrip()
            )
        if n == 0:
            text.append("  ".join("-" * s for s in sizes))
    return text


def hanging(begin: str, text: str, *, indent: int, width: int = 80) -> list[str]:
    """A paragraph behind its beginning, in lines of at most `width` columns, all but the first indented.

    >>> hanging("BAD  pages  ", "page 7 is never used", indent=12, width=24)
    ['BAD  pages  page 7 is', '            never used']
    """
    first, *rest = wrapped(text, width - max(len(begin), indent))
    return [begin + first, *(" " * indent + line for line in rest)]


def fitted(lines: Iterable[str], *, width: int = 80) -> list[str]:
    """Lines of at most `width` columns: a longer one goes on below itself, two columns further in.

    A word that is longer, such as a path, stays whole.

    >>> fitted(["  verdict: the list is not resolved", "short"], width=24)
    ['  verdict: the list is', '    not resolved', 'short']
    """
    text = []
    for line in (part for given in lines for part in given.split("\n")):
        indent = len(line) - len(line.lstrip())
        if len(line) > width:
            text += hanging(line[:indent], line[indent:], indent=indent + 2, width=width)
        else:
            text.append(line)
    return text


def wrapped(text: str, width: int) -> list[str]:
    """A paragraph of at most `width` columns; what a no-break space joins stays on one line."""
    lines = textwrap.wrap(text, width, break_long_words=False, break_on_hyphens=False) or [""]
    return [line.replace("\u00a0", " ") for line in lines]
