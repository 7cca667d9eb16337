"""Campaigns' stores damaged on purpose: bits turned over, pages zeroed, files cut short, logs removed."""

import shutil
import sqlite3

from workbench.campaign.store import Store
from workbench.models.protocol import Answer
from workbench.stages.campaign import Campaign
from workbench.stages.run_all import run_stage
from workbench.system.atomic import read_json

STUDY = """
[study]
name = "s"
[model]
kind = "ask"
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
[design]
kind = "sobol"
runs = {runs}
"""
KINDS = ("bit", "bits", "page", "pages", "cut", "log removed", "bit in the log", "page in the log", "log cut")
OF_A_LOG = KINDS[5:]
PAGE = 4096


def value(a, b):
    return a / 3 + b * b


def closed_campaign(folder, *, runs):
    """A study and its campaign, closed."""
    folder.mkdir(exist_ok=True)
    (folder / "s.toml").write_text(STUDY.format(runs=runs))
    with Campaign.from_file(folder / "s.toml") as campaign:
        for a, b in run_stage(campaign, "design")["physical"]:
            campaign.tell(None, value(a, b), parameters={"a": a, "b": b})
    return folder


def killed_campaign(folder, source, *, answered):
    """The same with its last answers in the log, as a coordinator that was killed leaves them."""
    shutil.copytree(source, folder)
    live = folder / "s.holdfast"
    with OpenStore(live) as store:
        keys = read_json(live / "design.json")["run_keys"][:answered]
        store.write("UPDATE evaluation SET status = 'queued', outputs = NULL WHERE key IN "
                    f"({', '.join('?' * len(keys))})", keys)  # fmt: skip
        for row in store.rows(keys=keys):
            answer = Answer(status="ok", outputs={"y": value(row.inputs["a"], row.inputs["b"])})
            store.finish(row.key, answer, attempt=2)
        kept = folder / "kept"
        kept.mkdir()
        names = ("runs.sqlite", "runs.sqlite-wal", ".runs.sqlite.witness")
        for name in names:
            shutil.copy(live / name, kept / name)
    for name in names:
        shutil.move(kept / name, live / name)
    (live / "runs.sqlite-shm").unlink(missing_ok=True)
    return folder


class OpenStore:
    """The store of a campaign's folder, open in a `with` statement."""

    def __init__(self, folder):
        self._folder = folder

    def __enter__(self):
        self._store = Store.opened(self._folder / "runs.sqlite")
        return self._store

    def __exit__(self, *exc):
        self._store.close()


def damage(folder, kind, rng):
    """Damage the store of a campaign; what was done."""
    path = folder / "s.holdfast" / "runs.sqlite"
    log = path.with_name("runs.sqlite-wal")
    if kind == "log removed":
        log.unlink()
        return kind
    target = log if "log" in kind else path
    data = bytearray(target.read_bytes())
    if kind.startswith("bit"):
        for _ in range(40 if kind == "bits" else 1):
            data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)
    elif kind.startswith("page"):
        for _ in range(3 if kind == "pages" else 1):
            at = rng.randrange(len(data) // PAGE) * PAGE
            data[at : at + PAGE] = bytes(len(data[at : at + PAGE]))
    else:
        del data[rng.randrange(1, len(data)) :]
    target.write_bytes(bytes(data))
    return kind


def truth(folder):
    """Key -> value of every answer of the sound campaign."""
    with Campaign.from_file(folder / "s.toml") as campaign:
        return {row.key: row.outputs["y"] for row in campaign.runs() if row.status == "ok"}


def stored_bytes(folder):
    """Key -> the bytes of its row, from its length to its checksum, as they lie in the file or its log."""
    path = folder / "s.holdfast" / "runs.sqlite"
    db = sqlite3.connect(f"{path.as_uri()}?mode=ro", uri=True)
    rows = db.execute("SELECT key, status, checksum FROM evaluation WHERE status = 'ok'").fetchall()
    db.close()
    text = content(folder)
    found = {}
    for key, status, checksum in rows:
        end = text.index(checksum) + len(checksum)
        begin = text.rindex((key + status).encode(), 0, end)
        head = next(
            n for n in range(20, 50) if text[begin - n] == n
        )  # a record begins with its head's length
        found[key] = text[begin - head - 3 : end]
    return found


def content(folder):
    path = folder / "s.holdfast" / "runs.sqlite"
    log = path.with_name("runs.sqlite-wal")
    return b"".join(file.read_bytes() for file in (path, log) if file.exists())


def readable(folder, rows):
    """Keys of answers whose row stands in the file or its log as it was laid down."""
    text = content(folder)
    return {key for key, row in rows.items() if row in text}
