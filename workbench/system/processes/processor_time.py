"""Processor seconds: of this process with the children that it waited for, and of a process with its own.

A solver that a run starts is a child: its time is not that of the process that waits for it.
"""

import time
from contextlib import suppress

__all__ = ["processor_time", "time_of_tree"]


def processor_time() -> float:
    """s that this process has taken, and the children that it waited for, with theirs.

    A system without `getrusage` counts no children.
    """
    own = time.process_time()
    try:
        import resource
    except ImportError:
        return own
    waited = resource.getrusage(resource.RUSAGE_CHILDREN)
    return own + waited.ru_utime + waited.ru_stime


def time_of_tree(pid: int) -> float:
    """s that a process, its living descendants and the children that they waited for have taken; 0 of none.

    One that has ended counts until it is waited for.
    """
    import psutil

    total = 0.0
    with suppress(psutil.Error):
        process = psutil.Process(pid)
        for one in (process, *process.children(recursive=True)):
            with suppress(psutil.Error):
                times = one.cpu_times()
                total += times.user + times.system
                total += getattr(times, "children_user", 0.0) + getattr(times, "children_system", 0.0)
    return total
