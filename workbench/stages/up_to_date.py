"""Is the document of a stage still that of the study and its runs? Digests of what went into it.

They are kept in `stages.json` in the campaign's folder, one per stage. Of a study whose every stage is done,
`.settled.json` says in what state of study, store and files: as long as all are in it there is nothing to do,
and that is known without reading a run.
"""

import json
from collections.abc import Callable, Iterable, Mapping
from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from workbench.campaign.runs import CampaignRuns
from workbench.campaign.store import Store
from workbench.campaign.view import StoredRuns
from workbench.errors import HoldfastError
from workbench.models.stored.evaluation import UNFINISHED
from workbench.provenance.closure import digest_of_function
from workbench.stages.table import Stage
from workbench.study.record import Study
from workbench.system.atomic import read_json, write_json
from workbench.system.witness import has_log

__all__ = [
    "current_document",
    "fingerprint",
    "is_outdated",
    "record_fingerprint",
    "record_settled",
    "settled",
]

FINGERPRINTS = "stages.json"
SETTLED = ".settled.json"


def fingerprint(campaign: StoredRuns, table: Mapping[str, Any], inputs: Iterable[str]) -> str:
    """A digest of everything that a stage's document depends on.

    Args:
        table: of the stage in the study file.    inputs: what else decides the document, as text in pieces.
    """
    spec = campaign.spec
    if "responses" in table:
        table = {**table, "responses": list(table["responses"].items())}  # their order decides
    parts = [dict(table), campaign.study.seed, campaign.study.space.hash, spec.identity, spec.version]
    # the pieces are the last part, as one text that is never held
    digest = blake2b(f'{json.dumps(parts, sort_keys=True)[:-1]}, "'.encode(), digest_size=16)
    for piece in inputs:
        digest.update(json.dumps(piece)[1:-1].encode())
    digest.update(b'"]')
    return digest.hexdigest()


def current_document(
    campaign: StoredRuns, stage: Stage, digest: str, *, read: Callable[[Path], Any] = read_json
) -> dict[str, Any] | None:
    """The stored document of a stage, as `read` gives it, when its inputs had this digest; else None."""
    known = read_json(campaign.folder / FINGERPRINTS) or {}
    if known.get(stage.name) != digest:
        return None
    found = read(campaign.folder / f"{stage.document}.json")
    return None if found is None else dict(found)


def is_outdated(campaign: StoredRuns, stage: Stage, digest: Callable[[], str]) -> bool:
    """Whether the document of a stage was made of another study, or of other runs, than there are now; not
    where it is not there or nobody wrote down what it was made of."""
    known = (read_json(campaign.folder / FINGERPRINTS) or {}).get(stage.name)
    if known is None or not (campaign.folder / f"{stage.document}.json").exists():
        return False
    try:
        return bool(known != digest())
    except HoldfastError:  # what went into it is not there any more
        return True


def record_fingerprint(campaign: StoredRuns, stage: str, digest: str) -> None:
    """Remember from what a stage's document was made."""
    known = read_json(campaign.folder / FINGERPRINTS) or {}
    write_json(campaign.folder / FINGERPRINTS, {**known, stage: digest})


def settled(campaign: CampaignRuns) -> dict[str, Any] | None:
    """What `record_settled` was given when nothing has changed since, else None."""
    known = read_json(campaign.folder / SETTLED)
    if known is None or _store_state(campaign.store) != known["store"]:
        return None
    if _study_state(campaign) != known["study"] or _files(campaign.folder) != known["files"]:
        return None
    found: dict[str, Any] = known["found"]
    return found


def record_settled(campaign: CampaignRuns, found: Mapping[str, Any]) -> None:
    """Remember that every stage is done, and what they found; not while runs wait for an answer."""
    campaign.store.select("PRAGMA wal_checkpoint(TRUNCATE)")  # the log joins the file
    store = _store_state(campaign.store)
    if store is not None:
        files = _files(campaign.folder)
        known = {"store": store, "study": _study_state(campaign), "files": files, "found": dict(found)}
        write_json(campaign.folder / SETTLED, known)


def _store_state(store: Store) -> list[int] | None:
    """Size and time of the file, which every change changes; None while runs wait, or are in the log."""
    if any(store.counts().get(status) for status in UNFINISHED) or has_log(store.path):
        return None
    found = store.path.stat()
    return [found.st_size, found.st_mtime_ns]


def _layout_functions(study: Study) -> list[str]:
    """What makes the problems of layouts, which is no part of the study's model."""
    tables = ((study.layout, "problem"), (study.robust_layout, "model"))
    return [table[key] for table, key in tables if table is not None]


def _study_state(campaign: CampaignRuns) -> str:
    """A digest of what decides what stages make of the same runs: study, model's state, reading, version."""
    try:
        ours = version("holdfast")
    except PackageNotFoundError:
        ours = "unknown"
    store, lock = campaign.store, campaign.folder / "study.lock.json"
    written = lock.read_text() if lock.exists() else ""
    parts = [
        campaign.study.text,
        campaign.study.hash,
        campaign.spec.version,
        store.reading_now,
        store.state_now,
        *(
            digest_of_function(reference, campaign.study.folder)
            for reference in _layout_functions(campaign.study)
        ),
    ]
    return blake2b(json.dumps([*parts, ours, written]).encode(), digest_size=16).hexdigest()


def _files(folder: Path) -> dict[str, list[int]]:
    """Size and time of documents, exports and the report's files."""
    documents = [
        path for path in folder.glob("*.json") if path.name != "study.lock.json" and path.name[0] != "."
    ]
    exports = [
        *folder.glob("*.nc"),
        *folder.glob("*.csv"),
        *folder.glob("report.*"),
        *folder.glob("tables/*"),
    ]
    states = ((path, path.stat()) for path in sorted({*documents, *exports}))
    return {str(path.relative_to(folder)): [state.st_size, state.st_mtime_ns] for path, state in states}
