"""What was read from stored runs and how: the table `reading`, and rows that are read, or run, again.

A run is a simulation and a reading of it. The simulation names the row; the reading is a mapping of every
response to how it is read and reduced, kept once per way in the table `reading`.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.campaign.store import Store
from workbench.campaign.store_schema import kept_name
from workbench.models.protocol import Answer
from workbench.models.values import LARGEST, why_no_values

__all__ = [
    "ReadRow",
    "copied_at_baseline",
    "former_keys",
    "known_reading",
    "present_reading",
    "read_again",
    "read_otherwise",
    "run_again",
    "set_large_aside",
]

LARGE_AS_TEXT = "*e+[1-9][0-9][0-9]*"  # as JSON has a number of 1e100 and beyond
CHECKED_FOR = "largest value"  # in the table `meta`: what the stored answers were held against


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadRow:
    """What was read from a run, how (response -> definition), the numbers kept beside it, how it failed."""

    key: str
    status: str
    outputs: Mapping[str, float]
    kept: Mapping[str, float]
    definition: Mapping[str, Mapping[str, Any]]
    error: str = ""


def present_reading(store: Store, definition: Mapping[str, Any]) -> None:
    """From now on answers are read in this way, response -> how."""
    text = json.dumps(definition, sort_keys=True)
    find = "SELECT id FROM reading WHERE definition = ?"
    if not store.select(find, [text]):
        store.write("INSERT INTO reading (definition) VALUES (?)", [text])
    ((store.reading_now,),) = store.select(find, [text])


def known_reading(store: Store, definition: Mapping[str, Any]) -> bool:
    """Look the present reading up in a store that is open for reading; whether the store knows readings."""
    if not store.select("SELECT 1 FROM sqlite_master WHERE name = 'reading'"):
        return False
    text = json.dumps(definition, sort_keys=True)
    for (found,) in store.select("SELECT id FROM reading WHERE definition = ?", [text]):
        store.reading_now = found
    return True


def read_otherwise(store: Store, *, model: str, version: str, every: bool = False) -> list[ReadRow]:
    """Finished runs of a model not read in the present way, or `every` one, in the order asked for."""
    found = store.select(
        "SELECT key, status, outputs, kept, reading.definition, error FROM evaluation "
        "LEFT JOIN reading ON reading.id = evaluation.reading "
        "WHERE (? OR evaluation.reading IS NOT ?) AND status IN ('ok', 'failed', 'nonfinite') "
        "AND model = ? AND version = ? ORDER BY evaluation.id",
        [every, store.reading_now, model, version],
    )
    return [
        ReadRow(
            key=key,
            status=status,
            outputs=json.loads(outputs) if outputs else {},
            kept=json.loads(kept) if kept else {},
            definition=json.loads(definition) if definition else {},
            error=error or "",
        )
        for key, status, outputs, kept, definition, error in found
    ]


def read_again(store: Store, rows: Iterable[tuple[str, Answer | None]]) -> None:
    """Replace what was read from runs, of all or of none; None: there is nothing else to read in that run."""
    with store.transaction():
        for key, answer in rows:
            if answer is None:
                store.write("UPDATE evaluation SET reading = ? WHERE key = ?", [store.reading_now, key])
                continue
            store.write(
                "UPDATE evaluation SET status = ?, outputs = ?, error = ?, kept = ?, reading = ? "
                "WHERE key = ?",
                [
                    answer.status,
                    json.dumps(dict(answer.outputs)) if answer.status == "ok" else None,
                    answer.error or None,
                    json.dumps(dict(answer.kept)) if answer.kept else None,
                    store.reading_now,
                    key,
                ],
            )


def run_again(store: Store, keys: Sequence[str], *, reason: str) -> None:
    """Put answered rows back in the queue; the answers they had join their attempts."""
    with store.transaction():
        for key in keys:
            store.write(
                "INSERT INTO attempt "
                "(key, attempt, status, reason, outputs, error, log, finished, wall, cpu, host) "
                "SELECT key, attempt, status, ?, outputs, error, log, finished, wall, cpu, host "
                "FROM evaluation WHERE key = ? AND finished IS NOT NULL",
                [reason, key],
            )
            store.write(
                "UPDATE evaluation SET status = 'queued', outputs = NULL, error = NULL, log = NULL, "
                "kept = NULL, reading = NULL, state = NULL WHERE key = ?",
                [key],
            )
            store.write("DELETE FROM gradient WHERE key = ?", [key])


def copied_at_baseline(
    store: Store, found: Iterable[tuple[str, str, Mapping[str, Any]]]
) -> list[tuple[str, str]]:
    """Copies of runs (key, new key, inputs) under names with more parameters; both keys of the new ones."""
    copied = []
    with store.transaction():
        for key, new, inputs in found:
            if store.statuses([new]):
                continue
            columns = (
                "status, attempt, batch, model, version, outputs, error, log, created, started, finished, "
                "wall, cpu, host, seed, reading, state, kept"
            )
            store.write(
                f"INSERT INTO evaluation (key, inputs, {columns}) "
                f"SELECT ?, ?, {columns} FROM evaluation WHERE key = ?",
                [new, json.dumps(dict(inputs)), key],
            )
            copied.append((key, new))
    return copied


def former_keys(store: Store) -> dict[str, str]:
    """Keys that runs had under an older schema -> their present keys."""
    return dict(store.select("SELECT former, key FROM evaluation WHERE former IS NOT NULL"))


def set_large_aside(store: Store) -> int:
    """Let stored runs with a number too large to be modelled count as failed, and keep it; how many did.

    Answers are held against that as they come; a store of a time before is looked through once.
    """
    if store.select("SELECT 1 FROM meta WHERE key = ? AND value = ?", [CHECKED_FOR, str(LARGEST)]):
        return 0
    found = store.select(
        "SELECT evaluation.id, outputs, kept, reading.definition FROM evaluation "
        "LEFT JOIN reading ON reading.id = evaluation.reading WHERE status = 'ok' AND outputs GLOB ?",
        [LARGE_AS_TEXT],
    )
    count = 0
    with store.transaction():
        for number, text, beside, definition in found:
            outputs = json.loads(text)
            if not (wrong := why_no_values(outputs)):
                continue
            how = json.loads(definition) if definition else {}
            kept = json.loads(beside) if beside else {}
            kept |= {kept_name(name, how.get(name, {})): value for name, value in outputs.items()}
            store.write(
                "UPDATE evaluation SET status = 'nonfinite', outputs = NULL, error = ?, kept = ? "
                "WHERE id = ?",
                [wrong, json.dumps(kept), number],
            )
            count += 1
        store.write("INSERT OR REPLACE INTO meta (key, value) VALUES (?, ?)", [CHECKED_FOR, str(LARGEST)])
    return count
