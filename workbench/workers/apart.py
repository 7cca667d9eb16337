"""A run in a forked copy of this process, for an input that is suspected of ending the process it runs in."""

import os
import signal
import warnings
from collections.abc import Callable

from workbench.models.protocol import Answer
from workbench.system.processes.process_tree import die_with_parent
from workbench.workers.messages import answer_from_dict, answer_to_dict, pack, receive

__all__ = ["answered_apart"]


def answered_apart(run: Callable[[], Answer]) -> Answer:
    """The answer of `run`, made in a copy of this process; "killed" when the copy ends without one."""
    parent = os.getpid()
    reading, writing = os.pipe()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)  # of Python 3.12 on, where there are threads
        copy = os.fork()
    if copy == 0:
        try:
            os.close(reading)
            die_with_parent(parent)
            with os.fdopen(writing, "wb") as pipe:
                pipe.write(pack(answer_to_dict(run())))
        finally:
            os._exit(0)
    os.close(writing)
    try:
        with os.fdopen(reading, "rb") as pipe:
            message = receive(pipe)
    except BaseException as exc:
        os.kill(copy, signal.SIGKILL)
        os.waitpid(copy, 0)
        if not isinstance(exc, ValueError):
            raise
        return Answer(status="killed", error="its process ended while it answered")
    code = os.waitstatus_to_exitcode(os.waitpid(copy, 0)[1])
    if message is None:
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return Answer(status="killed", error=f"it ended its process twice, the second time with {how}")
    return answer_from_dict(message)
