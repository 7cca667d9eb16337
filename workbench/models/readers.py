"""Responses out of the files that a solver leaves: one table of readers, and the functions behind it.

`READERS` says of every kind of `read` which keys it takes, which function reads, and what a person is told;
`KEYS` says what the keys hold. The schema of a study, its checks and the page on simulators are made from the
two, so that a new reader is a function here and an entry.

A column is a history over its time column when the response has a `reduce`, else it must hold one value. A
request file holds blocks: a line `REQUEST name`, a line of column names that begins with TIME, lines of
numbers, and an empty line; lines that begin with `!` are comments.
"""

import codecs
import csv
import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import EvaluationFailed, StudyError
from workbench.models.histories import History
from workbench.models.python import load_function
from workbench.models.values import number_in, other_separator
from workbench.space.units import counted
from workbench.system.confined import check_inside, confined

__all__ = ["KEYS", "READERS", "Reader", "RunFiles", "checked_rule", "open_reader", "read_response"]

LARGEST = 500_000_000  # bytes of a result file

# key of a rule -> what it holds: "text", "count" (a whole number from 1), "number" (one from 0), "place" (two
# counts: first and last character), "name or count", or the words themselves
KEYS: dict[str, str | tuple[str, ...]] = {
    "file": "text",
    "key": "text",
    "column": "name or count",
    "time": "name or count",
    "skip": "number",
    "characters": "place",
    "time_characters": "place",
    "pattern": "text",
    "which": ("first", "last"),
    "request": "text",
    "function": "text",
    "encoding": "text",
}


@dataclass(frozen=True, slots=True)
class RunFiles:
    """What a reader may look at: the folder of the run, and that of the study, where functions stand.

    encoding: of result files; by default UTF-8, or what a byte order mark at their beginning says.
    """

    work: Path
    study: Path
    encoding: str = ""

    def text(self, name: str) -> str:
        """The text of a result file.

        Raises:
            EvaluationFailed: it is missing, too large, not text, or outside the run's folder.
        """
        try:
            path = confined(self.work, name, what="result file")
            size = path.stat().st_size
            if not path.is_file() or size > LARGEST:
                raise EvaluationFailed(
                    f"the result file {name} has {size} bytes or is no file; at most {LARGEST} are read"
                )
            data = path.read_bytes()
            marked = data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
            return data.decode(self.encoding or ("utf-16" if marked else "utf-8-sig"))
        except StudyError as exc:
            raise EvaluationFailed(str(exc)) from None
        except UnicodeDecodeError as exc:
            raise EvaluationFailed(
                f"the result file {name} is not text in {exc.encoding} (byte {exc.start}); say which it is, "
                'such as encoding = "latin-1", beside its name'
            ) from None
        except FileNotFoundError:
            raise EvaluationFailed(f"the run left no result file {name}") from None
        except OSError as exc:
            raise EvaluationFailed(f"cannot read the result file {name}: {exc.strerror}") from None


def read_response(rule: Mapping[str, Any], work: Path, study: Path, *, history: bool) -> Any:
    """What `rule` says about the files in `work`: a number or, if `history`, a `History`.

    Raises:
        EvaluationFailed: the file is missing, too large or does not hold what the rule names.
    """
    return READERS[rule["kind"]].read(rule, RunFiles(work, study, rule.get("encoding", "")), history)


def open_reader(rule: Mapping[str, Any], study: Path) -> None:
    """See before the first run that a reader's function can be imported.

    Raises:
        StudyError: it cannot.
    """
    if "function" in rule:
        load_function(rule["function"], study)


