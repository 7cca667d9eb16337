"""Responses read anew from what stored runs left: numbers, time histories and files; nothing is run.

A response that is new, reduced otherwise or read by another reader is taken from the numbers that the model
returned beside its responses, from the stored history, or from the files that were kept (`[model] keep`). A
reader that is a function is another reader when its code is another.
"""

import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path
from typing import Any

from workbench.campaign.read_rows import ReadRow, copied_at_baseline, read_again, read_otherwise
from workbench.campaign.store import Store
from workbench.campaign.store_schema import kept_name
from workbench.errors import EvaluationFailed, StoreError, StudyError
from workbench.histories.stored import StoredHistories, copy_histories
from workbench.models.command import ENDED_BADLY
from workbench.models.histories import History
from workbench.models.kept_files import unpacked
from workbench.models.protocol import Answer, ModelSpec
from workbench.models.readers import read_response
from workbench.models.stored.evaluation import UNFINISHED
from workbench.models.values import why_no_values
from workbench.space.box import Space

__all__ = ["KEPT", "Rereading", "keep_archive", "kept_archive", "looked_at", "reread", "take_at_baseline"]

KEPT = "kept"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rereading:
    """What came of reading stored runs again.

    read: how many runs were.    missing: keys of runs with a value in which a response is not to be found.
    response, reason: of the first of those.    looked_at: how many runs had been read otherwise.
    """

    read: int
    looked_at: int
    missing: tuple[str, ...] = ()
    response: str = ""
    reason: str = ""


class NotKept(Exception):
    """What a response would be read from was not kept."""


@dataclass(slots=True, kw_only=True)
class _Run:
    """A stored run as a source of responses; histories and files are looked at when they are needed."""

    row: ReadRow
    stored: StoredHistories
    spec: ModelSpec
    readings: Mapping[str, Mapping[str, Any]]
    afresh: bool
    vouched: bool = False
    anew: set[str] = field(default_factory=set)  # responses whose histories were read from files

    def value(self, name: str) -> float:
        """The response in the present reading.

        Raises:
            NotKept: there is nothing to read it from.    EvaluationFailed: what there is does not hold it.
        """
        how = self.readings[name]
        then = self.row.definition.get(name, {})
        is_there = name in self.row.outputs and then == how
        if is_there and not (self.afresh and how):
            return self.row.outputs[name]
        try:
            return self._value_anew(name, how)
        except NotKept as exc:
            if name not in self.row.outputs or _without_code(then) != _without_code(how):
                raise
            if is_there or "code" not in then or self.vouched:  # older stores did not write the code down
                return self.row.outputs[name]
            raise NotKept(
                f"the code of its reader {how['read']['function']} changed, and {exc}. --same-model keeps "
                "what was read when the reader gives the same"
            ) from None

    def _value_anew(self, name: str, how: Mapping[str, Any]) -> float:
        rule = self.spec.responses[name]
        kept = kept_name(name, how)
        if kept in self.row.kept and not self.afresh:
            return self.row.kept[kept]
        if not how:
            return self._returned(name)
        try:
            found = self._in_files(name)  # before the stored history, which may be of another reader
        except NotKept:
            history = self.histories().get(name) if rule is not None else None
            if rule is None or history is None or not self._is_stored_history(name, how):
                raise
            return rule.of(history)
        if rule is None:
            return float(found)
        self.anew.add(name)
        return rule.of(found)

    def _in_files(self, name: str) -> Any:
        """What the reader of a response finds in the files: a number, or a history."""
        how, is_history = self.readings[name], self.spec.responses[name] is not None
        if "read" not in how:
            raise NotKept("its time history was not kept" if is_history else "it was not kept")
        if self.row.status == "failed" and ENDED_BADLY in self.row.error:
            raise NotKept("its command failed")
        with self._files() as work:
            try:
                found = read_response(how["read"], work, Path(self.spec.folder), history=is_history)
            except EvaluationFailed:
                raise
            except StudyError as exc:  # there is no such function, or it cannot be imported
                raise EvaluationFailed(str(exc)) from None
            except (Exception, SystemExit) as exc:  # a function of the user's may raise anything
                raise EvaluationFailed(f"{type(exc).__name__}: {exc}") from None
        return History(*found) if is_history and not isinstance(found, History) else found

    def written_anew(self) -> dict[str, History]:
        """All histories of the run, those that were read from files as they were read."""
        try:
            stored = self.histories()
        except NotKept:
            stored = {}  # what is damaged is replaced
        return {**stored, **{name: self._in_files(name) for name in sorted(self.anew)}}

    def _returned(self, name: str) -> float:
        """A number that the model returned: read as it came in the former reading, or without a name."""
        if name in self.row.outputs and not self.row.definition.get(name):
            return self.row.outputs[name]
        if len(self.readings) == 1 and "" in self.row.kept:
            return self.row.kept[""]
        raise NotKept("the model did not return it")

    def _is_stored_history(self, name: str, how: Mapping[str, Any]) -> bool:
        """Whether the stored history of that name is what the present reading would read."""
        apart = ("reduce", "at", "p")
        then, now = self.row.definition.get(name, {}), dict(how)
        if "code" not in then or self.vouched:
            then, now = _without_code(then), _without_code(now)
        return {k: v for k, v in then.items() if k not in apart} == {
            k: v for k, v in now.items() if k not in apart
        }

    def histories(self) -> Mapping[str, History]:
        """The stored time histories of the run."""
        try:
            return {name: history for name, (history, _) in self.stored.of(self.row.key).items()}
        except StoreError as exc:
            raise NotKept(str(exc)) from None

    @contextmanager
    def _files(self) -> Iterator[Path]:
        archive = kept_archive(self.stored.folder, self.row.key)
        whole = self.stored.folder / "work" / self.row.key
        if archive.exists():
            try:
                with unpacked(archive) as place:
                    yield place
            except OSError as exc:
                raise NotKept(str(exc)) from None
        elif whole.is_dir():  # a run that failed
            yield whole
        else:
            raise NotKept("its files were not kept")


