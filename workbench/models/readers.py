"""Responses out of the files that a solver leaves: JSON, CSV, columns, patterns, request tables, Python.

    json      key = "result.peak" or "forces.0"         a number, or {"time": [...], "values": [...]}
    csv       column = "force", time = "t"              a named column
    columns   column = 3, time = 1, skip = 2            a column by its number, split at blanks, `skip` lines
    first columns   characters = [11, 22]                     a column by its place in the line, from 1, both
    ends in it regex     pattern = "peak = ([-+0-9.eE]+)"          the last match (`which = "first"`: the
    first) request   request = "belt", column = "FM"           a block of a `.req`-like table, see below
    python    function = "post.py:peak"                 called with the run's folder

A column is a history over its time column when the response has a `reduce`, else it must hold one value.
A request file holds blocks: a line `REQUEST name`, a line of column names that begins with TIME, lines of
numbers, and an empty line; lines that begin with `!` are comments.
"""

import csv
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.protocol import History
from workbench.system.confined import confined

__all__ = ["READERS", "read_response"]

LARGEST = 500_000_000  # bytes of a result file
READERS = ("json", "csv", "columns", "regex", "request", "python")


def read_response(rule: Mapping[str, Any], work: Path, study: Path, *, history: bool) -> Any:
    """What `rule` says about the files in `work`: a number or, if `history`, a `History`.

    Raises:
        EvaluationFailed: the file is missing, too large or does not hold what the rule names.
    """
    kind = rule["kind"]
    if kind == "python":
        from workbench.models.python import load_function

        return load_function(rule["function"], study)(work)
    text = _text(work, rule["file"])
    where = rule["file"]
    if kind == "json":
        return _from_json(text, rule["key"], where)
    if kind == "regex":
        return _from_regex(text, rule["pattern"], rule.get("which", "last"), where)
    if kind == "csv":
        columns = _csv_columns(text, where)
        return _column(columns, rule["column"], rule.get("time"), where, history=history)
    if kind == "columns":
        return _from_columns(text, rule, where, history=history)
    columns = _request_columns(text, rule["request"], where)
    return _column(columns, rule["column"], "TIME", where, history=history)


def _text(work: Path, name: str) -> str:
    try:
        path = confined(work, name, what="result file")
        size = path.stat().st_size
        if not path.is_file() or size > LARGEST:
            raise EvaluationFailed(
                f"the result file {name} has {size} bytes or is no file; at most {LARGEST} are read"
            )
        return path.read_bytes().decode("utf-8")
    except StudyError as exc:
        raise EvaluationFailed(str(exc)) from None
    except UnicodeDecodeError as exc:
        raise EvaluationFailed(f"the result file {name} is not text (byte {exc.start})") from None
    except FileNotFoundError:
        raise EvaluationFailed(f"the run left no result file {name}") from None
    except OSError as exc:
        raise EvaluationFailed(f"cannot read the result file {name}: {exc.strerror}") from None


def _from_json(text: str, key: str, where: str) -> Any:
    try:
        here = json.loads(text)
    except (ValueError, RecursionError) as exc:
        raise EvaluationFailed(f"{where} is not JSON: {exc}") from None
    for step in key.split("."):
        if isinstance(here, list) and step.isdigit() and int(step) < len(here):
            here = here[int(step)]
        elif isinstance(here, dict) and step in here:
            here = here[step]
        else:
            raise EvaluationFailed(f"{where} has no {key!r} (at {step!r})")
    if isinstance(here, dict) and {"time", "values"} <= set(here):
        return here["time"], here["values"]
    return here


def _from_regex(text: str, pattern: str, which: str, where: str) -> float:
    found = None
    for match in re.finditer(pattern, text, re.MULTILINE):
        found = match
        if which == "first":
            break
    if found is None:
        raise EvaluationFailed(f"{where}: nothing matches {pattern!r}")
    return _number(found[1] if found.re.groups else found[0], where)


