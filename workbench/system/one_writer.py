"""One writer at a time for a file: a lock of the kernel where there is one, and a lease that names them.

The lease is a file beside the database (`.runs.sqlite.lease`, JSON): host, process and its start, since when.
On a local disk the kernel's lock decides and the lease only names. Where the kernel has no lock, or on a
network file system, where it may bind one machine only, the lease decides: it is made by a link that succeeds
for one alone, its file is touched every `RENEW` seconds, and it is taken over when its process is gone from
this machine, or when another machine has not touched it for `STALE` seconds by the file system's own clock.
Whoever loses it so writes nothing more.
"""

import errno
import fcntl
import json
import os
import shutil
import threading
import time
import uuid
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path

from workbench.errors import StoreError
from workbench.system.database import NETWORK, file_system
from workbench.system.lease import is_alive, is_on_this_host, owner_of_this_process

__all__ = ["RENEW", "STALE", "Holder", "WriterLock", "holder_of", "moment"]

RENEW = 10.0  # s between two signs of life
STALE = 60.0  # s without one, after which another machine's lease is taken over: six signs of life missed


def moment(seconds: float) -> str:
    """A time in seconds since 1970 as people write it.

    >>> moment(0)
    '1970-01-01 00:00:00 UTC'
    """
    return time.strftime("%Y-%m-%d %H:%M:%S UTC", time.gmtime(seconds))


@dataclass(frozen=True, slots=True, kw_only=True)
class Holder:
    """Who writes, as the lease says.

    owner: mark of the process.    since: seconds since 1970.    token: of this one lease.
    renewed: whether it gives signs of life; else a lock of the kernel stands behind it.
    """

    owner: str
    since: float
    token: str
    renewed: bool

    @property
    def sentence(self) -> str:
        """Host, process and since when."""
        host, _, pid, _ = self.owner.split("|")
        return f"process {pid} on {host} since {moment(self.since)}"

    @property
    def is_this_process(self) -> bool:
        """Whether it is the process that asks."""
        return self.owner == owner_of_this_process()

    def is_gone(self, *, age: float, locked: bool) -> bool:
        """Whether it does not write any more.

        Args:
            age: seconds since its last sign of life.
            locked: whether whoever asks holds a lock of the kernel that binds all machines.
        """
        if is_on_this_host(self.owner):
            return locked or not is_alive(self.owner)
        return age > STALE if self.renewed else locked


def holder_of(path: Path) -> Holder | None:
    """Who writes to the file at `path`, for one who only looks; None when nobody does."""
    found = _read(_lease_of(path))
    if found is None:
        return None
    holder, touched = found
    if holder is None or holder.is_gone(age=time.time() - touched, locked=False):
        return None
    return holder


