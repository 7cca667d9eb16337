"""Rows in, answers stored: whoever runs the model, results are committed in waves and failures are data.

Everything here sees an engine only through `submit` and `completed`. An engine delivers at least once; a run
is known by its key, so a repeated or late answer changes nothing.
"""

import signal
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from workbench.campaign.store import Store
from workbench.errors import Interrupted, StudyError
from workbench.models.evaluation import Evaluation
from workbench.models.opening import open_model
from workbench.models.protocol import (
    Answer,
    Model,
    ModelSpec,
    call,
)

__all__ = ["Engine", "InlineEngine", "Policy", "supervise"]

WAVE = 0.025  # s: answers that arrive within it share one commit
DEATHS = 2  # a row that ended its process this often is not tried again

Watcher = Callable[[Sequence[Evaluation]], None]


class Engine(Protocol):
    """Runs rows, in whatever order they finish."""

    capacity: int

    def submit(self, task: Any, row: Mapping[str, Any], *, workdir: Path | None = None) -> None:
        """Begin a run; at most `capacity` are under way."""

    def completed(self, *, wait: float | None = None) -> list[tuple[Any, Answer]]:
        """Finished tasks with answers; waits for one at least, up to `wait` seconds."""

    def close(self) -> None:
        """End all runs and release everything."""


class InlineEngine:
    """Runs rows in this process, one by one. Nothing protects it from a model that crashes or hangs."""

    capacity = 1

    def __init__(self, spec: ModelSpec, model: Model | None = None) -> None:
        self._spec = spec
        self._model = open_model(spec) if model is None else model
        self._waiting: deque[tuple[Any, Mapping[str, Any], Path | None]] = deque()

    def submit(self, task: Any, row: Mapping[str, Any], *, workdir: Path | None = None) -> None:
        """Put the row in line."""
        self._waiting.append((task, row, workdir))

    def completed(self, *, wait: float | None = None) -> list[tuple[Any, Answer]]:
        """Run the first row in line."""
        if not self._waiting:
            return []
        task, row, workdir = self._waiting.popleft()
        return [(task, call(self._model, self._spec, row, workdir=workdir))]

    def close(self) -> None:
        """Close the model."""
        self._model.close()


@dataclass(frozen=True, slots=True, kw_only=True)
class Policy:
    """How often a row is tried: once, `retries` times more after a failure, twice when its process died."""

    retries: int = 0

    def tries_again(self, status: str, attempt: int) -> bool:
        """Whether a row that ended with `status` at its `attempt`-th try goes back into the queue."""
        if status in ("ok", "skipped"):
            return False
        return attempt < max(DEATHS if status == "killed" else 1, 1 + self.retries)


def supervise(
    engine: Engine,
    store: Store,
    keys: Sequence[str],
    *,
    policy: Policy,
    watcher: Watcher | None = None,
    workdir: Callable[[str], Path] | None = None,
    keep: Callable[[str, Answer], None] | None = None,
) -> None:
    """Run the queued rows behind `keys` until each has its final answer in the store.

    `watcher` is told what has been committed, never sooner; `keep` gets every answer before its commit, to
    write what does not belong into the database. At most the rows under way and those answered
    within the last 25 ms are repeated when this process is killed.

    Raises:
        Interrupted: Ctrl-C; everything answered is stored, the rest is back in the queue.
        StoreError: the store refused a write; nothing more is run.
    """
    rows = {row.key: row for row in store.rows(keys=keys)}
    waiting = deque(key for key in keys if rows[key].status == "queued")
    attempts = {key: rows[key].attempt for key in waiting}  # ever
    tries = dict.fromkeys(waiting, 0)  # by this process
    running: set[str] = set()
    begun: list[str] = []
    answered: list[tuple[str, Answer, bool]] = []
    last_commit = time.monotonic()

    def commit() -> None:
        nonlocal last_commit
        with _signals_held():
            if keep is not None:
                for key, answer, _ in answered:
                    keep(key, answer)
            with store.transaction():
                store.start([(key, attempts[key]) for key in begun if key in running])
                for key, answer, again in answered:
                    store.finish(key, answer, attempt=attempts[key], again=again, host=HOST)
            final = [key for key, _, again in answered if not again]
            begun.clear()
            answered.clear()
        last_commit = time.monotonic()
        if watcher is not None and final:
            watcher(store.rows(keys=final))

    def give_back() -> None:
        commit()
        store.release(list(running))

    try:
        while waiting or running:
            while waiting and len(running) < engine.capacity:
                key = waiting.popleft()
                attempts[key] += 1
                tries[key] += 1
                running.add(key)
                begun.append(key)
                engine.submit(key, rows[key].inputs, workdir=None if workdir is None else workdir(key))
            if begun and time.monotonic() - last_commit > WAVE:
                commit()  # a long run is seen as running while it runs
            for key, answer in engine.completed(wait=WAVE if begun or answered else None):
                if key not in running:
                    continue  # delivered twice
                running.discard(key)
                again = policy.tries_again(answer.status, tries[key])
                answered.append((key, answer, again))
                if again:
                    commit()  # the attempt is on record before the next one begins
                    waiting.append(key)
            if answered and (time.monotonic() - last_commit > WAVE or not (waiting or running)):
                commit()
    except KeyboardInterrupt:
        give_back()
        left = len(waiting) + len(running)
        raise Interrupted(f"interrupted with {left} runs left; the same command continues") from None
    except StudyError:
        give_back()
        raise


@contextmanager
def _signals_held() -> Iterator[None]:
    """Let Ctrl-C and SIGTERM wait for the end of the block: a commit and its book-keeping are one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


HOST = socket.gethostname()