def checked_rule(response: str, rule: Mapping[str, Any], *, reduced: bool) -> dict[str, Any]:
    """The rule without empty keys.

    Raises:
        StudyError: a key is missing, too much, or not what its kind needs.
    """
    given = {key: value for key, value in rule.items() if value is not None}
    kind = given["kind"]
    reader = READERS[kind]
    keys = set(given) - {"kind"}
    encoding = ("encoding",) if "file" in reader.needs else ()
    missing, stray = sorted(set(reader.needs) - keys), sorted(keys - {*reader.needs, *reader.may, *encoding})
    if missing or stray:
        wrong = f"needs {missing[0]}" if missing else f"takes no {stray[0]}"
        takes = ", ".join(sorted((*reader.needs, *reader.may, *encoding)))
        raise StudyError(f"response {response!r}: read of kind {kind!r} {wrong}; its keys are {takes}")
    try:
        if "file" in given:
            check_inside(given["file"], what="read.file", folder="the run's folder")
        _check_encoding(given)
        reader.check(given, reduced)
    except StudyError as exc:
        raise StudyError(f"response {response!r}: {exc}") from None
    return given


def _check_encoding(rule: Mapping[str, Any]) -> None:
    name = rule.get("encoding")
    try:
        codecs.lookup(name or "utf-8")
    except LookupError:
        raise StudyError(
            f"Python knows no encoding {name!r}; give one such as utf-8, utf-16, latin-1, cp1252"
        ) from None


def _check_nothing(_rule: Mapping[str, Any], _reduced: bool) -> None:
    """Any value of the right type will do."""


def _check_names(rule: Mapping[str, Any], _reduced: bool) -> None:
    _check_columns(rule, str, "the name of a column")


def _check_numbers(rule: Mapping[str, Any], _reduced: bool) -> None:
    if ("column" in rule) == ("characters" in rule):
        raise StudyError("read of kind 'columns' needs column or characters, not both")
    for key in ("characters", "time_characters"):
        place = rule.get(key)
        if place is not None and (len(place) != 2 or place[0] > place[1]):
            raise StudyError(f"{key} needs first and last, such as [11, 22], got {place}")
    _check_columns(rule, int, "the number of a column, from 1")


def _check_columns(rule: Mapping[str, Any], wanted: type, words: str) -> None:
    for key in ("column", "time"):
        if key in rule and not isinstance(rule[key], wanted):
            raise StudyError(f"{key} is {words}, got {rule[key]!r}")


def _check_pattern(rule: Mapping[str, Any], reduced: bool) -> None:
    if reduced:
        raise StudyError("a regular expression finds one number; leave reduce out")
    try:
        groups = re.compile(rule["pattern"]).groups
    except re.error as exc:
        raise StudyError(f"pattern {rule['pattern']!r}: {exc}") from None
    if not groups:
        raise StudyError(
            f"pattern {rule['pattern']!r} needs parentheses around the number, such as 'peak = (\\S+)'; "
            "what the first pair matches is read"
        )


def _json(rule: Mapping[str, Any], files: RunFiles, _history: bool) -> Any:
    where, key = rule["file"], rule["key"]
    text = files.text(where)
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


def _regex(rule: Mapping[str, Any], files: RunFiles, _history: bool) -> float:
    where, pattern = rule["file"], rule["pattern"]
    found = None
    for match in re.finditer(pattern, files.text(where), re.MULTILINE):
        found = match
        if rule.get("which") == "first":
            break
    if found is None:
        raise EvaluationFailed(f"{where}: nothing matches {pattern!r}")
    return _number(found[1], where)


def _csv(rule: Mapping[str, Any], files: RunFiles, history: bool) -> Any:
    where = rule["file"]
    text = files.text(where)
    try:
        lines = [cells for cells in csv.reader(text.splitlines()) if any(c.strip() for c in cells)]
    except csv.Error as exc:
        raise EvaluationFailed(f"{where} is not CSV: {exc}") from None
    if not lines:
        raise EvaluationFailed(f"{where} is empty")
    header = [name.strip() for name in lines[0]]
    if rule["column"] not in header and (other := other_separator(header)):
        raise EvaluationFailed(
            f"{where} separates its columns by {other!r}, kind = 'csv' reads them by commas; have them "
            "written so, or read the file by kind = 'columns' or 'python'"
        )
    columns = _by_name(header, lines[1:], where, asked=(rule["column"], rule.get("time", header[0])))
    return _column(columns, rule["column"], rule.get("time"), where, history=history)


