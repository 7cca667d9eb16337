"""Coordinators to be killed: each evaluates `count` rows in `folder` and acknowledges what the store has.

    python kill_driver.py

reads the arguments of `main` from standard input, a JSON list a line, and makes each a fork of this process,
which has loaded everything before: an interpreter of its own would be most of the work. It says the number
of the fork. "poll" and "wait" instead of a list say how the last one ended, null while it is at work; until
then its number is not given to another process.

engine: inline, processes, or histories (inline, a model whose answers are histories).

Every acknowledged row is appended to `folder/acknowledged` in one write, after its commit.
"""

import json
import os
import signal
import sqlite3
import sys
import time
import traceback
from pathlib import Path

import workbench.study.schema  # noqa: F401  (a study file loads it late)
from workbench.campaign import store as store_module
from workbench.campaign import supervisor
from workbench.space.box import Parameter, Space
from workbench.stages.campaign import Campaign

SPACE = Space([Parameter("a", lower=0, upper=1), Parameter("b", lower=0, upper=1)])


def model(a, b):
    time.sleep(0.004)
    if int(1e6 * a) % 10 == 3:
        raise ValueError("one in ten has no value")
    return a / 3 + b * b


def history_model(a, b):
    time.sleep(0.001)
    return {"y": ([k / 600 for k in range(600)], [a * k + b * k * k for k in range(600)])}


def rows(count):
    return [{"a": (0.618033988749895 * k) % 1, "b": (0.754877666246693 * k) % 1} for k in range(1, count + 1)]


class CountingConnection(sqlite3.Connection):
    """Kills this process before its k-th statement."""

    left = -1

    def _count(self):
        CountingConnection.left -= 1
        if CountingConnection.left == 0:
            os.kill(os.getpid(), signal.SIGKILL)

    def execute(self, *arguments):
        self._count()
        return super().execute(*arguments)

    def executemany(self, *arguments):
        self._count()
        return super().executemany(*arguments)

    def executescript(self, *arguments):
        self._count()
        return super().executescript(*arguments)


def kill_at_file_operation(left):
    """Kill this process before the `left`-th operation on a file: lease, witness, starts, documents."""

    def counted(plain):
        def operation(*arguments, **options):
            nonlocal left
            left -= 1
            if left == 0:
                os.kill(os.getpid(), signal.SIGKILL)
            return plain(*arguments, **options)

        return operation

    for name in ("write", "pwrite", "link", "replace", "unlink", "ftruncate", "fsync"):
        setattr(os, name, counted(getattr(os, name)))


def acknowledging(folder):
    """`supervise` with a watcher that writes down what was committed."""
    plain = supervisor.supervise

    def supervise(*arguments, watcher=None, **options):
        log = os.open(folder / "acknowledged", os.O_WRONLY | os.O_CREAT | os.O_APPEND)

        def watch(done):
            text = "".join(f"{r.key} {r.status} {r.finished!r} {dict(r.outputs)!r}\n" for r in done)
            os.write(log, text.encode())
            watcher(done)

        plain(*arguments, watcher=watch, **options)

    return supervise


def main(folder, count, engine, kill_after=0, what="database"):
    """Evaluate; killed before the `kill_after`-th operation on the "database" or on "files", never when 0."""
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    if kill_after and what == "files":
        kill_at_file_operation(kill_after)
    elif kill_after:
        CountingConnection.left = kill_after
        connect = sqlite3.connect
        store_module.sqlite3.connect = lambda *a, **k: connect(*a, factory=CountingConnection, **k)
    from workbench.campaign import runs

    runs.supervise = acknowledging(folder)
    if engine == "inline":
        campaign = Campaign.of(model, SPACE, folder=folder)
    else:
        study = folder / "s.toml"
        place, function = Path(__file__).parent, "history_model" if engine == "histories" else "model"
        study.write_text(
            f'[study]\nname = "s"\n[model]\nkind = "python"\nfunction = "{place}/kill_driver.py:{function}"\n'
            '[[parameter]]\nname = "a"\nlower = 0\nupper = 1\n'
            '[[parameter]]\nname = "b"\nlower = 0\nupper = 1\n'
            + (
                '[[response]]\nname = "y"\nreduce = "max"\n[evaluate]\nengine = "inline"\n'
                if engine == "histories"
                else '[[response]]\nname = "y"\n[evaluate]\nworkers = 2\n'
            )
        )
        campaign = Campaign.from_file(study, folder=folder)
    with campaign:
        campaign.evaluate(rows(count))


def forked(arguments):
    """The number of a new process that does `main`."""
    child = os.fork()
    if child:
        return child
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(2, 1)  # what it prints is no answer of ours
        main(*arguments)
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    os._exit(0)


def serve():
    child = 0
    for line in sys.stdin:
        asked = json.loads(line)
        if isinstance(asked, list):
            said = child = forked(asked)
        else:
            ended, status = os.waitpid(child, 0 if asked == "wait" else os.WNOHANG)
            said = os.waitstatus_to_exitcode(status) if ended else None
        print(json.dumps(said), flush=True)


if __name__ == "__main__":
    serve()
