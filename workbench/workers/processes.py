"""A pool of worker processes under supervision: the dead are replaced, the late and the greedy are killed.

Every worker leads a process group of its own and serves one run at a time. One thread looks after all of
them: it reads answers, watches deadlines, memory and the size of logs, and kills a run with everything it
started.
"""

import os
import selectors
import shutil
import subprocess
import tempfile
import time
import uuid
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from workbench.errors import StoreError, StudyError
from workbench.models.protocol import Answer, ModelSpec
from workbench.system.log_ends import ends_of
from workbench.system.processes.process_tree import Watchdog, end_group, end_marked
from workbench.system.processes.processor_time import time_of_tree
from workbench.workers.child_process import WorkerProcess, start_process
from workbench.workers.messages import answer_from_dict

__all__ = ["ProcessPool", "usable_processors"]

START_TIMEOUT = 120.0  # s; a model whose import takes longer hangs
WATCH_EVERY = 0.1  # s between looks at memory and log size, when there is a limit on memory
LONGEST_LOG = 200_000_000  # bytes of output of one run


class ProcessPool:
    """Up to `workers` processes that run one model.

    timeout: seconds per run    memory: bytes per run, above what the opened model takes
    recycle: runs after which a worker is replaced
    scratch: where logs and temporary files of runs stand while it works; a folder of the system by default
    """

    def __init__(
        self,
        spec: ModelSpec,
        *,
        workers: int = 1,
        timeout: float | None = None,
        memory: int | None = None,
        recycle: int | None = None,
        scratch: Path | None = None,
    ) -> None:
        self.capacity = workers
        self._spec = spec
        self._timeout = timeout
        self._memory = memory
        self._recycle = recycle
        self._mark = uuid.uuid4().hex
        self._count = 0
        self._workers: list[WorkerProcess] = []
        self._answered: list[tuple[Any, Answer]] = []
        self._selector = selectors.DefaultSelector()
        place = Path(tempfile.gettempdir()) if scratch is None else scratch.resolve()
        self._scratch = place / f"holdfast-{self._mark[:12]}"
        self._around = None if scratch is None else place  # goes too when it is empty
        self._make_scratch()
        self._watchdog = Watchdog(self._mark, folders=(self._scratch, self._around))

    def submit(self, task: Any, row: Mapping[str, Any], *, workdir: Path | None = None) -> None:
        """Hand a row to an idle worker; `task` comes back with its answer. At most `capacity` at a time."""
        self._make_scratch()
        worker = next((w for w in self._workers if w.task is None), None) or self._started()
        self._wait_until_ready(worker)
        worker.task, worker.begun, worker.workdir = task, time.monotonic(), workdir
        worker.deadline = worker.begun + self._timeout if self._timeout is not None else float("inf")
        message = {"id": 0, "row": dict(row), "workdir": None if workdir is None else str(workdir)}
        try:
            worker.write(message)
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

    def _make_scratch(self) -> None:
        """The folder for logs and temporary files; anew when somebody has swept it away."""
        try:
            self._scratch.mkdir(mode=0o700, parents=True, exist_ok=True)
        except OSError as exc:
            raise StoreError(
                f"cannot make the scratch folder {self._scratch}: {exc.strerror}. Free space, or name "
                "another in [evaluate] scratch"
            ) from exc

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
            worker.dismiss()
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
        if self._around is not None:
            with suppress(OSError):
                self._around.rmdir()

    def _started(self) -> WorkerProcess:
        """A new worker process, not yet ready."""
        self._count += 1
        mark = f"{self._mark}.{self._count}."
        worker = start_process(self._spec, mark=mark, scratch=self._scratch, number=self._count)
        self._workers.append(worker)
        self._selector.register(worker.outbox, selectors.EVENT_READ, worker)
        hello = {"spec": self._spec.to_dict(), "memory": self._memory, "log": str(worker.log)}
        try:
            worker.write(hello)
        except OSError:
            pass  # it ended at once; waiting for it says why
        return worker

    def _wait_until_ready(self, worker: WorkerProcess) -> None:
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
                text = worker.log_text
                raise StudyError(f"the model's process ended while it was opened: {worker.ending}\n{text}")

    def _read(self, worker: WorkerProcess) -> None:
        """Take what the worker has sent; its end counts as the end of its run."""
        messages = worker.received()
        if messages is None:
            self._bury(worker, None)
            return
        for message in messages:
            if "refused" in message:
                self._end(worker)
                raise StudyError(message["refused"])
            if "ready" in message:
                worker.ready, worker.cpu = True, time_of_tree(worker.process.pid)
            else:
                self._answer(worker, answer_from_dict(message["answer"]))

    def _answer(self, worker: WorkerProcess, answer: Answer) -> None:
        if answer.status != "ok":
            answer = _with_log(answer, ends_of(worker.log))
        self._answered.append((worker.task, answer))
        worker.task, worker.deadline = None, float("inf")
        worker.runs += 1
        worker.cpu += answer.cpu
        if worker.runs == self._recycle:
            self._end(worker)

    def _watch(self, now: float) -> None:
        """Kill what is late, takes too much memory or writes without end."""
        for worker in list(self._workers):
            if worker.task is None:
                continue
            if now >= worker.deadline:
                self._bury(worker, Answer(status="timeout", error=f"no answer within {self._timeout:g} s"))
            elif self._memory is not None and worker.resident > self._memory:
                text = f"took more than the {self._memory / 1e6:.0f} MB of memory allowed"
                self._bury(worker, Answer(status="killed", error=text))
            elif worker.log_size > LONGEST_LOG:
                text = f"wrote more than {LONGEST_LOG // 1_000_000} MB of output"
                self._bury(worker, Answer(status="killed", error=text))

    def _bury(self, worker: WorkerProcess, answer: Answer | None) -> None:
        """End the worker and answer its run: as given, or by how the process ended."""
        task = worker.task
        taken = max(time_of_tree(worker.process.pid) - worker.cpu, 0.0)  # its end takes the account with it
        self._end(worker)
        if task is not None:
            answer = answer or Answer(status="killed", error=f"the worker process {worker.ending}")
            answer = replace(answer, wall=time.monotonic() - worker.begun, cpu=taken)
            if worker.workdir is not None and worker.workdir.is_dir():
                place = f"{worker.workdir.parent.name}/{worker.workdir.name}"
                answer = replace(answer, error=f"{answer.error} (kept in {place})")
            self._answered.append((task, _with_log(answer, worker.log_text)))

    def _end(self, worker: WorkerProcess) -> None:
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

    def _forget(self, worker: WorkerProcess) -> None:
        try:
            self._selector.unregister(worker.outbox)
        except KeyError:
            return
        worker.close()


def usable_processors() -> int:
    """Processors that this process may run on."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _with_log(answer: Answer, tail: str) -> Answer:
    log = "\n".join(text for text in (answer.log, tail) if text)
    return replace(answer, log=log)
