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
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from workbench.campaign.store import Store
from workbench.errors import Interrupted, StudyError
from workbench.models.opening import open_model
from workbench.models.protocol import Answer, Model, ModelSpec, call
from workbench.models.stored.evaluation import Evaluation
from workbench.space.units import counted

__all__ = ["Engine", "InlineEngine", "Policy", "supervise"]

WAVE = 0.025  # s: answers that arrive within it share one commit
HOST = socket.gethostname()
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
        self.suspects: frozenset[Any] = frozenset()  # tasks that may end the process they run in

    def submit(self, task: Any, row: Mapping[str, Any], *, workdir: Path | None = None) -> None:
        """Put the row in line."""
        self._waiting.append((task, row, workdir))

    def completed(self, *, wait: float | None = None) -> list[tuple[Any, Answer]]:
        """Run the first row in line."""
        if not self._waiting:
            return []
        task, row, workdir = self._waiting.popleft()
        if task not in self.suspects:
            return [(task, call(self._model, self._spec, row, workdir=workdir))]
        from workbench.workers.apart import answered_apart

        return [(task, answered_apart(lambda: call(self._model, self._spec, row, workdir=workdir)))]

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
    keep: Callable[[Sequence[tuple[str, Answer]]], None] | None = None,
) -> None:
    """Run the queued rows behind `keys` until each has its final answer in the store.

    `watcher` is told what has been committed, never sooner; `keep` gets answers with their keys before their
    commit, to write what does not belong into the database. At most the rows under way and those answered
    within the last 25 ms are repeated when this process is killed. Rows that were under way when a
    coordinator went run last and alone, so that it is known which one took it: in a process of their own
    where the rest do not.

    Raises:
        Interrupted: Ctrl-C; everything answered is stored, the rest is back in the queue.
        StoreError: the store refused a write; nothing more is run.
    """
    rows = {row.key: row for row in store.rows(keys=keys)}
    queued = [key for key in keys if rows[key].status == "queued"]
    suspects = frozenset(store.suspects() & set(queued))
    waiting = deque(sorted(queued, key=suspects.__contains__))
    if isinstance(engine, InlineEngine):
        engine.suspects = suspects
    wave = _Wave(
        engine=engine,
        store=store,
        policy=policy,
        watcher=watcher,
        workdir=workdir,
        keep=keep,
        rows=rows,
        waiting=waiting,
        suspects=suspects,
        attempts={key: rows[key].attempt for key in waiting},
        tries=dict.fromkeys(waiting, 0),
    )
    try:
        while wave.waiting or wave.running:
            wave.submit()
            if wave.begun and wave.is_due:
                wave.commit()  # a long run is seen as running while it runs
            wave.collect()
            if wave.answered and (wave.is_due or not (wave.waiting or wave.running)):
                wave.commit()
    except KeyboardInterrupt:
        wave.give_back()
        left = len(wave.waiting) + len(wave.running)
        # of a search these are the runs of one proposal, not those that its budget has left
        raise Interrupted(
            f"interrupted with {counted(left, 'run')} unanswered; the same command continues"
        ) from None
    except StudyError:
        wave.give_back()
        raise


@dataclass(slots=True, kw_only=True)
class _Wave:
    """Rows on their way through an engine, and what happened to them since the last commit.

    attempts: how often each was begun, ever    tries: how often by this process
    begun, answered: not yet in the store; an answer goes with whether its row is tried again
    """

    engine: Engine
    store: Store
    policy: Policy
    watcher: Watcher | None
    workdir: Callable[[str], Path] | None
    keep: Callable[[Sequence[tuple[str, Answer]]], None] | None
    rows: Mapping[str, Evaluation]
    waiting: deque[str]
    suspects: frozenset[str]
    attempts: dict[str, int]
    tries: dict[str, int]
    running: set[str] = field(default_factory=set)
    begun: list[str] = field(default_factory=list)
    answered: list[tuple[str, Answer, bool]] = field(default_factory=list)
    last_commit: float = field(default_factory=time.monotonic)

    @property
    def is_due(self) -> bool:
        """Whether the last commit is long enough ago for the next."""
        return time.monotonic() - self.last_commit > WAVE

    def submit(self) -> None:
        """Hand the engine as many rows as it has room for."""
        while self.waiting and len(self.running) < self.engine.capacity:
            if self.running and (self.waiting[0] in self.suspects or self.running & self.suspects):
                break  # it runs alone
            key = self.waiting.popleft()
            self.attempts[key] += 1
            self.tries[key] += 1
            self.running.add(key)
            self.begun.append(key)
            workdir = None if self.workdir is None else self.workdir(key)
            if self.store.starts is not None:
                apart = key in self.suspects and isinstance(self.engine, InlineEngine)
                self.store.starts.begin(key, apart=apart)
            self.engine.submit(key, self.rows[key].inputs, workdir=workdir)

    def collect(self) -> None:
        """Take the answers that have come; a row that is tried again goes to the end of the queue."""
        for key, answer in self.engine.completed(wait=WAVE if self.begun or self.answered else None):
            if key not in self.running:
                continue  # delivered twice
            self.running.discard(key)
            if self.store.starts is not None:
                self.store.starts.end(key)
            again = self.policy.tries_again(answer.status, self.tries[key])
            again = again and not (answer.status == "killed" and key in self.suspects)
            self.answered.append((key, answer, again))
            if again:
                self.commit()  # the attempt is on record before the next one begins
                self.waiting.append(key)

    def commit(self) -> None:
        """Bring the store up to date in one transaction, then tell the watcher."""
        with _signals_held():
            if self.keep is not None:
                self.keep([(key, answer) for key, answer, _ in self.answered])
            with self.store.transaction():
                self.store.start([(key, self.attempts[key]) for key in self.begun if key in self.running])
                for key, answer, again in self.answered:
                    self.store.finish(
                        key, answer, attempt=self.attempts[key], again=again, host=answer.host or HOST
                    )
            final = [key for key, _, again in self.answered if not again]
            self.begun.clear()
            self.answered.clear()
        self.last_commit = time.monotonic()
        if self.watcher is not None and final:
            self.watcher(self.store.rows(keys=final))

    def give_back(self) -> None:
        """Store what was answered, and put the rest back in the queue."""
        self.commit()
        self.store.release(list(self.running))
        if self.store.starts is not None:
            for key in self.running:
                self.store.starts.end(key)


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
