"""Tables in the pages of docs/ that are made from tables in the code.

python -m tests.tables --write    puts them into the pages
"""

import sys
from collections.abc import Callable
from pathlib import Path

from workbench.models.readers import READERS
from workbench.sampling.kinds import KINDS

__all__ = ["TABLES", "page_with_table"]

DOCS = Path(__file__).parent.parent / "docs"


def readers() -> list[str]:
    """A row per reader: its kind and its keys."""
    rows = [f"| `{kind}` | {reader.keys} |" for kind, reader in READERS.items()]
    return ["| `read = { kind = ...` | keys |", "|---|---|", *rows]


def kinds() -> list[str]:
    """A row per kind of design: what it is, whether it needs `runs`, its options."""
    rows = [
        f"| `{name}` | {kind.summary} | {', '.join(f'`{o}`' for o in kind.options) or 'none'} "
        f"| {'ours to say' if kind.needs_runs else 'its own'} |"
        for name, kind in KINDS.items()
    ]
    return ["| `kind` | what it is | options | number of runs |", "|---|---|---|---|", *rows]


# page -> the name of its table, and what makes it
TABLES: dict[str, tuple[str, Callable[[], list[str]]]] = {
    "howto/bring-your-own-simulator.md": ("readers", readers),
    "howto/choose-a-sampler.md": ("kinds of designs", kinds),
}


def page_with_table(page: str) -> str:
    """The page with its table made anew; ValueError when a mark is missing."""
    name, made = TABLES[page]
    start, end = f"<!-- table of {name}: made by tests/tables.py -->", "<!-- end of the table -->"
    before, rest = (DOCS / page).read_text().split(start)
    _, after = rest.split(end)
    return "\n".join([f"{before}{start}", "", *made(), "", f"{end}{after}"])


if __name__ == "__main__" and "--write" in sys.argv[1:]:
    for page in TABLES:
        (DOCS / page).write_text(page_with_table(page))
