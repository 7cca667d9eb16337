"""One stored run with everything that is known of it, for `holdfast show`."""

from typing import Any

from workbench.campaign.view import CampaignView
from workbench.errors import StudyError
from workbench.histories.stored import StoredHistories
from workbench.system.one_writer import moment

__all__ = ["run_document", "run_lines"]

KEPT = (("kept", ".zip"), ("work", ""))  # places of what a run left, by its key


def run_document(view: CampaignView, name: str) -> dict[str, Any]:
    """The run of a number or of the beginning of a key: values, states, attempts, files.

    Raises:
        StudyError: no run, or several, go by that name.
    """
    by_number = name.isdecimal() and len(name) < 10
    where, value = ("id = ?", int(name)) if by_number else ("key LIKE ?", f"{name}%")
    found = view.store.select(f"SELECT key FROM evaluation WHERE {where} LIMIT 2", [value])
    if len(found) != 1:
        how = "several runs begin" if found else "no run goes"
        raise StudyError(
            f"{how} by {name!r} in {view.folder.name}; give the number of a run, or more of its key, as "
            "`holdfast export` and `holdfast failures` name them"
        )
    key = found[0][0]
    (row,) = view.store.rows(keys=[key])
    places = [view.folder / place / f"{key}{suffix}" for place, suffix in KEPT]
    return {
        "id": row.id,
        "key": key,
        "status": row.status,
        "attempt": row.attempt,
        "batch": row.batch,
        "parameters": dict(row.inputs),
        "responses": dict(row.outputs),
        "histories": _histories_of(view, key),
        "error": row.error,
        "log": row.log,
        "started": None if row.started is None else moment(row.started),
        "finished": None if row.finished is None else moment(row.finished),
        "wall": row.wall,
        "cpu": row.cpu,
        "host": row.host,
        "model_state": _state_of(view, key),
        "attempts": [
            {"attempt": n, "status": status, "reason": reason, "error": error}
            for n, status, reason, error in view.store.attempts(key)
        ],
        "files": [str(path) for path in places if path.exists()],
        "as_of": {**view.as_of.to_dict(), "sentence": view.as_of.sentence},
    }


def run_lines(document: dict[str, Any]) -> list[str]:
    """The run for a person."""
    lines = [f"run {document['id']} ({document['key']}): {document['status']}, {document['batch']}"]
    for name in ("parameters", "responses"):
        lines += [f"  {k} = {v!r}" for k, v in document[name].items()]
    lines += [
        f"  {name} [{h['unit']}]: {h['samples']} samples from {h['from']:g} to {h['to']:g}"
        for name, h in document["histories"].items()
    ]
    if document["error"]:
        lines += [f"  {line}" for line in document["error"].splitlines()]
    if document["finished"] is not None:
        wall = "" if document["wall"] is None else f" after {document['wall']:.3g} s"
        host = f" on {document['host']}" if document["host"] else ""
        lines.append(f"attempt {document['attempt']}, finished {document['finished']}{wall}{host}")
    if document["model_state"]:
        lines.append(f"made by the model in state {document['model_state'][:10]}")
    lines += [
        f"attempt {a['attempt']} {a['status']} ({a['reason']})" + (f": {a['error']}" if a["error"] else "")
        for a in document["attempts"]
    ]
    return [*lines, *document["files"], *document["log"].splitlines()]


def _histories_of(view: CampaignView, key: str) -> dict[str, dict[str, Any]]:
    """What is stored of the time histories of a run, by name."""
    with StoredHistories(view.folder) as stored:
        return {
            name: {
                "unit": unit,
                "samples": len(history.time),
                "from": float(history.time[0]),
                "to": float(history.time[-1]),
            }
            for name, (history, unit) in stored.of(key).items()
            if len(history.time)
        }


def _state_of(view: CampaignView, key: str) -> str:
    """The digest of the state of the model that made a run; empty when nobody wrote it down."""
    if not view.store.select("SELECT 1 FROM sqlite_master WHERE name = 'model_state'"):
        return ""
    found = view.store.select(
        "SELECT digest FROM evaluation AS e JOIN model_state AS s ON s.id = e.state WHERE e.key = ?", [key]
    )
    return str(found[0][0]) if found else ""
