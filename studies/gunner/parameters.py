"""Numbers of the study, read from an editable file into typed records; each carries its unit and source.

An entry of the file is `name = { value = ..., unit = "...", source = "..." }`. A record's field says which
unit it wants and what it may be, so a slip is told once, with the place and the remedy.
"""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from difflib import get_close_matches
from math import isfinite
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

__all__ = ["FILE", "SOURCES", "InvalidNumber", "Number", "Row", "read", "rows"]

FILE = Path(__file__).with_name("gunner.toml")
SOURCES = ("dissertation", "Chrono", "literature", "derived", "assumed")
KEYS = ("value", "unit", "source", "note")

Record = TypeVar("Record")


class InvalidNumber(ValueError):
    """A key or number of the file is not what its place asks for."""


@dataclass(frozen=True, slots=True)
class Number:
    """What a field of a record holds: its unit, the least value allowed (or more than 0), how many."""

    unit: str
    positive: bool = False
    least: float | None = None
    count: int = 1


def read(record: type[Record], table: str, path: Path | str = FILE) -> Record:
    """The record of a table ("vehicle", "vehicle.front") of the file.

    Raises InvalidNumber with the file, the key and what was expected.
    """
    given: Any = tomllib.loads(Path(path).read_text())
    for part in table.split("."):
        if not isinstance(given, Mapping) or part not in given:
            raise InvalidNumber(f"{Path(path).name} has no table [{table}]")
        given = given[part]
    return _record(record, given, table, Path(path).name)


def _record(record: type[Record], given: Mapping[str, Any], table: str, file: str) -> Record:
    own = get_type_hints(record, include_extras=True)
    for key in given:
        if key not in own:
            near = get_close_matches(key, own, n=1)
            hint = f"; did you mean '{near[0]}'?" if near else f"; it has {', '.join(own)}"
            raise InvalidNumber(f"{file}: [{table}] knows no '{key}'{hint}")
    found: dict[str, Any] = {}
    for name, kind in own.items():
        if name not in given:
            raise InvalidNumber(f"{file}: [{table}] lacks '{name}'")
        if isinstance(kind, type) and is_dataclass(kind):
            found[name] = _record(kind, given[name], f"{table}.{name}", file)
        else:
            found[name] = _value(given[name], kind.__metadata__[0], f"{file}: {table}.{name}")
    return record(**found)


def _value(entry: Any, wanted: Number, where: str) -> Any:
    unit, count = wanted.unit, wanted.count
    if (
        not isinstance(entry, Mapping)
        or set(entry) - set(KEYS)
        or not {"value", "unit", "source"} <= set(entry)
    ):
        raise InvalidNumber(
            f'{where} needs {{ value = ..., unit = "{unit}", source = "..." }} and perhaps a note, '
            f"got {entry}"
        )
    if entry["unit"] != unit:
        raise InvalidNumber(f"{where} is wanted in '{unit}', got unit '{entry['unit']}'")
    if entry["source"] not in SOURCES:
        raise InvalidNumber(f"{where} needs a source among {', '.join(SOURCES)}, got '{entry['source']}'")
    given = entry["value"] if isinstance(entry["value"], list) else [entry["value"]]
    plain = all(isinstance(x, int | float) and not isinstance(x, bool) and isfinite(x) for x in given)
    if not plain or len(given) != count or isinstance(entry["value"], list) != (count > 1):
        raise InvalidNumber(f"{where} needs {_many(count)}, got {entry['value']}")
    if (wanted.positive and min(given) <= 0.0) or (wanted.least is not None and min(given) < wanted.least):
        bound = "more than 0" if wanted.positive else f"at least {wanted.least:g}"
        raise InvalidNumber(f"{where} must be {bound} {unit}, got {entry['value']}")
    return tuple(map(float, given)) if count > 1 else float(given[0])


def _many(count: int) -> str:
    return "a number" if count == 1 else f"{count} numbers"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A number of the file as a table prints it."""

    name: str
    value: Any
    unit: str
    source: str
    note: str


def rows(path: Path | str = FILE) -> tuple[Row, ...]:
    """All numbers of the file, in its order."""
    found: list[Row] = []

    def walk(table: Mapping[str, Any], where: str) -> None:
        for key, entry in table.items():
            name = f"{where}.{key}" if where else key
            if "value" in entry:
                found.append(Row(
                    name=name, value=entry["value"], unit=entry["unit"], source=entry["source"],
                    note=entry.get("note", ""),
                ))  # fmt: skip
            else:
                walk(entry, name)

    walk(tomllib.loads(Path(path).read_text()), "")
    return tuple(found)
