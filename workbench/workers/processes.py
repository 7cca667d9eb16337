"""A pool of worker processes under supervision: the dead are replaced, the late and the greedy are killed.

Every worker leads a process group of its own and serves one run at a time. One thread looks after all of
them: it reads answers, watches deadlines, memory and the size of logs, and kills a run with everything it
started.
"""

import os
import selectors
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from workbench.errors import StoreError, StudyError
from workbench.models.protocol import Answer, ModelSpec
from workbench.system.process_tree import (
    MARK,
    Watchdog,
    end_group,
    end_marked,
)
from workbench.workers.worker import answer_from_dict, pack

__all__ = ["ProcessPool"]

START_TIMEOUT = 120.0  # s; a model whose import takes longer hangs
WATCH_EVERY = 0.1  # s between looks at memory and log size, when there is a limit on memory
LONGEST_LOG = 200_000_000  # bytes of output of one run
LOG_TAIL = 4000  # bytes that are kept
BOOTSTRAP = (
    "import sys; sys.path.append({root!r}); "
    "from workbench.workers.worker import main; main({inbox}, {outbox}, {parent})"
)


@dataclass(slots=True)
class _Worker:
    """One process with its pipes and the run it is at."""

    process: subprocess.Popen[bytes]
    inbox: int  # we write tasks here
    outbox: int  # we read answers here
    log: Path
    mark: str
    started: float
    ready: bool = False
    task: Any = None
    begun: float = 0.0
    runs: int = 0
    deadline: float = float("inf")
    buffer: bytearray = field(default_factory=bytearray)


