"""A table of runs made elsewhere as a model: a CSV with one column per parameter and response.

Nothing can be run; a row of the table is looked up. Every cell is checked when the table is opened, and what
is wrong is named by row and column. A response that is empty, nan, infinite or too large
to be modelled is a run that failed.
"""

import csv
import math
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from pathlib import Path
from typing import Any

from workbench.errors import EvaluationFailed, NotEnoughRuns, StudyError
from workbench.models.protocol import ModelSpec
from workbench.models.values import is_value, number_in, other_separator, what_is_wrong
from workbench.space.unit_scales import unit_in_header, without_unit

__all__ = [
    "FEWEST_RUNS",
    "TableModel",
    "check_columns",
    "ignored_columns",
    "ignored_sentence",
    "read_cells",
    "read_table",
    "table_digest",
]

FEWEST_RUNS = 3
LARGEST_FILE = 500_000_000  # bytes


@dataclass(frozen=True, slots=True)
class TableModel:
    """`rows` in the order of the file: parameters and responses by name, None for a response not there."""

    rows: tuple[dict[str, Any], ...]
    names: tuple[str, ...]
    file: str
    _place: dict[tuple[Any, ...], int]

    @classmethod
    def opened(cls, spec: ModelSpec) -> "TableModel":
        """Read and check the file of a description."""
        path = Path(spec.folder) / spec.options["file"]
        words = tuple(spec.options.get("words", ()))
        with spec.placed("file"):
            _refuse_missing(path)
        rows = read_table(
            path, spec.names, tuple(spec.responses), columns=spec.options.get("columns", {}), words=words
        )
        place = {tuple(row[name] for name in spec.names): k for k, row in enumerate(rows)}
        return cls(tuple(rows), spec.names, path.name, place)

    @property
    def inputs(self) -> list[dict[str, Any]]:
        """The parameters of every row."""
        return [{name: row[name] for name in self.names} for row in self.rows]

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> Any:
        """The table's row with these parameters."""
        k = self._place.get(tuple(row[name] for name in self.names))
        if k is None:
            raise EvaluationFailed("the table holds no such run; a table cannot run anything new")
        values = {name: value for name, value in self.rows[k].items() if name not in self.names}
        absent = [name for name, value in values.items() if value is None]
        if absent:
            raise EvaluationFailed(f"{self.file} has no value of {', '.join(absent)} for this run")
        return values

    def close(self) -> None:
        """Nothing to release."""


def table_digest(path: Path) -> str:
    """A digest of the file's content, which is the version of a table model."""
    _refuse_missing(path)
    try:
        return blake2b(path.read_bytes(), digest_size=8).hexdigest()
    except OSError as exc:
        raise StudyError(f"cannot read the table {path}: {exc.strerror or exc}") from None


def _refuse_missing(path: Path) -> None:
    if not path.exists():
        raise StudyError(f"no table {path}: [model] file is looked up beside the study file")


def read_table(
    path: Path,
    parameters: Sequence[str],
    responses: Sequence[str],
    *,
    columns: Mapping[str, str] | None = None,
    words: Sequence[str] = (),
    complete: bool = True,
) -> list[dict[str, Any]]:
    """Rows of a CSV as mappings of parameters and responses; numbers as floats, `words` as text.

    A response with an empty cell is None, one with nan or inf is that number.
    `complete`: refuse fewer than three rows with values, repeated rows and constant responses.

    Raises:
        StudyError: columns are missing, a parameter's cell holds no finite number or a response's something
            else than a number, rows repeat, a response is constant.
        NotEnoughRuns: fewer than three rows with values.
    """
    columns = columns or {}
    header, lines = read_cells(path)
    wanted = {name: columns.get(name, name) for name in (*parameters, *responses)}
    check_columns(
        path.name,
        header,
        list(wanted.values()),
        cure=_renaming(header, wanted) or ". Rename them in the file or map them in [model] columns",
    )
    place = {name: header.index(column) for name, column in wanted.items()}
    rows = []
    for line, cells in lines:
        where = f"{path.name}, line {line}"
        if len(cells) != len(header):
            raise StudyError(f"{where}: {len(cells)} cells where the header has {len(header)}")
        row: dict[str, Any] = {}
        for name in parameters:
            cell = cells[place[name]].strip()
            row[name] = cell if name in words else _number(cell, where, wanted[name])
        for name in responses:
            row[name] = _value(cells[place[name]].strip(), where, wanted[name])
        rows.append(row)
    if complete:
        _check_rows(path.name, rows, [line for line, _ in lines], parameters, responses)
    return rows


def _renaming(header: Sequence[str], wanted: Mapping[str, str]) -> str:
    """The line that maps every missing name to the one column that is called so but for its unit, "" where
    one has none.

    >>> _renaming(["mass [kg]", "y"], {"mass": "mass", "y": "y"})
    '. Write in [model]: columns = { mass = "mass [kg]" }'
    """
    alike: dict[str, str] = {}
    for name, column in wanted.items():
        if column not in header:
            found = [own for own in header if unit_in_header(own) and without_unit(own) == column]
            if len(found) != 1 or column != name:
                return ""
            alike[name] = found[0]
    pairs = ", ".join(f'{name} = "{column}"' for name, column in alike.items())
    return f". Write in [model]: columns = {{ {pairs} }}" if pairs else ""


