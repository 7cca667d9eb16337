"""Responses read anew from what stored runs left: numbers, time histories and files; nothing is run.

A response that is new, reduced otherwise or read by another reader is taken from the numbers that the model
returned beside its responses, from the stored history, or from the files that were kept (`[model] keep`).
"""

import math
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from workbench.campaign.read_rows import ReadRow, copied_at_baseline, read_again, read_otherwise
from workbench.campaign.store import Store
from workbench.campaign.store_schema import kept_name
from workbench.errors import EvaluationFailed, StoreError, StudyError
from workbench.models.evaluation import UNFINISHED
from workbench.models.histories import History
from workbench.models.kept_files import unpacked
from workbench.models.protocol import Answer, ModelSpec
from workbench.models.readers import read_response
from workbench.space.box import Space

__all__ = ["KEPT", "Rereading", "kept_archive", "looked_at", "reread", "take_at_baseline"]

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
    folder: Path
    spec: ModelSpec
    readings: Mapping[str, Mapping[str, Any]]
    afresh: bool
    _histories: Mapping[str, History] | None = field(default=None)

    def value(self, name: str) -> float:
        """The response in the present reading.

        Raises:
            NotKept: there is nothing to read it from.    EvaluationFailed: what there is does not hold it.
        """
        how = self.readings[name]
        is_there = name in self.row.outputs and self.row.definition.get(name) == how
        if is_there and not (self.afresh and how):
            return self.row.outputs[name]
        try:
            return self._value_anew(name, how)
        except NotKept:
            if is_there:
                return self.row.outputs[name]
            raise

    def _value_anew(self, name: str, how: Mapping[str, Any]) -> float:
        rule = self.spec.responses[name]
        kept = kept_name(name, how)
        if kept in self.row.kept and not self.afresh:
            return self.row.kept[kept]
        if not how:
            return self._returned(name)
        if rule is not None and self._is_stored_history(name, how):
            history = self.histories().get(name)
            if history is not None:
                return rule.of(history)
        if "read" not in how:
            raise NotKept("its time history was not kept" if rule is not None else "it was not kept")
        with self._files() as work:
            found = read_response(how["read"], work, Path(self.spec.folder), history=rule is not None)
        if rule is None:
            return float(found)
        return rule.of(found if isinstance(found, History) else History(*found))

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
        then = self.row.definition.get(name, {})
        return {k: v for k, v in then.items() if k not in apart} == {
            k: v for k, v in how.items() if k not in apart
        }

    def histories(self) -> Mapping[str, History]:
        """The stored time histories of the run."""
        if self._histories is None:
            self._histories = _stored_histories(self.folder, self.row.key)
        return self._histories

    @contextmanager
    def _files(self) -> Iterator[Path]:
        archive = kept_archive(self.folder, self.row.key)
        whole = self.folder / "work" / self.row.key
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


def reread(
    store: Store,
    folder: Path,
    spec: ModelSpec,
    readings: Mapping[str, Mapping[str, Any]],
    *,
    every: bool = False,
) -> Rereading:
    """Read the responses of stored runs again, those that were read otherwise or `every` one.

    All runs are read or none: where one with a value lacks something, nothing changes.
    """
    answers, found = looked_at(store, folder, spec, readings, every=every)
    if not found.missing:
        read_again(store, answers)
    return found


def looked_at(
    store: Store,
    folder: Path,
    spec: ModelSpec,
    readings: Mapping[str, Mapping[str, Any]],
    *,
    every: bool = False,
) -> tuple[list[tuple[str, Answer | None]], Rereading]:
    """What `reread` would store and find; nothing is written."""
    rows = read_otherwise(store, model=spec.identity, version=spec.version, every=every)
    answers: list[tuple[str, Answer | None]] = []
    missing: list[str] = []
    first = ("", "")
    for row in rows:
        run = _Run(row=row, folder=folder, spec=spec, readings=readings, afresh=every)
        answer, (response, reason) = _read(run)
        if answer is None and row.status == "ok":
            missing.append(row.key)
            first = first if first[0] else (response, reason)
        answers.append((row.key, answer))
    if missing:
        return answers, Rereading(
            read=0, looked_at=len(rows), missing=tuple(missing), response=first[0], reason=first[1]
        )
    read = sum(answer is not None for _, answer in answers)
    return answers, Rereading(read=read, looked_at=len(rows))


def take_at_baseline(
    store: Store, folder: Path, space: Space, version: str, key: Callable[[Mapping[str, Any]], str]
) -> int:
    """Let runs that were made before a parameter was added stand for runs at its baseline; how many did."""
    baselines = {p.name: p.baseline for p in space.parameters if p.baseline is not None}
    found = []
    for row in store.rows(version=version):
        missing = [name for name in space.names if name not in row.inputs]
        if row.status in UNFINISHED or not missing or not set(row.inputs) < set(space.names):
            continue
        try:
            whole = space.canonical({**row.inputs, **{name: baselines[name] for name in missing}})
        except (KeyError, StudyError):
            continue  # no baseline, or outside the bounds: the design says so
        found.append((row.key, key(whole), whole))
    copied = copied_at_baseline(store, found)
    for place, suffix in (("histories", ".nc"), (KEPT, ".zip")):
        for old, new in copied:
            source = folder / place / f"{old}{suffix}"
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
    wrong = [f"{name} = {value}" for name, value in outputs.items() if not math.isfinite(value)]
    if wrong:
        kept |= {kept_name(n, run.readings[n]): v for n, v in outputs.items() if math.isfinite(v)}
        return Answer(status="nonfinite", kept=kept, error=f"not a finite number: {', '.join(wrong)}"), (
            "",
            "",
        )
    return Answer(status="ok", outputs=outputs, kept=kept), ("", "")


def _stored_histories(folder: Path, key: str) -> dict[str, History]:
    from workbench.campaign.histories import read_histories

    try:
        data = read_histories(folder, key)
    except (StoreError, OSError, ValueError):
        return {}
    return {
        str(name): History(data[f"time_{name}"].values.tolist(), data[name].values.tolist())
        for name in data.data_vars
        if f"time_{name}" in data.coords or f"time_{name}" in data.variables
    }