def kept_archive(folder: Path, key: str) -> Path:
    """Where the files that a run left stand, in the campaign's folder."""
    return folder / KEPT / f"{key}.zip"


def keep_archive(folder: Path, key: str, left: Path) -> None:
    """Put the archive that a run left in its folder, if it did, where those of a campaign stand."""
    if left.exists():
        archive = kept_archive(folder, key)
        archive.parent.mkdir(exist_ok=True)
        left.replace(archive)
        left.parent.rmdir()


def reread(
    store: Store,
    folder: Path,
    spec: ModelSpec,
    readings: Mapping[str, Mapping[str, Any]],
    *,
    keep: Callable[[Iterable[tuple[str, Mapping[str, History]]]], None],
    every: bool = False,
    vouched: bool = False,
) -> Rereading:
    """Read the responses of stored runs again, those that were read otherwise or `every` one.

    All runs are read or none: where one with a value lacks something, nothing changes. `keep` is given the
    keys and histories of runs of which some were read from files. `vouched`: a reader whose code changed
    gives the same; where nothing was kept to try it on, what was read stays.
    """
    with StoredHistories(folder) as stored:
        runs, answers, found = _all_read(store, stored, spec, readings, every=every, vouched=vouched)
        if not found.missing:
            if any(run.anew for run in runs):
                keep((run.row.key, run.written_anew()) for run in runs if run.anew)
            read_again(store, answers)
    return found


def looked_at(
    store: Store, folder: Path, spec: ModelSpec, readings: Mapping[str, Mapping[str, Any]]
) -> Rereading:
    """What `reread` would find; nothing is written."""
    with StoredHistories(folder) as stored:
        return _all_read(store, stored, spec, readings, every=False, vouched=False)[2]


def _all_read(
    store: Store,
    stored: StoredHistories,
    spec: ModelSpec,
    readings: Mapping[str, Mapping[str, Any]],
    *,
    every: bool,
    vouched: bool,
) -> tuple[list[_Run], list[tuple[str, Answer | None]], Rereading]:
    runs: list[_Run] = []
    answers: list[tuple[str, Answer | None]] = []
    missing: list[str] = []
    first = ("", "")
    for row in read_otherwise(store, model=spec.identity, version=spec.version, every=every):
        run = _Run(row=row, stored=stored, spec=spec, readings=readings, afresh=every, vouched=vouched)
        answer, (response, reason) = _read(run)
        if answer is None and row.status == "ok":
            missing.append(row.key)
            first = first if first[0] else (response, reason)
        runs.append(run)
        answers.append((row.key, answer))
    read = 0 if missing else sum(answer is not None for _, answer in answers)
    found = Rereading(
        read=read, looked_at=len(runs), missing=tuple(missing), response=first[0], reason=first[1]
    )
    return runs, answers, found


def take_at_baseline(
    store: Store, folder: Path, space: Space, spec: ModelSpec, key: Callable[[Mapping[str, Any]], str]
) -> int:
    """Let runs that were made before a parameter was added stand for runs at its baseline; how many did."""
    baselines = {p.name: p.baseline for p in space.parameters if p.baseline is not None}
    found = []
    for row in store.rows(model=spec.identity, version=spec.version):
        missing = [name for name in space.names if name not in row.inputs]
        if row.status in UNFINISHED or not missing or not set(row.inputs) < set(space.names):
            continue
        try:
            whole = space.canonical({**row.inputs, **{name: baselines[name] for name in missing}})
        except (KeyError, StudyError):
            continue  # no baseline, or outside the bounds: the design says so
        found.append((row.key, key(whole), whole))
    copied = copied_at_baseline(store, found)
    copy_histories(folder, folder, copied)
    for old, new in copied:
        source = kept_archive(folder, old)
        if source.exists():
            shutil.copyfile(source, source.with_stem(new))
    return len(copied)


def _read(run: _Run) -> tuple[Answer | None, tuple[str, str]]:
    """The answer of a stored run in the present reading, or None with the response that is not to be had."""
    outputs: dict[str, float] = {}
    for name in run.readings:
        try:
            outputs[name] = run.value(name)
        except (NotKept, EvaluationFailed) as exc:
            return None, (name, str(exc))
        except (TypeError, ValueError) as exc:
            return None, (name, f"{type(exc).__name__}: {exc}")
    kept = dict(run.row.kept)
    for name, value in run.row.outputs.items():
        how = run.row.definition.get(name, {})
        if run.readings.get(name) != how:
            kept[kept_name(name, how)] = value
    if wrong := why_no_values(outputs):
        kept |= {kept_name(n, run.readings[n]): v for n, v in outputs.items() if isfinite(v)}
        return Answer(status="nonfinite", kept=kept, error=wrong), ("", "")
    return Answer(status="ok", outputs=outputs, kept=kept), ("", "")


def _without_code(how: Mapping[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in how.items() if key != "code"}
