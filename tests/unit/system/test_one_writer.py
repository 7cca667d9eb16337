"""The lease of a writer: taken by one, named, renewed, taken over when its holder is gone, never before."""

import errno
import fcntl
import json
import os
import subprocess
import sys
import threading
import time
from dataclasses import asdict

import pytest

from workbench.errors import StoreError
from workbench.system import one_writer
from workbench.system.lease import owner_of_this_process
from workbench.system.one_writer import STALE, Holder, WriterLock, holder_of, moment


@pytest.fixture
def path(tmp_path):
    return tmp_path / "runs.sqlite"


@pytest.fixture
def without_flock(monkeypatch):
    """A file system whose kernel knows no locks."""

    def fails(handle, how):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", fails)


def lease_of(path):
    return path.with_name(f".{path.name}.lease")


def leave(path, *, owner, renewed=True, age=0.0, token="theirs"):
    """A lease as somebody else has left it."""
    holder = Holder(owner=owner, since=0.0, token=token, renewed=renewed)
    lease_of(path).write_text(json.dumps(asdict(holder)))
    then = time.time() - age
    os.utime(lease_of(path), (then, then))


ELSEWHERE = "otherhost|boot|1|1"
GONE = owner_of_this_process().rpartition("|")[0] + "|0"  # this process id, begun at another time


def test_a_lease_names_its_holder_and_goes_with_it(path):
    lock = WriterLock.taken(path)
    holder = holder_of(path)
    assert holder.is_this_process
    assert f"process {os.getpid()} on " in holder.sentence
    assert holder.sentence.endswith(f"since {moment(holder.since)}")
    with pytest.raises(StoreError, match=rf"in use by another holdfast: process {os.getpid()} on .* since"):
        WriterLock.taken(path)
    lock.close()
    assert holder_of(path) is None
    assert [p.name for p in path.parent.iterdir()] == [".runs.sqlite.lock"]
    WriterLock.taken(path).close()


def test_without_locks_of_the_kernel_the_lease_decides(path, without_flock):
    lock = WriterLock.taken(path)
    assert holder_of(path).renewed
    with pytest.raises(StoreError, match=rf"in use by another holdfast: process {os.getpid()} on "):
        WriterLock.taken(path)
    lock.check()
    lock.close()
    WriterLock.taken(path).close()
    assert threading.active_count() == 1


@pytest.mark.parametrize("links", [True, False])
def test_one_alone_takes_over_from_the_dead(path, without_flock, monkeypatch, links):
    if not links:
        monkeypatch.setattr(os, "link", lambda *a: (_ for _ in ()).throw(PermissionError(1, "no links")))
    leave(path, owner=GONE)
    assert holder_of(path) is None
    locks, refused = [], []
    begin = threading.Barrier(8)

    def take():
        begin.wait()
        try:
            locks.append(WriterLock.taken(path))
        except StoreError as exc:
            refused.append(str(exc))

    threads = [threading.Thread(target=take) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert (len(locks), len(refused)) == (1, 7)
    assert all("in use by another holdfast" in text for text in refused)
    locks[0].close()
    assert not list(path.parent.glob(".runs.sqlite.lease*")), "no marks are left"


def test_another_machine_is_believed_while_it_gives_signs_of_life(path, without_flock):
    leave(path, owner=ELSEWHERE, age=STALE / 2)
    with pytest.raises(
        StoreError, match=r"process 1 on otherhost since 1970-01-01 00:00:00 UTC; wait for it"
    ):
        WriterLock.taken(path)
    leave(path, owner=ELSEWHERE, age=STALE + 5)
    assert holder_of(path) is None
    WriterLock.taken(path).close()


def test_a_lease_without_signs_of_life_is_the_kernels_matter(path, monkeypatch):
    leave(path, owner=ELSEWHERE, renewed=False, age=1e6)
    lock = WriterLock.taken(path)  # a lock of the kernel binds all who see a local disk
    lock.close()
    leave(path, owner=ELSEWHERE, renewed=False, age=1e6)
    monkeypatch.setattr(one_writer, "file_system", lambda folder: "nfs4")
    with pytest.raises(StoreError, match=r"if that machine does not run it any more, remove .*lease"):
        WriterLock.taken(path)


def test_a_torn_lease_is_taken_over_when_it_is_old(path, without_flock):
    lease_of(path).write_text('{"owner": "oth')
    with pytest.raises(StoreError, match="in use by another holdfast; wait"):
        WriterLock.taken(path)
    then = time.time() - STALE - 5
    os.utime(lease_of(path), (then, then))
    WriterLock.taken(path).close()


def test_a_mark_left_by_one_that_died_at_taking_over_does_not_stay(path, without_flock):
    leave(path, owner=GONE)
    mark = lease_of(path).with_name(f"{lease_of(path).name}.over.theirs")
    mark.write_text("")
    with pytest.raises(StoreError, match="in use by another holdfast"):
        WriterLock.taken(path)
    then = time.time() - STALE - 5
    os.utime(mark, (then, then))
    with pytest.raises(StoreError, match="in use"):
        WriterLock.taken(path)
    WriterLock.taken(path).close()


def test_whoever_lost_the_lease_writes_nothing_more(path, without_flock, monkeypatch):
    lock = WriterLock.taken(path)
    leave(path, owner=ELSEWHERE)  # after a long sleep of this machine
    lock.check()  # it gave a sign of life just now
    monkeypatch.setattr(one_writer, "_awake", lambda: lock._seen + STALE)
    with pytest.raises(StoreError, match=r"taken over by process 1 on otherhost .* writes nothing more"):
        lock.check()
    lock.close()
    assert lease_of(path).exists(), "it is not ours to remove"


def test_signs_of_life_are_given(path, without_flock, monkeypatch):
    monkeypatch.setattr(one_writer, "RENEW", 0.01)
    lock = WriterLock.taken(path)
    os.utime(lease_of(path), (0, 0))
    until = time.monotonic() + 5
    while lease_of(path).stat().st_mtime == 0 and time.monotonic() < until:
        time.sleep(0.01)
    assert lease_of(path).stat().st_mtime > 0
    lock.close()


def test_a_folder_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(StoreError, match=r"cannot write in .*nowhere: No such file or directory"):
        WriterLock.taken(tmp_path / "nowhere" / "runs.sqlite")


DRIVER = """
import errno, fcntl, sys, time
from pathlib import Path
from workbench.system.one_writer import WriterLock
def fails(handle, how):
    raise OSError(errno.ENOLCK, "no locks")
fcntl.flock = fails
WriterLock.taken(Path(sys.argv[1]))
print("taken", flush=True)
time.sleep(60)
"""


def test_a_killed_holder_is_followed_at_once(path, without_flock):
    for _ in range(3):
        process = subprocess.Popen(
            [sys.executable, "-c", DRIVER, str(path)], stdout=subprocess.PIPE, text=True, cwd=os.getcwd()
        )
        assert process.stdout.readline() == "taken\n"
        with pytest.raises(StoreError, match=f"process {process.pid} on "):
            WriterLock.taken(path)
        process.kill()
        process.wait()
        process.stdout.close()
    WriterLock.taken(path).close()