def _csv_columns(text: str, where: str) -> dict[str, list[str]]:
    try:
        lines = [cells for cells in csv.reader(text.splitlines()) if any(c.strip() for c in cells)]
    except csv.Error as exc:
        raise EvaluationFailed(f"{where} is not CSV: {exc}") from None
    if not lines:
        raise EvaluationFailed(f"{where} is empty")
    header = [name.strip() for name in lines[0]]
    return _by_name(header, lines[1:], where)


def _from_columns(text: str, rule: Mapping[str, Any], where: str, *, history: bool) -> Any:
    lines = [line for line in text.splitlines()[rule.get("skip", 0) :] if line.strip()]
    if "characters" in rule:
        first, last = rule["characters"]
        values = [_number(line[first - 1 : last], where) for line in lines]
        place = rule.get("time_characters")
        times = None if place is None else [_number(line[place[0] - 1 : place[1]], where) for line in lines]
        return _as_asked(values, times, where, history=history)
    columns: dict[str, list[str]] = {}
    for number in {rule["column"], rule.get("time", rule["column"])}:
        cells = [line.split() for line in lines]
        if any(len(row) < number for row in cells):
            raise EvaluationFailed(f"{where} has lines without a column {number}")
        columns[str(number)] = [row[number - 1] for row in cells]
    time = rule.get("time")
    return _column(columns, str(rule["column"]), None if time is None else str(time), where, history=history)


def _request_columns(text: str, request: str, where: str) -> dict[str, list[str]]:
    lines = iter(line.strip() for line in text.splitlines() if not line.lstrip().startswith("!"))
    names = []
    for line in lines:
        if not line.upper().startswith("REQUEST"):
            continue
        name = line[len("REQUEST") :].strip()
        names.append(name)
        if name != request:
            continue
        header = next(lines, "").split()
        if not header or header[0] != "TIME":
            raise EvaluationFailed(
                f"{where}: request {request!r} needs a line of column names that begins with TIME"
            )
        rows = []
        for row in lines:
            if not row or row.upper().startswith("REQUEST"):
                break
            rows.append(row.split())
        return _by_name(header, rows, where)
    raise EvaluationFailed(f"{where} has no request {request!r}; it has {', '.join(names) or 'none'}")


def _by_name(header: Sequence[str], rows: Sequence[Sequence[str]], where: str) -> dict[str, list[str]]:
    for row in rows:
        if len(row) != len(header):
            raise EvaluationFailed(
                f"{where}: a row of {len(row)} cells under {len(header)} columns; was it cut off?"
            )
    return {name: [row[k] for row in rows] for k, name in enumerate(header)}


def _column(
    columns: Mapping[str, Sequence[str]], name: str, time: str | None, where: str, *, history: bool
) -> Any:
    if history and time is None:
        time = next(iter(columns))
    for wanted in (name, *([time] if history and time is not None else [])):
        if wanted not in columns:
            raise EvaluationFailed(f"{where} has no column {wanted!r}; it has {', '.join(columns)}")
    values = [_number(cell, where) for cell in columns[name]]
    times = [_number(cell, where) for cell in columns[time]] if history and time is not None else None
    return _as_asked(values, times, where, history=history)


def _as_asked(values: list[float], times: list[float] | None, where: str, *, history: bool) -> Any:
    if history:
        return History(list(range(len(values))) if times is None else times, values)
    if len(values) != 1:
        raise EvaluationFailed(
            f"{where} holds {len(values)} values; say which with reduce, such as reduce = 'max'"
        )
    return values[0]


def _number(cell: str, where: str) -> float:
    try:
        # Fortran writes 1.5D+03
        return float(cell.strip().replace("D", "E").replace("d", "e"))
    except ValueError:
        shown = cell if len(cell) < 80 else f"{cell[:77]}..."
        raise EvaluationFailed(f"{where}: {shown!r} is no number") from None