def read_cells(path: Path) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """The header, and every row that is not empty with its line number."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise StudyError(f"the table {path} is larger than {LARGEST_FILE} bytes")
        with open(path, encoding="utf-8-sig", newline="") as file:
            reader = csv.reader(file)
            lines = [(reader.line_num, cells) for cells in reader if any(cell.strip() for cell in cells)]
    except FileNotFoundError:
        raise StudyError(f"no table {path}; give the path of a CSV") from None
    except UnicodeDecodeError as exc:
        raise StudyError(
            f"the table {path} is not text in UTF-8 (byte {exc.start}). Save it as that"
        ) from None
    except (OSError, csv.Error) as exc:
        raise StudyError(f"cannot read the table {path}: {exc}") from None
    if not lines:
        raise StudyError(f"the table {path} is empty; its first line names the columns")
    header = [cell.strip() for cell in lines[0][1]]
    twice = next((name for k, name in enumerate(header) if name in header[:k]), None)
    if twice is not None:
        raise StudyError(f"{path.name} has the column {twice!r} twice")
    return header, lines[1:]


def check_columns(file: str, header: Sequence[str], wanted: Sequence[str], *, cure: str = "") -> None:
    """Refuse a file that lacks a wanted column, or parts its columns by another sign than a comma."""
    missing = [column for column in wanted if column not in header]
    if missing and (other := other_separator(header)):
        raise StudyError(
            f"{file} separates its columns by {other!r}, a table does so by commas. Save it as CSV "
            "with commas between the columns and points in the numbers"
        )
    if missing:
        raise StudyError(
            f"{file} has no column {', '.join(map(repr, missing))}; it has {', '.join(header)}{cure}"
        )


def ignored_columns(
    header: Sequence[str], lines: Sequence[tuple[int, list[str]]], used: Container[str]
) -> list[str]:
    """The columns that hold numbers and that nobody reads: what they hold may drive the responses.

    Columns of words and empty ones are not among them.

    >>> ignored_columns(["a", "t", "who"], [(2, ["1", "20.5", "me"]), (3, ["2", "", "you"])], {"a"})
    ['t']
    """
    found = []
    for j, name in enumerate(header):
        cells = [row[j].strip() for _, row in lines if j < len(row) and row[j].strip()]
        if name not in used and cells and all(_is_number(cell) for cell in cells):
            found.append(name)
    return found


def ignored_sentence(names: Sequence[str], file: str) -> str:
    """What to tell a reader of columns that nobody reads.

    >>> ignored_sentence(["t"], "runs.csv")
    'the column t of runs.csv holds numbers and is not used: neither a parameter nor a response'
    >>> print(ignored_sentence([""], "runs.csv"))
    the column without a name of runs.csv holds numbers and is not used: neither a parameter nor a response
    """
    shown = ", ".join(name or "without a name" for name in names)
    if len(names) == 1:
        return (
            f"the column {shown} of {file} holds numbers and is not used: neither a parameter nor a response"
        )
    return f"the columns {shown} of {file} hold numbers and are not used: neither parameters nor responses"


def _is_number(cell: str) -> bool:
    try:
        number_in(cell)
    except ValueError:
        return False
    return True


def _number(cell: str, where: str, column: str) -> float:
    try:
        value = number_in(cell)
    except ValueError:
        came = f"{cell!r}" if cell else "an empty cell"
        cure = what_is_wrong(cell) or "Fill it in or remove the row"
        raise StudyError(f"{where}: column {column!r} needs a number, got {came}. {cure}") from None
    if not math.isfinite(value):
        raise StudyError(f"{where}: column {column!r} needs a finite number, got {cell}. Remove the row")
    return value


def _value(cell: str, where: str, column: str) -> float | None:
    """A response: None where the cell is empty."""
    try:
        return number_in(cell) if cell else None
    except ValueError:
        cure = what_is_wrong(cell) or "Leave the cell empty for a failed run"
        raise StudyError(f"{where}: column {column!r} needs a number, got {cell!r}. {cure}") from None


def _check_rows(
    name: str,
    rows: list[dict[str, Any]],
    lines: list[int],
    parameters: Sequence[str],
    responses: Sequence[str],
) -> None:
    good = [row for row in rows if all(row[r] is not None and is_value(row[r]) for r in responses)]
    if len(good) < FEWEST_RUNS:
        failed = f", {len(rows) - len(good)} of them failed" if len(good) < len(rows) else ""
        raise NotEnoughRuns(f"{name} has {len(rows)} runs{failed}; at least {FEWEST_RUNS} are needed")
    seen: dict[tuple[Any, ...], int] = {}
    repeated: list[tuple[int, int]] = []
    for row, line in zip(rows, lines, strict=True):
        first = seen.setdefault(tuple(row[p] for p in parameters), line)
        if first != line:
            repeated.append((first, line))
    if repeated:
        cure = "Remove one"
        if responses:
            cure = (
                "A campaign knows a run by its parameters: put the mean of the responses in one row, or "
                "screen the rows as they are with workbench.screen, which reads the noise off repeated runs"
            )
        others = f", and {len(repeated) - 1} more pairs" if len(repeated) > 1 else ""
        raise StudyError(
            f"{name}: lines {repeated[0][0]} and {repeated[0][1]} hold the same parameters{others}. {cure}"
        )
    for response in responses:
        if len({row[response] for row in good}) == 1:
            raise StudyError(
                f"{name}: response {response!r} is {good[0][response]:g} in every row; nothing to explain. "
                "Leave that [[response]] out, or add runs in which it changes"
            )
