"""A run as it is stored: a row of the table `evaluation`, which campaign and report read alike."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from workbench.models.evaluator import Outcome

__all__ = ["COLUMNS", "FAILED", "UNFINISHED", "Evaluation", "evaluation_of"]

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
        status=status,
        attempt=attempt,
        batch=batch,
        inputs=json.loads(inputs),
        outputs=json.loads(outputs) if outputs else {},
        gradients=json.loads(slopes) if slopes else {},
        error=error or "",
        log=log or "",
        created=created,
        started=started,
        finished=finished,
        wall=wall,
        cpu=cpu,
        host=host,
        seed=seed,
    )
