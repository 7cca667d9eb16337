"""The answers of another campaign joined to this one: the same model in the same state, so runs are runs.

A run that has an answer here keeps it. Where the other campaign has another answer to the same run, that is
counted and kept as an attempt: one of the two is not what the model gives.
"""

import json
import shutil
import sqlite3
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from workbench.campaign.integrity.checksums import CHECKED
from workbench.campaign.rescue.examination import examined
from workbench.campaign.runs import CampaignRuns
from workbench.errors import StoreError, StudyError
from workbench.histories.stored import copy_histories
from workbench.models.stored.evaluation import UNFINISHED
from workbench.space.units import counted
from workbench.system.database import explained, opened_for_reading

__all__ = ["Merging", "merged", "merging_lines"]

KEPT = "kept"  # files that runs left


@dataclass(frozen=True, slots=True, kw_only=True)
class Merging:
    """How many answers joined, were here already with the same values, differ, or are of another model."""

    joined: int
    same: int
    different: int
    other_model: int

    def to_dict(self) -> dict[str, int]:
        """For JSON."""
        return asdict(self)


def merged(campaign: CampaignRuns, other: Path) -> Merging:
    """Take the answers of the campaign in the folder `other` over, with their files; it is left as it is.

    Raises:
        StudyError: its runs were made by another model or another state of it, it is this campaign, or it
            is none.
        StoreError: its database is damaged or of another schema.
    """
    if not other.is_dir() or not any(other.glob("*runs.sqlite*")):
        found = "is no folder" if not other.is_dir() else "holds no campaign: it has no runs.sqlite"
        raise StudyError(f"{other} {found}. Give the folder of the other campaign, such as b.holdfast")
    path = other / "runs.sqlite"
    if path.resolve() == campaign.store.path.resolve():
        raise StudyError(f"{other} is this campaign itself; name the folder of another")
    state = examined(path)
    if not all(check.ok for check in state.checks if check.name != "file"):
        wrong = next(check.text for check in state.checks if not check.ok and check.name != "file")
        raise StoreError(f"{path} is not sound, nothing was joined: {wrong}")
    db, _ = opened_for_reading(path)
    try:
        with explained(path):
            db.row_factory = sqlite3.Row
            tables = {
                table: [dict(row) for row in db.execute(f"SELECT {', '.join(columns)} FROM {table}")]
                for table, columns in CHECKED.items()
                if table != "meta"
            }
    except StoreError as exc:
        raise StoreError(f"{exc} (`holdfast run` brings an older campaign up to this version)") from exc
    finally:
        db.close()
    rows = [row for row in tables["evaluation"] if row["status"] not in UNFINISHED]
    fitting = [
        row
        for row in rows
        if (row["model"], row["version"]) == (campaign.spec.identity, campaign.spec.version)
    ]
    if rows and not fitting:
        raise StudyError(
            f"no run in {other} is of this study's model: other parameters of the model, another version, "
            "function or decks. Only runs of the same model can be joined"
        )
    states = _states(campaign, {row["id"]: row for row in tables["model_state"]}, fitting, other)
    return _joined(campaign, tables, fitting, states, other, other_model=len(rows) - len(fitting))


def merging_lines(found: Merging, other: Path) -> list[str]:
    """What came of it, for a person."""
    known = f"{found.same} {'was' if found.same == 1 else 'were'} known with the same values"
    lines = [f"{counted(found.joined, 'answer')} of {other} joined; {known}"]
    if found.different:
        runs = counted(found.different, "run has", "runs have")
        lines.append(f"{runs} another answer there; this campaign's stays, theirs is an attempt")
    if found.other_model:
        runs = counted(
            found.other_model, "run of another model or version was", "runs of another model or version were"
        )
        lines.append(f"{runs} left out")
    return lines


