"""Stored runs some thousand at a time, column by column: what reads very many of them holds only a part.

Every row is held against its checksum on the way, also those of other models.
"""

import json
import sqlite3
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.errors import StoreError
from workbench.models.stored.causes import KEPT_IN
from workbench.models.stored.evaluation import COLUMNS, Evaluation, evaluation_of
from workbench.system.collecting import without_collecting

__all__ = ["RunChunk", "numbered_runs", "run_chunks"]

AT_ONCE = 5_000  # rows
PER_STATEMENT = 500  # numbers of runs
READ = (
    "id, key, status, batch, inputs, COALESCE(outputs, '{}'), COALESCE(error, ''), "
    f"CASE WHEN instr(error, '{KEPT_IN}') THEN COALESCE(log, '') ELSE '' END, finished, wall, cpu"
)


@dataclass(frozen=True, slots=True)
class RunChunk:
    """Some stored runs of a model, in the order asked for: one entry per run in each column. Times in s.

    logs: only of runs whose cause stands there (`workbench.models.stored.causes.cause_of`).
    """

    ids: Sequence[int]
    keys: Sequence[str]
    statuses: Sequence[str]
    batches: Sequence[str]
    inputs: Sequence[Mapping[str, Any]]
    outputs: Sequence[Mapping[str, float]]
    errors: Sequence[str]
    logs: Sequence[str]
    finished: Sequence[float | None]
    wall: Sequence[float | None]
    cpu: Sequence[float | None]


def run_chunks(
    db: sqlite3.Connection,
    where: object,
    *,
    model: str | None,
    version: str | None,
    names: Collection[str],
) -> Iterator[RunChunk]:
    """The runs of a model and version (None: of all) that have exactly the parameters `names` (any, if none).

    where: of the database, for messages.

    Raises:
        StoreError: a row is not as it was stored.
    """
    wanted = set(names)
    query = (
        f"SELECT {_sound(db)}, ? IS NULL OR (model = ? AND version = ?), {READ} FROM evaluation ORDER BY id"
    )
    cursor = db.execute(query, [model, model, version])
    while True:
        with without_collecting():  # not while a chunk is out: who never comes back would leave it off
            rows = cursor.fetchmany(AT_ONCE)
            for sound, _, *cells in rows:
                if not sound:
                    raise _damaged(where, cells)
            chunk = _chunk([row[2:] for row in rows if row[1]], wanted)
        if not rows:
            return
        if chunk:
            yield chunk


def numbered_runs(db: sqlite3.Connection, where: object, ids: Sequence[int]) -> list[Evaluation]:
    """The runs with these numbers, in their order; without gradients. A number that is no run's is left out.

    Raises:
        StoreError: a row is not as it was stored.
    """
    found: dict[int, Evaluation] = {}
    sound = _sound(db)
    for k in range(0, len(ids), PER_STATEMENT):
        part = [int(number) for number in ids[k : k + PER_STATEMENT]]
        marks = ", ".join("?" * len(part))
        query = f"SELECT {sound}, {', '.join(COLUMNS)} FROM evaluation WHERE id IN ({marks})"
        for is_sound, *cells in db.execute(query, part):
            if not is_sound:
                raise _damaged(where, cells)
            found[cells[0]] = evaluation_of((*cells, None))
    return [found[number] for number in map(int, ids) if number in found]


def _chunk(rows: Sequence[Sequence[Any]], wanted: set[str]) -> RunChunk | None:
    """The rows as columns, without those of other parameters; None without any."""
    if not rows:
        return None
    ids, keys, statuses, batches, inputs, outputs, *rest = zip(*rows, strict=True)
    columns: list[Sequence[Any]] = [ids, keys, statuses, batches, _parsed(inputs), _parsed(outputs), *rest]
    if wanted:
        right = [given.keys() == wanted for given in columns[4]]
        if not any(right):
            return None
        if not all(right):
            columns = [[cell for cell, ok in zip(c, right, strict=True) if ok] for c in columns]
    return RunChunk(*columns)


def _parsed(texts: Sequence[str]) -> list[dict[str, Any]]:
    """Many small mappings in one go, which share their names."""
    found: list[dict[str, Any]] = json.loads(f"[{','.join(texts)}]")
    return found


def _sound(db: sqlite3.Connection) -> str:
    """The SQL expression that says whether a row is as it was stored; 1 in a store of before checksums."""
    held = [name for _, name, *_ in db.execute("PRAGMA table_info(evaluation)")]
    if not held or held[-1] != "checksum":
        return "1"
    return f"row_checksum('evaluation', {', '.join(held[:-1])}) IS checksum"


def _damaged(where: object, cells: Sequence[Any]) -> StoreError:
    return StoreError(
        f"{where} is damaged: run {cells[0]} ({cells[1]}) is not as it was stored. `holdfast doctor --store` "
        "says what else is wrong, `holdfast recover` saves what can be read"
    )
