"""A campaign's folder as the report sees it: the documents of its stages and the rows of `runs.sqlite`."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import StoreError, StudyError
from workbench.models.evaluation import COLUMNS, UNFINISHED, Evaluation, evaluation_of
from workbench.system.atomic import read_json
from workbench.system.database import explained, opened_for_reading
from workbench.system.one_writer import holder_of, moment

__all__ = ["CampaignFolder"]

KEY_SHOWN = 10  # characters of a key that tell runs of one campaign apart


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignFolder:
    """Documents by stage (None where a stage has not run) and all runs in the order asked for."""

    path: Path
    lock: Mapping[str, Any]
    documents: Mapping[str, Any]
    runs: tuple[Evaluation, ...]

    @classmethod
    def opened(cls, path: Path, *, documents: Sequence[str]) -> "CampaignFolder":
        """Read a folder: the `documents` of these names, without ".json", and the runs.

        Raises:
            StudyError: it is not a campaign's folder.
            StoreError: a document or the database cannot be read.
        """
        found = {name: _document(path / f"{name}.json") for name in documents}
        lock = _document(path / "study.lock.json")
        database = path / "runs.sqlite"
        if lock is None and not any(found.values()) and not database.exists():
            raise StudyError(
                f"{path} is not the folder of a campaign: it has neither study.lock.json nor runs.sqlite nor "
                "a stage's document. Give the folder that `holdfast run` printed"
            )
        return cls(
            path=path,
            lock=lock or {},
            documents=found,
            runs=_runs(database) if database.exists() else (),
        )

    def __getitem__(self, name: str) -> Mapping[str, Any] | None:
        found: Mapping[str, Any] | None = self.documents[name]
        return found

    @property
    def name(self) -> str:
        """The study's name."""
        resolved = self.lock.get("resolved", {})
        return str(resolved.get("study", {}).get("name") or self.path.name.removesuffix(".holdfast"))

    @property
    def parameters(self) -> dict[str, Mapping[str, Any]]:
        """Parameters by name: unit, kind, bounds, label."""
        design = self["design"] or {}
        space = design.get("space", {}).get("parameters")
        given = space or design.get("parameters") or self.lock.get("resolved", {}).get("parameter", [])
        return {str(p["name"]): p for p in given}

    def unit_of(self, parameter: str) -> str:
        """The unit of a parameter, "1" when unknown."""
        return str(self.parameters.get(parameter, {}).get("unit") or "1")

    @property
    def responses(self) -> dict[str, str]:
        """Units of the responses by name."""
        given = self.lock.get("resolved", {}).get("response", [])
        found = {str(r["name"]): str(r.get("unit") or "1") for r in given}
        for name in ("screening", "worst_case"):
            document = self[name]
            if document is not None and not document.get("weights"):
                found.setdefault(str(document["response"]), str(document.get("unit") or "1"))
        return found

    @property
    def main_response(self) -> str | None:
        """The response that the study is about."""
        for name in ("worst_case", "screening"):
            document = self[name]
            if document is not None and not document.get("weights"):  # a sum is no response
                return str(document["response"])
        return next(iter(self.responses), None)

    @property
    def finished(self) -> tuple[Evaluation, ...]:
        """Runs that have an answer, good or bad."""
        return tuple(run for run in self.runs if run.status not in UNFINISHED)

    @property
    def running(self) -> str:
        """That somebody works on the campaign now, and as of when the page is; empty when nobody does."""
        holder = holder_of(self.path / "runs.sqlite")
        if holder is None or holder.is_this_process:
            return ""
        last = max((run.finished for run in self.finished if run.finished is not None), default=None)
        when = "" if last is None else f", the last of {moment(last)}"
        return (
            f"The campaign is running ({holder.sentence}): {len(self.finished)} of {len(self.runs)} runs "
            f"have their answer{when}. What stands here may change with the answers that are to come."
        )

    @property
    def counts(self) -> dict[str, int]:
        """Runs by status."""
        return dict(sorted(Counter(run.status for run in self.runs).items()))

    def run_name(self, key: str | None) -> str:
        """A run as a person refers to it: its number and the beginning of its key."""
        if not key:
            return "–"
        number = next((run.id for run in self.runs if run.key == key), None)
        return f"run {key[:KEY_SHOWN]}" if number is None else f"run {number} ({key[:KEY_SHOWN]})"


def _document(path: Path) -> Any:
    found = read_json(path)
    if found is not None and not isinstance(found, dict):
        raise StoreError(
            f"{path} holds {type(found).__name__}, not a document. Remove it to have it made anew"
        )
    return found


def _runs(database: Path) -> tuple[Evaluation, ...]:
    connection, _ = opened_for_reading(database)
    try:
        with explained(database):
            held = [name for _, name, *_ in connection.execute("PRAGMA table_info(evaluation)")]
            sound = "1"
            if held and held[-1] == "checksum":
                sound = f"row_checksum('evaluation', {', '.join(held[:-1])}) IS checksum"
            query = f"SELECT {sound}, {', '.join(COLUMNS)} FROM evaluation ORDER BY id"
            rows = connection.execute(query).fetchall()
    finally:
        connection.close()
    wrong = [cells[0] for sound, *cells in rows if not sound]
    if wrong:
        raise StoreError(
            f"{database} is damaged: {len(wrong)} runs, the first run {wrong[0]}, are not as they were "
            "stored. `holdfast recover` saves what can be read"
        )
    return tuple(evaluation_of((*cells, None)) for _, *cells in rows)