def _columns(rule: Mapping[str, Any], files: RunFiles, history: bool) -> Any:
    where = rule["file"]
    lines = [line for line in files.text(where).splitlines()[rule.get("skip", 0) :] if line.strip()]
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


def _request(rule: Mapping[str, Any], files: RunFiles, history: bool) -> Any:
    where = rule["file"]
    columns = _request_columns(files.text(where), rule["request"], where, column=rule["column"])
    return _column(columns, rule["column"], "TIME", where, history=history)


def _request_columns(text: str, request: str, where: str, *, column: str) -> dict[str, list[str]]:
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
        return _by_name(header, rows, where, asked=(column, "TIME"))
    raise EvaluationFailed(f"{where} has no request {request!r}; it has {', '.join(names) or 'none'}")


def _by_name(
    header: Sequence[str], rows: Sequence[Sequence[str]], where: str, *, asked: Sequence[str]
) -> dict[str, list[str]]:
    """The cells of each column; of the columns `asked` for none may stand there twice."""
    twice = next((name for name in asked if header.count(name) > 1), None)
    if twice is not None:
        raise EvaluationFailed(
            f"{where} has {header.count(twice)} columns {twice!r}; give each a name of its own, or read the "
            "file by kind = 'columns' or 'python'"
        )
    for row in rows:
        if len(row) != len(header):
            cells, columns = counted(len(row), "cell"), counted(len(header), "column")
            raise EvaluationFailed(f"{where}: a row of {cells} under {columns}; was it cut off?")
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
        return number_in(cell)
    except ValueError:
        shown = cell if len(cell) < 80 else f"{cell[:77]}..."
        raise EvaluationFailed(f"{where}: {shown!r} is no number") from None


def _python(rule: Mapping[str, Any], files: RunFiles, _history: bool) -> Any:
    return load_function(rule["function"], files.study)(files.work)


@dataclass(frozen=True, slots=True, kw_only=True)
class Reader:
    """A kind of `read`: the keys it needs and those it may have, and how a person is told about them.

    read: (rule, files, whether a history is wanted) -> a number, a `History` or a pair (time, values)
    check: (rule, whether the response has a `reduce`), raises StudyError for values that do not go together
    """

    needs: tuple[str, ...]
    may: tuple[str, ...] = ()
    keys: str  # with examples, in Markdown
    read: Callable[[Mapping[str, Any], RunFiles, bool], Any]
    check: Callable[[Mapping[str, Any], bool], None] = _check_nothing


READERS: dict[str, Reader] = {
    "json": Reader(
        needs=("file", "key"),
        keys='`file`, `key = "result.peak"`; numbers in the path index lists',
        read=_json,
    ),
    "csv": Reader(
        needs=("file", "column"),
        may=("time",),
        keys='`file`, `column = "force"`, `time = "t"` (the first column when left out)',
        read=_csv,
        check=_check_names,
    ),
    "columns": Reader(
        needs=("file",),
        may=("column", "time", "skip", "characters", "time_characters"),
        keys="`file`, `column = 3`, `time = 1`, `skip = 2`; or `characters = [11, 22]` for fixed places",
        read=_columns,
        check=_check_numbers,
    ),
    "regex": Reader(
        needs=("file", "pattern"),
        may=("which",),
        keys='`file`, `pattern = "peak = (\\\\S+)"`, `which = "first"` or `"last"`',
        read=_regex,
        check=_check_pattern,
    ),
    "request": Reader(
        needs=("file", "request", "column"),
        keys="`file`, `request`, `column`: blocks `REQUEST name`, a line of names that begins with TIME, "
        "numbers, an empty line",
        read=_request,
        check=_check_names,
    ),
    "python": Reader(
        needs=("function",),
        keys='`function = "post.py:peak"`, called with the run\'s folder',
        read=_python,
    ),
}
