"""One worker process: its pipes, its log, the run it is at, how much memory it takes and how it ended."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from workbench.errors import StoreError
from workbench.models.command import LOG
from workbench.models.protocol import ModelSpec
from workbench.system.log_ends import ends_of
from workbench.system.processes.process_tree import MARK
from workbench.workers.messages import opened, pack

__all__ = ["WorkerProcess", "start_process"]

BOOTSTRAP = (
    "import sys; sys.path.append({root!r}); "
    "from workbench.workers.worker import main; main({inbox}, {outbox}, {parent})"
)


@dataclass(slots=True, eq=False)
class WorkerProcess:
    """One process with its pipes and the run it is at.

    inbox: tasks are written here    outbox: answers are read here    task: None while it is idle
    workdir: the folder of the run, where a command keeps its log
    cpu: processor seconds of before its run, of opening the model and of the runs that it answered
    """

    process: subprocess.Popen[bytes]
    inbox: int
    outbox: int
    log: Path
    mark: str
    started: float
    ready: bool = False
    task: Any = None
    workdir: Path | None = None
    begun: float = 0.0
    runs: int = 0
    cpu: float = 0.0
    deadline: float = float("inf")
    buffer: bytearray = field(default_factory=bytearray)

    def write(self, message: Mapping[str, Any]) -> None:
        """Send a message whole. Raises OSError when the process is gone."""
        view = memoryview(pack(message))
        while view:
            view = view[os.write(self.inbox, view) :]

    def received(self) -> list[Any] | None:
        """Messages that have come whole since the last look; None when the pipe is closed: it ended."""
        try:
            chunk = os.read(self.outbox, 1 << 20)
        except OSError:
            chunk = b""
        if not chunk:
            return None
        self.buffer += chunk
        found = []
        while len(self.buffer) >= 8:
            size = int.from_bytes(self.buffer[:8], "big")
            if len(self.buffer) < 8 + size:
                break
            found.append(opened(bytes(self.buffer[8 : 8 + size])))
            del self.buffer[: 8 + size]
        return found

    def dismiss(self) -> None:
        """Close the pipe of tasks: an idle worker then ends by itself."""
        _close(self.inbox)
        self.inbox = -1  # the number may soon be that of another file

    def close(self) -> None:
        """Close both pipes."""
        _close(self.outbox)
        _close(self.inbox)

    @property
    def log_size(self) -> int:
        """Bytes written to the log; 0 when there is none."""
        try:
            return self.log.stat().st_size
        except OSError:
            return 0

    @property
    def log_text(self) -> str:
        """What the run printed, and what its command did: the beginning and the end of either log."""
        logs = [self.log] if self.workdir is None else [self.log, self.workdir / LOG]
        return "\n".join(text for text in map(ends_of, logs) if text)

    @property
    def resident(self) -> int:
        """Resident memory in bytes of the process and its descendants."""
        import psutil

        total = 0
        try:
            process = psutil.Process(self.process.pid)
            for one in (process, *process.children(recursive=True)):
                try:
                    total += one.memory_info().rss
                except psutil.Error:
                    pass
        except psutil.Error:
            pass
        return total

    @property
    def ending(self) -> str:
        """How the process ended, to be said after "the process"."""
        code = self.process.returncode
        if code is not None and code < 0:
            try:
                name = signal.Signals(-code).name
            except ValueError:
                name = "unknown"
            return f"was ended by signal {-code} ({name})"
        return f"ended by itself with exit code {code}"


def start_process(spec: ModelSpec, *, mark: str, scratch: Path, number: int) -> WorkerProcess:
    """A worker that is not ready yet, in a process group of its own, its output in a log in `scratch`.

    Raises:
        StoreError: the operating system refuses another process.
    """
    to_worker, from_worker = os.pipe(), os.pipe()
    root = str(Path(__file__).resolve().parents[2])
    code = BOOTSTRAP.format(root=root, inbox=to_worker[0], outbox=from_worker[1], parent=os.getpid())
    log = scratch / f"worker-{number}.log"
    output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            pass_fds=(to_worker[0], from_worker[1]),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            cwd=spec.folder,
            # temporary files of runs go with the pool, also those of runs that were killed
            env={**os.environ, MARK: mark, "TMPDIR": str(scratch)},
        )
    except OSError as exc:
        _close(to_worker[1])
        _close(from_worker[0])
        raise StoreError(f"cannot start a worker process: {exc}") from exc
    finally:
        for end in (output, to_worker[0], from_worker[1]):
            _close(end)
    return WorkerProcess(
        process=process,
        inbox=to_worker[1],
        outbox=from_worker[0],
        log=log,
        mark=mark,
        started=time.monotonic(),
    )


def _close(pipe: int) -> None:
    try:
        os.close(pipe)
    except OSError:
        pass