class WriterLock:
    """The right to write to a file. Take it with `WriterLock.taken`, give it back with `close`."""

    def __init__(self, path: Path, handle: int | None) -> None:
        self._path = path
        self._handle = handle
        self._decides = handle is None or file_system(path.parent) in NETWORK
        self._holder = Holder(
            owner=owner_of_this_process(), since=time.time(), token=uuid.uuid4().hex, renewed=self._decides
        )
        self._ended = threading.Event()
        self._beating: threading.Thread | None = None
        self._seen = _awake()
        self._lost = ""

    @classmethod
    def taken(cls, path: Path) -> "WriterLock":
        """The right to write to the file at `path`.

        Raises:
            StoreError: somebody else has it, or nothing can be written beside the file.
        """
        lock = cls(path, _kernel_lock(path))
        try:
            lock._claim()
        except BaseException:
            lock._release_kernel_lock()
            raise
        if lock._decides:
            lock._beating = threading.Thread(target=lock._beat, name="holdfast lease", daemon=True)
            lock._beating.start()
        return lock

    def check(self) -> None:
        """To be called before every write.

        Raises:
            StoreError: this process gave no sign of life for so long that another took the lease over.
        """
        if self._decides and _awake() - self._seen > STALE / 2:
            self._renew()
        if self._lost:
            raise StoreError(
                f"{self._path.parent} was taken over by {self._lost}, because this process gave no sign of "
                f"life for {STALE:.0f} s; it writes nothing more. Run again when the other has ended"
            )

    def close(self) -> None:
        """Let others have it."""
        self._ended.set()
        if self._beating is not None:
            self._beating.join()
            self._beating = None
        lease = _lease_of(self._path)
        found = _read(lease)
        if found is not None and found[0] is not None and found[0].token == self._holder.token:
            with suppress(OSError):
                lease.unlink()
        self._release_kernel_lock()

    def _release_kernel_lock(self) -> None:
        if self._handle is not None:
            os.close(self._handle)
            self._handle = None

    def _claim(self) -> None:
        lease = _lease_of(self._path)
        new = lease.with_name(f"{lease.name}.{self._holder.token}")
        try:
            new.write_text(json.dumps(asdict(self._holder)))
            while not _linked(new, lease):
                found = _read(lease)
                if found is not None and not self._taken_over(new, lease, *found):
                    continue
                if found is not None:
                    return
        except OSError as exc:
            if isinstance(exc, StoreError):
                raise
            raise _unwritable(self._path, exc) from exc
        finally:
            new.unlink(missing_ok=True)

    def _taken_over(self, new: Path, lease: Path, holder: Holder | None, touched: float) -> bool:
        """Whether the lease of one who is gone is ours now; one alone may try, named by what it replaces."""
        age = new.stat().st_mtime - touched  # by the clock of the file system
        locked = not self._decides
        gone = age > STALE or locked if holder is None else holder.is_gone(age=age, locked=locked)
        if not gone:
            raise _in_use(self._path, holder)
        mark = lease.with_name(f"{lease.name}.over.{holder.token if holder else 'unreadable'}")
        if not _linked(new, mark):
            with suppress(FileNotFoundError):
                if new.stat().st_mtime - mark.stat().st_mtime > STALE:
                    mark.unlink()  # its maker died at it
            raise _in_use(self._path, None)
        try:
            now = _read(lease)
            if now is not None and now[0] != holder:
                return False  # somebody was quicker
            os.replace(new, lease)
            return True
        finally:
            mark.unlink(missing_ok=True)

    def _beat(self) -> None:
        while not self._ended.wait(RENEW):
            with suppress(OSError):
                self._renew()

    def _renew(self) -> None:
        lease = _lease_of(self._path)
        found = _read(lease)
        holder = None if found is None else found[0]
        if holder is None or holder.token != self._holder.token:
            self._lost = "another holdfast" if holder is None else holder.sentence
            return
        os.utime(lease)
        self._seen = _awake()


def _lease_of(path: Path) -> Path:
    return path.with_name(f".{path.name}.lease")


def _kernel_lock(path: Path) -> int | None:
    """An exclusive lock beside the file, given up by the kernel when this process ends; None: it has none."""
    try:
        handle = os.open(path.with_name(f".{path.name}.lock"), os.O_RDWR | os.O_CREAT, 0o644)
    except OSError as exc:
        raise _unwritable(path, exc) from exc
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as exc:
        os.close(handle)
        if exc.errno in (errno.EWOULDBLOCK, errno.EAGAIN):
            raise _in_use(path, holder_of(path)) from None
        return None  # the file system has no such locks
    return handle


def _linked(new: Path, place: Path) -> bool:
    """Put a copy of `new` where nothing is; False when something is there."""
    try:
        os.link(new, place)
    except FileExistsError:
        return False
    except OSError:  # no links here
        try:
            with open(place, "xb") as file, open(new, "rb") as source:
                shutil.copyfileobj(source, file)
        except FileExistsError:
            return False
    return True


def _read(lease: Path) -> tuple[Holder | None, float] | None:
    """The holder (None when the lease cannot be understood) and the last sign of life; None without one."""
    try:
        touched = lease.stat().st_mtime
        return Holder(**json.loads(lease.read_text())), touched
    except FileNotFoundError:
        return None
    except (ValueError, TypeError):
        return None, touched


def _in_use(path: Path, holder: Holder | None) -> StoreError:
    who = "another holdfast" if holder is None else f"another holdfast: {holder.sentence}"
    cure = "wait for it or stop it"
    if holder is not None and not is_on_this_host(holder.owner) and not holder.renewed:
        cure += f"; if that machine does not run it any more, remove {_lease_of(path)}"
    return StoreError(f"{path.parent} is in use by {who}; {cure}")


def _unwritable(path: Path, exc: OSError) -> StoreError:
    return StoreError(f"cannot write in {path.parent}: {exc.strerror}. Choose another --folder")


def _awake() -> float:
    """Seconds on a clock that goes on while the machine sleeps."""
    clock: Callable[[], float] = time.monotonic
    if hasattr(time, "CLOCK_BOOTTIME"):
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return clock()
