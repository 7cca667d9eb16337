"""Who is at a run: host, boot, process and its start, so that a reused process id is not taken for alive."""

import os
import socket
from functools import cache
from pathlib import Path

__all__ = ["is_alive", "is_on_this_host", "owner_of_this_process"]


def owner_of_this_process() -> str:
    """The owner mark of this process."""
    return _owner(os.getpid())


def is_alive(owner: str) -> bool:
    """Whether the process behind an owner mark still runs. Another host's is taken for gone.

    The store's lock lets one coordinator in, so whoever asks this holds the lock and the other host does not.
    """
    try:
        host, boot, pid, _ = owner.split("|")
    except ValueError:
        return False
    return host == socket.gethostname() and boot == _boot() and _owner(int(pid)) == owner


def is_on_this_host(owner: str) -> bool:
    """Whether an owner mark is of a process of this machine, alive or not."""
    return owner.split("|")[0] == socket.gethostname()


def _owner(pid: int) -> str:
    return "|".join((socket.gethostname(), _boot(), str(pid), _start_time(pid)))


@cache
def _boot() -> str:
    try:
        return Path("/proc/sys/kernel/random/boot_id").read_text().strip()
    except OSError:
        return "unknown"


def _start_time(pid: int) -> str:
    """Clock ticks between boot and the start of the process; empty when it is gone."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19]
    except (OSError, IndexError):
        return ""