class ProcessPool:
    """Up to `workers` processes that run one model.

    timeout: seconds per run    memory: bytes per run, above what the opened model takes
    recycle: runs after which a worker is replaced
    """

    def __init__(
        self,
        spec: ModelSpec,
        *,
        workers: int = 1,
        timeout: float | None = None,
        memory: int | None = None,
        recycle: int | None = None,
    ) -> None:
        self.capacity = workers
        self._spec = spec
        self._timeout = timeout
        self._memory = memory
        self._recycle = recycle
        self._mark = uuid.uuid4().hex
        self._count = 0
        self._workers: list[_Worker] = []
        self._answered: list[tuple[Any, Answer]] = []
        self._selector = selectors.DefaultSelector()
        self._scratch = Path(tempfile.mkdtemp(prefix="holdfast-"))
        self._watchdog = Watchdog(self._mark)

    def submit(self, task: Any, row: Mapping[str, Any], *, workdir: Path | None = None) -> None:
        """Hand a row to an idle worker; `task` comes back with its answer. At most `capacity` at a time."""
        worker = next((w for w in self._workers if w.task is None), None) or self._started()
        self._wait_until_ready(worker)
        worker.task, worker.begun = task, time.monotonic()
        worker.deadline = worker.begun + self._timeout if self._timeout is not None else float("inf")
        message = {"id": 0, "row": dict(row), "workdir": None if workdir is None else str(workdir)}
        try:
            _write_all(worker.inbox, pack(message))
        except OSError:
            self._bury(worker, None)  # it died while idle: the run counts as killed and is tried again

    def completed(self, *, wait: float | None = None) -> list[tuple[Any, Answer]]:
        """Finished tasks with their answers; waits for one at least, up to `wait` seconds."""
        until = float("inf") if wait is None else time.monotonic() + wait
        while not self._answered and self.running:
            now = time.monotonic()
            if now >= until:
                break
            pause = min([until, *(w.deadline for w in self._workers)]) - now
            watched = self._memory is not None
            pause = max(0.0, min(pause, WATCH_EVERY if watched else 1.0))
            for key, _ in self._selector.select(pause):
                self._read(key.data)
            self._watch(time.monotonic())
        done, self._answered = self._answered, []
        return done

    @property
    def running(self) -> int:
        """Runs that have no answer yet."""
        return sum(w.task is not None for w in self._workers)

    def probe(self) -> dict[str, Any]:
        """Start all workers and say how many processors they really have, by their affinity and quota."""
        while len(self._workers) < self.capacity:
            self._started()
        for worker in list(self._workers):
            self._wait_until_ready(worker)
        return {"workers": len(self._workers), "processors": usable_processors()}

    def close(self) -> None:
        """End all workers and whatever their runs left behind."""
        for worker in self._workers:
            _close(worker.inbox)
        until = time.monotonic() + 1.0
        for worker in self._workers:
            if worker.task is None and worker.ready:
                try:
                    worker.process.wait(timeout=max(0.01, until - time.monotonic()))
                except subprocess.TimeoutExpired:
                    pass
            end_group(worker.process.pid)
            worker.process.wait()
            self._forget(worker)
        self._workers.clear()
        self._watchdog.close()
        end_marked(self._mark)
        self._selector.close()
        shutil.rmtree(self._scratch, ignore_errors=True)

    def _started(self) -> _Worker:
        """A new worker process, not yet ready."""
        self._count += 1
        mark = f"{self._mark}.{self._count}."
        to_worker, from_worker = os.pipe(), os.pipe()
        root = str(Path(__file__).resolve().parents[2])
        code = BOOTSTRAP.format(root=root, inbox=to_worker[0], outbox=from_worker[1], parent=os.getpid())
        log = self._scratch / f"worker-{self._count}.log"
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
        try:
            process = subprocess.Popen(
                [sys.executable, "-P", "-c", code],
                pass_fds=(to_worker[0], from_worker[1]),
                stdin=subprocess.DEVNULL,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                cwd=self._spec.folder,
                # temporary files of runs go with the pool, also those of runs that were killed
                env={**os.environ, MARK: mark, "TMPDIR": str(self._scratch)},
            )
        except OSError as exc:
            _close(to_worker[1])
            _close(from_worker[0])
            raise StoreError(f"cannot start a worker process: {exc}") from exc
        finally:
            for end in (output, to_worker[0], from_worker[1]):
                _close(end)
        worker = _Worker(
            process=process,
            inbox=to_worker[1],
            outbox=from_worker[0],
            log=log,
            mark=mark,
            started=time.monotonic(),
        )
        self._workers.append(worker)
        self._selector.register(worker.outbox, selectors.EVENT_READ, worker)
        hello = {"spec": self._spec.to_dict(), "memory": self._memory, "log": str(log)}
        try:
            _write_all(worker.inbox, pack(hello))
        except OSError:
            pass  # it ended at once; waiting for it says why
        return worker

    def _wait_until_ready(self, worker: _Worker) -> None:
        """Read the worker's greeting.

        Raises:
            StudyError: the model cannot be opened, or opening it hangs or ends the process.
        """
        while not worker.ready:
            left = worker.started + START_TIMEOUT - time.monotonic()
            if left <= 0:
                self._end(worker)
                raise StudyError(
                    f"the model was not ready after {START_TIMEOUT:g} s; does importing it start work?"
                )
            for key, _ in self._selector.select(min(left, 1.0)):
                self._read(key.data)
            if worker not in self._workers:
                text = _tail(worker.log)
                raise StudyError(
                    f"the model's process ended while it was opened: {_ending(worker.process)}\n{text}"
                )

    def _read(self, worker: _Worker) -> None:
        """Take what the worker has sent; its end counts as the end of its run."""
        try:
            chunk = os.read(worker.outbox, 1 << 20)
        except OSError:
            chunk = b""
        if not chunk:
            self._bury(worker, None)
            return
        worker.buffer += chunk
        while len(worker.buffer) >= 8:
            size = int.from_bytes(worker.buffer[:8], "big")
            if len(worker.buffer) < 8 + size:
                return
            message = _decoded(bytes(worker.buffer[8 : 8 + size]))
            del worker.buffer[: 8 + size]
            if "refused" in message:
                self._end(worker)
                raise StudyError(message["refused"])
            if "ready" in message:
                worker.ready = True
            else:
                self._answer(worker, answer_from_dict(message["answer"]))

    def _answer(self, worker: _Worker, answer: Answer) -> None:
        if answer.status != "ok":
            answer = _with_log(answer, _tail(worker.log))
        self._answered.append((worker.task, answer))
        worker.task, worker.deadline = None, float("inf")
        worker.runs += 1
        if worker.runs == self._recycle:
            self._end(worker)

    def _watch(self, now: float) -> None:
        """Kill what is late, takes too much memory or writes without end."""
        for worker in list(self._workers):
            if worker.task is None:
                continue
            if now >= worker.deadline:
                self._bury(worker, Answer(status="timeout", error=f"no answer within {self._timeout:g} s"))
            elif self._memory is not None and _resident(worker.process.pid) > self._memory:
                text = f"took more than the {self._memory / 1e6:.0f} MB of memory allowed"
                self._bury(worker, Answer(status="killed", error=text))
            elif _size(worker.log) > LONGEST_LOG:
                text = f"wrote more than {LONGEST_LOG // 1_000_000} MB of output"
                self._bury(worker, Answer(status="killed", error=text))

    def _bury(self, worker: _Worker, answer: Answer | None) -> None:
        """End the worker and answer its run: as given, or by how the process ended."""
        task = worker.task
        self._end(worker)
        if task is not None:
            answer = answer or Answer(status="killed", error=f"the worker process {_ending(worker.process)}")
            answer = replace(answer, wall=time.monotonic() - worker.begun)
            self._answered.append((task, _with_log(answer, _tail(worker.log))))

    def _end(self, worker: _Worker) -> None:
        # a process that closed its pipe is about to end by itself: let its own signal or code be the one
        # reported
        if worker.process.poll() is None and worker.deadline > time.monotonic():
            try:
                worker.process.wait(timeout=0.05)
            except subprocess.TimeoutExpired:
                pass
        end_group(worker.process.pid)
        worker.process.wait()
        end_marked(worker.mark)
        self._forget(worker)
        self._workers.remove(worker)

    def _forget(self, worker: _Worker) -> None:
        try:
            self._selector.unregister(worker.outbox)
        except KeyError:
            return
        _close(worker.outbox)
        _close(worker.inbox)


def usable_processors() -> int:
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _decoded(body: bytes) -> Any:
    import json

    return json.loads(body)


def _write_all(pipe: int, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[os.write(pipe, view) :]


def _close(pipe: int) -> None:
    try:
        os.close(pipe)
    except OSError:
        pass


def _tail(log: Path) -> str:
    """The last lines of a log, with what is not text made visible."""
    try:
        with open(log, "rb") as file:
            file.seek(max(0, _size(log) - LOG_TAIL))
            return file.read(LOG_TAIL).decode("utf-8", errors="backslashreplace").replace("\0", "\\0").strip()
    except OSError:
        return ""


def _with_log(answer: Answer, tail: str) -> Answer:
    log = "\n".join(text for text in (answer.log, tail) if text)
    return replace(answer, log=log)


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _resident(pid: int) -> int:
    """Resident memory in bytes of a process and its descendants."""
    import psutil

    total = 0
    try:
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            try:
                total += one.memory_info().rss
            except psutil.Error:
                pass
    except psutil.Error:
        pass
    return total


def _ending(process: subprocess.Popen[bytes]) -> str:
    code = process.returncode
    if code is not None and code < 0:
        try:
            name = signal.Signals(-code).name
        except ValueError:
            name = "unknown"
        return f"was ended by signal {-code} ({name})"
    return f"ended by itself with exit code {code}"
