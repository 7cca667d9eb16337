"""A run as it is stored, a row of `evaluation` that campaign and report read alike; failed ones by cause."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from sys import intern
from typing import Any

from workbench.models.evaluator import Outcome
from workbench.models.stored.causes import cause_of, shared_words, without_numbers

__all__ = [
    "COLUMNS",
    "FAILED",
    "UNFINISHED",
    "Evaluation",
    "alike",
    "evaluation_of",
]

NOTHING: Mapping[str, Any] = {}  # one object for the many rows that have none
UNFINISHED = ("queued", "running")
FAILED = ("failed", "timeout", "killed", "nonfinite")  # neither a value nor skipped by a constraint

# of the table, in the order in which a record takes them
COLUMNS = (
    "id", "key", "status", "attempt", "batch", "inputs", "outputs", "error", "log",
    "created", "started", "finished", "wall", "cpu", "host", "seed",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluation:
    """A run as it is stored. `outputs` is empty unless `status` is "ok"; times in seconds."""

    id: int
    key: str
    status: str
    attempt: int
    batch: str
    inputs: Mapping[str, Any]
    outputs: Mapping[str, float]
    gradients: Mapping[str, Mapping[str, float]]  # response -> parameter -> derivative; empty without any
    error: str
    log: str
    created: float
    started: float | None
    finished: float | None
    wall: float | None
    cpu: float | None
    host: str | None
    seed: int | None

    @property
    def cause(self) -> str:
        """Why the run failed, in a line; "" where nothing was said."""
        return cause_of(self.error, self.log) if self.error else ""

    def as_outcome(self) -> Outcome:
        """The run in the terms of a screening or a search, with its error in the words of its solver."""
        return Outcome(
            parameters=self.inputs,
            status=self.status,
            outputs=self.outputs,
            gradients=self.gradients,
            key=self.key,
            error=self.error if self.status == "ok" else self.cause,
        )


def evaluation_of(row: Sequence[Any]) -> Evaluation:
    """The record of a row: the cells of COLUMNS, and its gradients as JSON or None."""
    (id_, key, status, attempt, batch, inputs, outputs, error, log, *times, host, seed, slopes) = row
    created, started, finished, wall, cpu = times
    return Evaluation(
        id=id_,
        key=key,
        status=intern(status),
        attempt=attempt,
        batch=intern(batch),
        inputs=_named(inputs),
        outputs=_named(outputs) if outputs else {},
        gradients=json.loads(slopes) if slopes else NOTHING,
        error=error or "",
        log=log or "",
        created=created,
        started=started,
        finished=finished,
        wall=wall,
        cpu=cpu,
        host=None if host is None else intern(host),
        seed=seed,
    )


def _named(text: str) -> dict[str, Any]:
    """A mapping in JSON; names are the same objects in all rows, of which there may be very many."""
    return {intern(name): value for name, value in json.loads(text).items()}


def alike(runs: Sequence[Evaluation]) -> list[tuple[str, list[Evaluation]]]:
    """Runs by why they failed, most first: causes that differ in their numbers alone are one."""
    groups: dict[str, list[tuple[str, Evaluation]]] = {}
    for run in runs:
        cause = cause_of(run.error, run.log)
        groups.setdefault(without_numbers(cause), []).append((cause, run))
    several = sorted(groups.values(), key=len, reverse=True)
    return [(reduce(shared_words, (c for c, _ in group)), [run for _, run in group]) for group in several]
