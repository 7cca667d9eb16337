"""`design.json` for who does not want its rows, or some at a time: a very large design is never held."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from workbench.system.atomic import read_json, read_json_list, read_json_without
from workbench.system.collecting import without_collecting

__all__ = ["LARGE", "MOST_ROWS", "ROWS", "design_head", "design_keys", "design_points"]

ROWS = ("unit", "physical", "run_keys", "run_ids", "block")
LARGE = 4_000_000  # bytes from which a design may have very many rows
MOST_ROWS = 10_000  # of a design that is held whole


def design_head(path: Path) -> Any:
    """The document; without its rows when there are more than MOST_ROWS. None when there is none.

    Raises:
        StoreError: the file cannot be read or is not JSON.
    """
    found = read_json_without(path, ROWS, above=LARGE)
    if isinstance(found, dict) and found.get("n", 0) <= MOST_ROWS and not found.keys() >= {*ROWS}:
        return read_json(path)  # few runs of many parameters
    return found


def design_keys(path: Path) -> list[str] | None:
    """The names of the design's runs; None when there is no design."""
    if not path.is_file():
        return None
    with without_collecting():
        return [key for piece in read_json_list(path, "run_keys") for key in piece]


def design_points(path: Path) -> Iterator[list[Any]]:
    """The values of the design's parameters, run by run, of which only some are held."""
    for piece in read_json_list(path, "physical"):
        yield from piece
