"""Ending processes for certain: groups, descendants, and whatever carries a mark in its environment.

A run may start processes of its own, and those may start more, leave the group, or outlive their parent. All
of them inherit the environment variable `HOLDFAST_MARK`, so a look through /proc finds every one. A
*watchdog* does the same when the coordinator itself is killed: a tiny process that waits for the end of a
pipe.
"""

import ctypes
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

__all__ = ["MARK", "Watchdog", "die_with_parent", "end_group", "end_marked", "marked_processes"]

MARK = "HOLDFAST_MARK"
PR_SET_PDEATHSIG = 1
BETWEEN_LOOKS = 0.01  # s
LONGEST_HUNT = 5.0  # s

# Reads until the coordinator's end of the pipe closes, then ends all that carry the mark. Stands alone on
# purpose: it starts in a few milliseconds and shares nothing with the process it outlives.
WATCHDOG = """
import os, signal, sys, time
while os.read(0, 1): pass
mark = b"HOLDFAST_MARK=" + sys.argv[1].encode()
clear = 0
for _ in range(100):
    found = False
    for name in os.listdir("/proc"):
        if name.isdigit() and int(name) != os.getpid():
            try:
                with open("/proc/" + name + "/environ", "rb") as file:
                    if any(line.startswith(mark) for line in file.read().split(b"\\0")):
                        found = True
                        os.kill(int(name), signal.SIGKILL)
            except OSError:
                pass
    clear = 0 if found else clear + 1
    if clear == 3: break
    time.sleep(0.02)
if sys.argv[2]:
    import shutil
    shutil.rmtree(sys.argv[2], ignore_errors=True)
if sys.argv[3] and os.path.isdir(sys.argv[3]) and not os.listdir(sys.argv[3]):
    os.rmdir(sys.argv[3])
"""


def die_with_parent(parent: int) -> None:
    """Ask the kernel to kill this process when `parent` ends (Linux); end at once when it already has."""
    try:
        ctypes.CDLL(None, use_errno=True).prctl(PR_SET_PDEATHSIG, signal.SIGKILL, 0, 0, 0)
    except (OSError, AttributeError):
        return  # another system: the watchdog and the end of the pipe remain
    if os.getppid() != parent:
        os._exit(1)


def end_group(pid: int) -> None:
    """Kill the process group that `pid` leads; nothing happens when it is gone."""
    try:
        os.killpg(pid, signal.SIGKILL)
    except (ProcessLookupError, PermissionError):
        pass


def marked_processes(mark: str) -> list[int]:
    """Processes whose environment holds a mark that starts with `mark`, this process left out."""
    wanted = f"{MARK}={mark}".encode()
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            lines = (entry / "environ").read_bytes().split(b"\0")
        except OSError:
            continue  # it ended while we looked, or belongs to somebody else
        if int(entry.name) != os.getpid() and any(line.startswith(wanted) for line in lines):
            found.append(int(entry.name))
    return found


def end_marked(mark: str) -> int:
    """Kill every process that carries the mark, and those they start meanwhile; how many there were.

    A process shows no environment for a moment while it starts a program: it takes two looks that find none.
    """
    ended = clear = 0
    until = time.monotonic() + LONGEST_HUNT
    while clear < 2 and time.monotonic() < until:
        found = [pid for pid in marked_processes(mark) if not _is_zombie(pid)]
        for pid in found:
            try:
                os.kill(pid, signal.SIGKILL)
                ended += 1
            except (ProcessLookupError, PermissionError):
                pass
        clear = 0 if found else clear + 1
        if clear < 2:
            time.sleep(BETWEEN_LOOKS)
    return ended


def _is_zombie(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    except (OSError, IndexError):
        return True


class Watchdog:
    """A process that outlives this one by a moment: it ends all that carry `mark`.

    folders: one to remove with all that is in it, and one around it to remove when it is empty
    """

    def __init__(self, mark: str, *, folders: tuple[Path | None, Path | None] = (None, None)) -> None:
        environment = {k: v for k, v in os.environ.items() if k != MARK}
        self._process = subprocess.Popen(
            [sys.executable, "-I", "-S", "-c", WATCHDOG, mark, *(str(folder or "") for folder in folders)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
            env=environment,
        )

    def close(self) -> None:
        """Let it do its work now, and wait for its end."""
        assert self._process.stdin is not None
        self._process.stdin.close()
        try:
            self._process.wait(timeout=10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
