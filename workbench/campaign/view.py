"""A campaign to look at, whoever works on it: its stored runs, as of when, who is at it. Nothing is written.

    with CampaignView.opened(load_study("study.toml")) as view:
        view.runs(), view.as_of.sentence

It needs the right to read and no more: it works beside a running campaign, in another user's folder and on a
read-only disk.
"""

import json
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self, final

from workbench.campaign.lock import present_version
from workbench.campaign.progress import Progress, Silent
from workbench.campaign.store import Store, run_key
from workbench.models.protocol import ModelSpec
from workbench.models.stored.evaluation import FAILED, Evaluation
from workbench.models.stored.run_chunks import RunChunk
from workbench.study.messages import placed
from workbench.study.record import Study
from workbench.system.one_writer import Holder, holder_of, moment

__all__ = ["AsOf", "CampaignView", "StoredRuns", "as_of", "study_version"]


@dataclass(frozen=True, slots=True, kw_only=True)
class AsOf:
    """Of when a look is, and what it cannot see.

    last_answer: when the last answer was stored, in seconds since 1970; None without any.
    holder: who works on the campaign, as far as can be seen from here.    unseen: in words; empty if nothing.
    """

    last_answer: float | None
    holder: Holder | None
    unseen: str = ""

    @property
    def sentence(self) -> str:
        """For a person."""
        when = "no answer yet" if self.last_answer is None else f"as of {moment(self.last_answer)}"
        who = [] if self.holder is None else [f"running: {self.holder.sentence}"]
        return "; ".join([when, *who, *([self.unseen] if self.unseen else [])])

    def to_dict(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "last_answer": None if self.last_answer is None else moment(self.last_answer),
            "running": None if self.holder is None else self.holder.sentence,
            "unseen": self.unseen,
        }


def as_of(store: Store) -> AsOf:
    """Of when what a store shows is, and who writes to it beside this process."""
    holder = holder_of(store.path)
    if holder is not None and holder.is_this_process:
        holder = None
    return AsOf(last_answer=store.last_answer(), holder=holder, unseen=store.unseen)


def study_version(study: Study, store: Store) -> str:
    """The version that the runs of a study's model go by in a store."""
    if study.model["kind"] == "table":
        from workbench.models.table import table_digest

        with placed(study.text, study.where, ("model", "file")):
            return table_digest(study.folder / study.model["file"])
    return present_version(store, str(study.model["version"]))


class StoredRuns:
    """The stored runs of a study: what campaigns and looks at them share."""

    study: Study
    folder: Path
    spec: ModelSpec
    store: Store
    progress: Progress

    def key(self, row: Mapping[str, Any], *, repeat: int = 0) -> str:
        """The name of the run with these parameters, or of its `repeat`-th repetition."""
        return run_key(self.spec.identity, self.spec.version, row, repeat=repeat)

    def runs(self) -> list[Evaluation]:
        """All runs of the present model and space, in the order they were asked for."""
        names = set(self.study.space.names)
        rows = self.store.rows(model=self.spec.identity, version=self.spec.version)
        return [row for row in rows if set(row.inputs) == names]

    def chunks(self) -> Iterator[RunChunk]:
        """What `runs` gives, some thousand runs at a time and without what only single runs are asked for."""
        spec = self.spec
        return self.store.chunks(model=spec.identity, version=spec.version, names=self.study.space.names)

    def statuses(self) -> dict[str, str]:
        """Key -> status of all runs of the present model, whatever parameters they have."""
        query = "SELECT key, status FROM evaluation WHERE model = ? AND version = ?"
        return dict(self.store.select(query, [self.spec.identity, self.spec.version]))

    def failures(self) -> dict[str, int]:
        """How many runs failed, by status; those that a constraint skipped are not among them."""
        query = f"SELECT status, inputs FROM evaluation WHERE version = ? AND status IN {FAILED}"
        found = self.store.select(query, [self.spec.version])
        names = set(self.study.space.names)
        return dict(Counter(status for status, inputs in found if set(json.loads(inputs)) == names))


@final
class CampaignView(StoredRuns):
    """A campaign that is looked at. Close it, or use it in a `with` statement."""

    def __init__(self, study: Study, folder: Path, store: Store, progress: Progress) -> None:
        self.study, self.folder, self.store, self.progress = study, folder, store, progress
        self.spec = study.spec(version=study_version(study, store))
        self.as_of = as_of(store)

    @classmethod
    def opened(cls, study: Study, *, folder: Path | None = None, progress: Progress | None = None) -> Self:
        """Look at the campaign of a study, in `folder` or beside the study file.

        Raises:
            StoreError: there is no campaign, or it may not be read.
        """
        place = study.campaign_folder if folder is None else Path(folder)
        store = Store.reading(place / "runs.sqlite")
        try:
            return cls(study, place, store, Silent() if progress is None else progress)
        except BaseException:
            store.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, exc: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the database."""
        self.store.close()
