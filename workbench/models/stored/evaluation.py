"""A run as it is stored (a row of `evaluation` that campaign and report read alike), and why it failed."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from sys import intern
from typing import Any

from workbench.models.evaluator import Outcome

__all__ = [
    "COLUMNS",
    "FAILED",
    "KEPT_IN",
    "UNFINISHED",
    "Evaluation",
    "alike",
    "cause_of",
    "evaluation_of",
    "without_numbers",
]

NOTHING: Mapping[str, Any] = {}  # one object for the many rows that have none
UNFINISHED = ("queued", "running")
FAILED = ("failed", "timeout", "killed", "nonfinite")  # neither a value nor skipped by a constraint

# of the table, in the order in which a record takes them
COLUMNS = (
    "id", "key", "status", "attempt", "batch", "inputs", "outputs", "error", "log",
    "created", "started", "finished", "wall", "cpu", "host", "seed",
)  # fmt: skip

LONGEST = 120  # characters of a cause
KEPT_IN = " (kept in "  # what the failure of a command ends with
NUMBER = re.compile(r"0x[0-9a-f]+|(?<![A-Za-z])[-+]?\d+(?:\.\d*)?(?:e[-+]?\d+)?", re.IGNORECASE)
COMPLAINT = re.compile(
    r"\b(?:error|fatal|fail|failed|failure|cannot|could not|abort(?:ed|ing)?|exception|"
    r"diverge[sd]?|divergence|singular|no(?:t)? converge\w*|no convergence|panic|segmentation fault|"
    r"illegal|invalid)\b",
    re.IGNORECASE,
)


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

    def as_outcome(self) -> Outcome:
        """The run in the terms of a screening or a search."""
        return Outcome(
            parameters=self.inputs,
            status=self.status,
            outputs=self.outputs,
            gradients=self.gradients,
            key=self.key,
            error=self.error,
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
    """Runs by why they failed, most first: causes that differ in their numbers alone are one, told by one."""
    groups: dict[str, list[Evaluation]] = {}
    for run in runs:
        groups.setdefault(without_numbers(cause_of(run.error, run.log)), []).append(run)
    several = sorted(groups.values(), key=len, reverse=True)
    return [(cause_of(group[0].error, group[0].log), group) for group in several]


def without_numbers(cause: str) -> str:
    """What causes that differ in their numbers alone have in common.

    >>> without_numbers("no root below 3.5e-2")
    'no root below #'
    """
    return NUMBER.sub("#", cause)


def cause_of(error: str, log: str) -> str:
    """Why a run failed, in a line: of a command the last line of its log that speaks of an error.

    >>> log = "step 1\\n*** ERROR: no convergence\\nbye"
    >>> cause_of("solver ended with exit code 3 (kept in work/3fa9)", log)
    'solver ended with exit code 3: *** ERROR: no convergence'
    >>> cause_of("ValueError: negative load", "Traceback ...")
    'ValueError: negative load'
    """
    first = _first_line(error)
    plain, kept, _ = first.partition(KEPT_IN)
    lines = [line.strip() for line in log.splitlines() if COMPLAINT.search(line)] if kept else []
    return f"{plain}: {lines[-1]}"[:LONGEST] if lines else plain


def _first_line(text: str) -> str:
    return text.splitlines()[0][:LONGEST] if text else "no message"
