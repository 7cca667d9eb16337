"""`design.json` for who does not want its rows: of a very large design they stay unread."""

from pathlib import Path
from typing import Any

from workbench.system.atomic import read_json, read_json_without

__all__ = ["LARGE", "MOST_ROWS", "ROWS", "design_head", "design_keys"]

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
    found = read_json_without(path, set(ROWS) - {"run_keys"}, above=LARGE)
    return None if found is None else list(found["run_keys"])