def _states(
    campaign: CampaignRuns, theirs: dict[int, dict[str, Any]], rows: list[dict[str, Any]], other: Path
) -> dict[int, int]:
    """Numbers of their states of the model -> numbers here, where all are the present one's.

    Raises:
        StudyError: runs were made by another state.
    """
    ours = campaign.store.select("SELECT digest, content, id FROM model_state ORDER BY id")
    now = next((digest for digest, _, id_ in ours if id_ == campaign.store.state_now), None)
    used = {row["state"] for row in rows if row["state"] is not None}
    foreign = [row for row in rows if row["state"] is not None and theirs[row["state"]]["digest"] != now]
    if foreign and now is not None:
        runs = counted(len(foreign), f"run in {other} was", f"runs in {other} were")
        raise StudyError(
            f"{runs} made by another state of the model; nothing was joined. "
            "Run both campaigns with the same code, data and programs; `holdfast doctor --model` lists them"
        )
    found = {}
    for number in used:
        state = theirs[number]
        same = [
            id_ for digest, content, id_ in ours if (digest, content) == (state["digest"], state["content"])
        ]
        if not same:
            values = [state[c] for c in ("digest", "content", "seen")]
            campaign.store.write(
                "INSERT INTO model_state (digest, same_as, content, seen) VALUES (?, NULL, ?, ?)", values
            )
            same = [campaign.store.select("SELECT MAX(id) FROM model_state")[0][0]]
        found[number] = same[0]
    return found


def _joined(
    campaign: CampaignRuns,
    tables: dict[str, list[dict[str, Any]]],
    rows: list[dict[str, Any]],
    states: dict[int, int],
    other: Path,
    *,
    other_model: int,
) -> Merging:
    store = campaign.store
    slopes = {row["key"]: row["slopes"] for row in tables["gradient"]}
    definitions = {row["id"]: row["definition"] for row in tables["reading"]}
    here = {
        key: (status, outputs)
        for key, status, outputs in store.select("SELECT key, status, outputs FROM evaluation")
    }
    columns = [c for c in CHECKED["evaluation"] if c not in ("id", "owner", "former", "unanswered")]
    joined, same, different = [], 0, 0
    with store.transaction():
        for row in rows:
            status, outputs = here.get(row["key"], ("queued", None))
            if status not in UNFINISHED:
                alike = (status, outputs and json.loads(outputs)) == (
                    row["status"],
                    row["outputs"] and json.loads(row["outputs"]),
                )
                same += alike
                different += not alike
                if not alike:
                    _keep_as_attempt(store, row)
                continue
            row = {
                **row,
                "reading": _reading(store, definitions.get(row["reading"])),
                "state": states.get(row["state"]),
            }
            if row["key"] in here:
                sets = ", ".join(f"{c} = ?" for c in columns if c != "key")
                values = [row[c] for c in columns if c != "key"]
                store.write(
                    f"UPDATE evaluation SET {sets}, owner = NULL WHERE key = ?", [*values, row["key"]]
                )
            else:
                marks = ", ".join("?" * len(columns))
                store.write(
                    f"INSERT INTO evaluation ({', '.join(columns)}) VALUES ({marks})",
                    [row[c] for c in columns],
                )
            if row["key"] in slopes:
                store.write(
                    "INSERT OR REPLACE INTO gradient (key, slopes) VALUES (?, ?)",
                    [row["key"], slopes[row["key"]]],
                )
            joined.append(row["key"])
        _copy_files(joined, other, campaign.folder)
    return Merging(joined=len(joined), same=same, different=different, other_model=other_model)


def _keep_as_attempt(store: Any, row: dict[str, Any]) -> None:
    """The other campaign's answer beside ours; once, however often it is joined."""
    known = store.select(
        "SELECT 1 FROM attempt WHERE key = ? AND reason = 'merged' AND finished IS ?",
        [row["key"], row["finished"]],
    )
    if not known:
        columns = ("key", "attempt", "status", "outputs", "error", "log", "finished", "wall", "cpu", "host")
        store.write(
            f"INSERT INTO attempt (reason, {', '.join(columns)}) "
            f"VALUES ('merged', {', '.join('?' * len(columns))})",
            [row[c] for c in columns],
        )


def _reading(store: Any, definition: str | None) -> int | None:
    if definition is None:
        return None
    if not store.select("SELECT 1 FROM reading WHERE definition = ?", [definition]):
        store.write("INSERT INTO reading (definition) VALUES (?)", [definition])
    found: int = store.select("SELECT id FROM reading WHERE definition = ?", [definition])[0][0]
    return found


def _copy_files(keys: list[str], source: Path, target: Path) -> None:
    """What the runs left; before the commit, so that no run is without its files."""
    copy_histories(source, target, [(key, key) for key in keys])
    for key in keys:
        file = source / KEPT / f"{key}.zip"
        if file.exists():
            (target / KEPT).mkdir(exist_ok=True)
            shutil.copyfile(file, target / KEPT / file.name)
