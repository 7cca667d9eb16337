"""Writes of a campaign beside plain evaluation, killed before their k-th operation and done again.

    python kill_other_writes.py folder work what first last step

work: one of WORKS    what: "database" or "files", whose operations are counted (see `kill_driver.py`).

Prints a JSON document: how many kills there were, whether the work came to its end, and what was wrong. Every
campaign is opened in a fork of this process, which has loaded everything before.
"""

import json
import os
import shutil
import signal
import sqlite3
import sys
import traceback
from functools import partial
from pathlib import Path

from workbench.campaign import runs as runs_module
from workbench.campaign.permissions import Permissions
from workbench.campaign.rescue.merging import merged
from workbench.campaign.rescue.recovery import recovered
from workbench.histories.store import HistoryStore
from workbench.stages.campaign import Campaign
from workbench.stages.design import evaluate
from workbench.stages.run_all import run_stage
from workbench.study.loading import load_study

sys.path.insert(0, str(Path(__file__).parent))
from kill_driver import CountingConnection, acknowledging, kill_at_file_operation

STUDY = """
[study]
name = "s"
[model]
kind = "python"
function = "m.py:f"
[[parameter]]
name = "a"
lower = 0
upper = 1
[[parameter]]
name = "b"
lower = 0
upper = 1
[[response]]
name = "y"
{responses}
[design]
kind = "lhs"
runs = {runs}
[evaluate]
engine = "inline"
"""
CODE = """
def f(a, b):
    if int(1e6 * a) % 7 == 3:
        raise ValueError("some have no value")
    return {{"y": {factor} * a + b, "z": a - b, "h": ([0.0, 1.0, 2.0], [a, -b, a * b])}}
"""
HISTORY = '[[response]]\nname = "h"\nreduce = "{reduce}"\n'
RUNS, GROWN = 12, 18


def write(folder, *, runs=RUNS, reduce="max", more="", factor=3):
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "m.py").write_text(CODE.format(factor=factor))
    responses = HISTORY.format(reduce=reduce) + more
    (folder / "s.toml").write_text(STUDY.format(runs=runs, responses=responses))


def made(folder, **permissions):
    """The campaign of the study as it is there, with all runs of its design."""
    with Campaign.from_file(folder / "s.toml", permissions=Permissions(**permissions)) as campaign:
        run_stage(campaign, "design")
        evaluate(campaign)


def joined(folder):
    with Campaign.from_file(folder / "s.toml") as campaign:
        merged(campaign, folder / "other" / "s.holdfast")
        campaign.reread()


def prepare(folder, work):
    """A campaign with runs, and what has changed since."""
    write(folder)
    made(folder)
    if work == "growth":
        write(folder, runs=GROWN)
    elif work == "rereading":
        write(folder, reduce="min", more='[[response]]\nname = "z"\n')
    elif work == "new version":
        write(folder, factor=5)
    elif work == "merge":
        write(folder / "other", runs=RUNS + 3)
        made(folder / "other")
    elif work == "recovery":
        path = folder / "s.holdfast" / "runs.sqlite"
        content = bytearray(path.read_bytes())
        at = content.rindex(b'{"y": ') + 7  # a digit of an answer
        content[at] ^= 1
        path.write_bytes(content)


WORKS = {
    "growth": made,
    "rereading": made,
    "new version": lambda folder: made(folder, new_version=True),
    "merge": joined,
    "recovery": lambda folder: recovered(load_study(folder / "s.toml"), folder / "s.holdfast"),
}


def forked(task, log, kill_after=0, what="database"):
    """Do it in a process of its own, killed before an operation; how that ended, 0 when it was done."""
    child = os.fork()
    if child:
        return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    try:
        runs_module.supervise = acknowledging(log)
        if kill_after and what == "files":
            kill_at_file_operation(kill_after)
        elif kill_after:
            CountingConnection.left = kill_after
            connect = sqlite3.connect
            sqlite3.connect = lambda *a, **k: connect(*a, factory=CountingConnection, **k)
        task()
    except BaseException:
        traceback.print_exc()
        os._exit(1)
    os._exit(0)


def answers(folder):
    """Key -> status, inputs and outputs of every answered run; None when the database cannot be read."""
    db = sqlite3.connect(folder / "s.holdfast" / "runs.sqlite")
    try:
        query = (
            "SELECT key, status, inputs, outputs FROM evaluation WHERE status NOT IN ('queued', 'running')"
        )
        return {key: rest for key, *rest in db.execute(query)}
    except sqlite3.Error:
        return None
    finally:
        db.close()


def histories(folder):
    """Key -> values of the time history of every run."""
    with HistoryStore.reading(folder / "s.holdfast") as store:
        assert store.wrong() == []
        return {entry.key: store.history(entry).values.tolist() for entry in store.entries(name="h")}


def acknowledged(folder):
    path = folder / "acknowledged"
    return [line.split(" ", 2)[:2] for line in path.read_text().splitlines()] if path.exists() else []


def lost(folder, before, work):
    """What a kill took: answers of before, or acknowledged ones, that are not there any more."""
    now = answers(folder)
    if now is None:
        return [] if work == "recovery" else ["the database cannot be read"]
    found = [
        f"{key} had {then[0]}" for key, then in before.items() if key not in now or now[key][0] != then[0]
    ]
    if work == "recovery":
        found = []  # the damaged run is none; the end is compared
    return found + [f"{key} was acknowledged" for key, _ in acknowledged(folder) if key not in now]


def main(folder, work, what, first, last, step):
    folder = Path(folder)
    folder.mkdir(exist_ok=True)
    template, whole = folder / "template", folder / "whole"
    assert forked(partial(prepare, template, work), folder) == 0
    (folder / "acknowledged").unlink()  # of the preparation
    shutil.copytree(template, whole)
    assert forked(partial(WORKS[work], whole), whole) == 0
    wanted, wanted_histories, before = answers(whole), histories(whole), answers(template)
    other = (template / "other" / "s.holdfast" / "runs.sqlite") if work == "merge" else None
    wrong, kills, at_end = [], 0, False
    for k in range(first, last, step):
        place = folder / f"k{k}"
        shutil.copytree(template, place)
        code = forked(partial(WORKS[work], place), place, k, what)
        if code == 0:
            at_end = True
            break
        if code != -signal.SIGKILL:
            wrong.append(f"before {k}: ended with {code}")
            continue
        kills += 1
        wrong += [f"before {k}: {text}" for text in lost(place, before, work)]
        if forked(partial(WORKS[work], place), place) != 0:
            wrong.append(f"before {k}: it cannot be done again")
        elif (answers(place), histories(place)) != (wanted, wanted_histories):
            wrong.append(f"before {k}: done again it is another campaign")
        elif other is not None and (place / other.relative_to(template)).read_bytes() != other.read_bytes():
            wrong.append(f"before {k}: the other campaign changed")
        shutil.rmtree(place)
    runs = {"before": len(before), "after": len(wanted), "histories": len(wanted_histories)}
    changed = sum(wanted.get(key) != then for key, then in before.items())
    print(json.dumps({"kills": kills, "at_end": at_end, "wrong": wrong, "changed": changed, **runs}))


if __name__ == "__main__":
    main(*sys.argv[1:4], *map(int, sys.argv[4:]))
