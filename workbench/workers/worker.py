"""The other end of the process pool: opens the model once, answers rows until its pipe closes.

Messages go over two pipes of their own (see `messages.py`), so that a model may print whatever it likes:
standard output and error go to a log, of which the coordinator keeps the tail when a run fails. Nothing is
pickled. The process leads its own group and dies with its coordinator.
"""

import os
import resource
import socket
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.opening import open_model
from workbench.models.protocol import ModelSpec, call
from workbench.system.processes.process_tree import die_with_parent
from workbench.workers.messages import answer_to_dict, pack, receive

__all__ = ["main"]


def limit_memory(bytes_more: int) -> None:
    """Refuse this process and its children more than `bytes_more` of address space beyond what it has now."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    limit = pages * resource.getpagesize() + bytes_more
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))


def main(inbox: int, outbox: int, parent: int) -> None:
    """Serve until the coordinator closes the pipe."""
    die_with_parent(parent)
    reading, writing = os.fdopen(inbox, "rb"), os.fdopen(outbox, "wb")

    def send(message: Any) -> None:
        writing.write(pack(message))
        writing.flush()

    hello = receive(reading)
    if hello is None:
        return
    log = _log_to(hello["log"])
    _fresh_output(log)
    spec = ModelSpec.from_dict(hello["spec"])
    try:
        model = open_model(spec)
        if hello["memory"] is not None:
            limit_memory(hello["memory"])
    except StudyError as exc:
        send({"refused": str(exc)})
        return
    host = socket.gethostname()
    send({"ready": os.getpid()})
    while (task := receive(reading)) is not None:
        _fresh_output(log)
        workdir = None if task["workdir"] is None else Path(task["workdir"])
        answer = replace(call(model, spec, task["row"], workdir=workdir), host=host)
        _flush_output()
        send({"id": task["id"], "answer": answer_to_dict(answer)})
    model.close()


def _log_to(path: str) -> int:
    """Standard input from nowhere; a file descriptor of the log."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    os.dup2(nothing, 0)
    os.close(nothing)
    return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_APPEND, 0o600)


def _fresh_output(log: int) -> None:
    """Every run begins with an empty log on both outputs, whatever the run before did to them."""
    os.ftruncate(log, 0)
    os.dup2(log, 1)
    os.dup2(log, 2)
    if sys.stdout is None or sys.stdout.closed:
        sys.stdout = open(1, "w", closefd=False)
    if sys.stderr is None or sys.stderr.closed:
        sys.stderr = open(2, "w", closefd=False)


def _flush_output() -> None:
    """Bring what the run printed to the log, if there is still a way."""
    for stream in (sys.stdout, sys.stderr):
        try:
            stream.flush()
        except (OSError, ValueError, AttributeError):
            pass  # the run closed it
