"""A campaign's folder as the report sees it: the documents of its stages and the rows of `runs.sqlite`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workbench.errors import StoreError, StudyError
from workbench.models.stored.run_chunks import run_chunks
from workbench.report.page.run_list import RunList
from workbench.sampling.stored import design_head
from workbench.space.box import Parameter
from workbench.system.atomic import read_json
from workbench.system.database import explained, opened_for_reading
from workbench.system.one_writer import holder_of, moment

__all__ = ["CampaignFolder"]

DESIGN = "design.json"
KEY_SHOWN = 10  # characters of a key that tell runs of one campaign apart


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignFolder:
    """Documents by stage (None where a stage has not run) and runs in the order asked for.

    runs: of the present model, in its version, with the present parameters.    n_others: how many more are
    stored, of other models, versions or parameters.
    """

    path: Path
    lock: Mapping[str, Any]
    documents: Mapping[str, Any]
    runs: RunList
    n_others: int = 0

    @classmethod
    def opened(cls, path: Path, *, documents: Sequence[str], runs: RunList | None = None) -> "CampaignFolder":
        """Read a folder: the `documents` of these names, without ".json", and the runs.

        `runs`: as somebody has read them just now; they are read again unless they are those of the folder.

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
        lock = lock or {}
        names = {str(parameter["name"]) for parameter in lock.get("resolved", {}).get("parameter", ())}
        found = {n: d if _is_of(d, names) else None for n, d in found.items()}
        if not database.exists():
            return cls(path=path, lock=lock, documents=found, runs=RunList())
        runs, stored = _runs(database, lock, runs)
        return cls(path=path, lock=lock, documents=found, runs=runs, n_others=stored - len(runs))

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
        return {name: _with_bounds(p) for name, p in self._given_parameters.items()}

    def unit_of(self, parameter: str) -> str:
        """The unit of a parameter, "1" when unknown."""
        return str(self._given_parameters.get(parameter, {}).get("unit") or "1")

    @property
    def _given_parameters(self) -> dict[str, Mapping[str, Any]]:
        design = self["design"] or {}
        space = design.get("space", {}).get("parameters")
        given = space or design.get("parameters") or self.lock.get("resolved", {}).get("parameter", [])
        return {str(p["name"]): p for p in given}

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
    def running(self) -> str:
        """That somebody works on the campaign now, and as of when the page is; empty when nobody does."""
        holder = holder_of(self.path / "runs.sqlite")
        if holder is None or holder.is_this_process:
            return ""
        last, finished = self.runs.last_finished, len(self.runs.finished)
        when = "" if last is None else f", the last of {moment(last)}"
        return (
            f"The campaign is running ({holder.sentence}): {finished} of {len(self.runs)} runs "
            f"have their answer{when}. What stands here may change with the answers that are to come."
        )

    def run_name(self, key: str | None) -> str:
        """A run as a person refers to it: its number and the beginning of its key."""
        if not key:
            return "–"
        number = self.runs.number(key)
        return f"run {key[:KEY_SHOWN]}" if number is None else f"run {number} ({key[:KEY_SHOWN]})"


def _with_bounds(given: Mapping[str, Any]) -> Mapping[str, Any]:
    """The parameter with its bounds; as multiples of a baseline, or as a law, it may be stored without."""
    if given.get("lower") is not None and given.get("upper") is not None:
        return given
    if given.get("factor") is None and given.get("distribution") is None:
        return given
    parameter = Parameter.from_dict(given)
    # multiples and bounds do not go together where a space is made of it
    shown = {name: value for name, value in given.items() if name != "factor"}
    return {**shown, "lower": parameter.lower, "upper": parameter.upper}


def _document(path: Path) -> Any:
    found = design_head(path) if path.name == DESIGN else read_json(path)
    if found is not None and not isinstance(found, dict):
        raise StoreError(
            f"{path} holds {type(found).__name__}, not a document. Remove it to have it made anew"
        )
    return found


def _is_of(document: Any, names: set[str]) -> bool:
    """Whether what a stage wrote is about these parameters, as far as it names any.

    A stage that the study asks for no more leaves its document behind when parameters come, go or get other
    names.
    """
    if document is None or not names:
        return True
    point, ranking = document.get("parameters"), document.get("ranking")
    if isinstance(point, dict) and set(point) != names:
        return False
    return not isinstance(ranking, list) or set(ranking) <= names


def _runs(database: Path, lock: Mapping[str, Any], read: RunList | None) -> tuple[RunList, int]:
    """The runs of the lock's model and parameters, and how many are stored in all."""
    model = lock.get("model") or {"identity": None, "version": None}
    names = sorted(str(parameter["name"]) for parameter in lock.get("resolved", {}).get("parameter", ()))
    wanted = (model["identity"], model["version"], *names)
    connection, _ = opened_for_reading(database)
    try:
        with explained(database):
            if read is None or read.model != wanted:
                read = RunList(database, model=wanted)
                for chunk in run_chunks(
                    connection, database, model=wanted[0], version=wanted[1], names=names
                ):
                    read.take(chunk)
            (stored,) = connection.execute("SELECT COUNT(*) FROM evaluation").fetchone()
    finally:
        connection.close()
    return read, int(stored)
