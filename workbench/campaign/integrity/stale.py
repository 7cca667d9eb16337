"""What a coordinator left that is gone: its rows return to the queue, what took two of them is set aside."""

import sqlite3
import time
from collections.abc import Sequence

from workbench.system.lease import is_alive

__all__ = ["POISON", "release_stale"]

POISON = 2  # starts of a run after which the coordinator was gone: it is not tried again


def release_stale(db: sqlite3.Connection, begun: Sequence[str]) -> None:
    """Within a transaction: queue rows whose owner is gone, count the starts of `begun`, set poison aside.

    Args:
        begun: keys of runs that were under way when the last coordinator went.
    """
    owners = [
        owner for (owner,) in db.execute("SELECT DISTINCT owner FROM evaluation WHERE status = 'running'")
    ]
    for owner in owners:
        if owner is None or not is_alive(owner):
            db.execute(
                "UPDATE evaluation SET status = 'queued', owner = NULL "
                "WHERE status = 'running' AND owner IS ?",
                (owner,),
            )
    if not begun:
        return
    db.executemany(
        "UPDATE evaluation SET unanswered = unanswered + 1, attempt = MAX(attempt, unanswered + 1) "
        "WHERE key = ? AND status = 'queued'",
        [(key,) for key in begun],
    )
    text = f"the coordinator ended {POISON} times while this run was under way; it is set aside"
    db.execute(
        "UPDATE evaluation SET status = 'killed', error = ?, finished = ? "
        "WHERE unanswered >= ? AND status = 'queued'",
        (text, time.time(), POISON),
    )
