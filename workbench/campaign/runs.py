"""The runs of a campaign in its folder: asks the model for rows, keeps every answer, never asks twice.

The folder, the store, our own workers, and `ask` and `tell` for results that come from elsewhere. The stages
stand above (`workbench.stages`) and work on this.
"""

import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import blake2b
from itertools import islice
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from workbench.campaign.lock import check_lock, present_version, take_state, write_lock
from workbench.campaign.permissions import Permissions
from workbench.campaign.progress import Progress, Silent
from workbench.campaign.read_rows import former_keys, present_reading, run_again, set_large_aside
from workbench.campaign.rereading import Rereading, keep_archive, reread, take_at_baseline
from workbench.campaign.store import Store
from workbench.campaign.supervisor import Engine, InlineEngine, Policy, supervise
from workbench.campaign.view import StoredRuns, study_version
from workbench.errors import HoldfastError, Interrupted, StoreError, StudyError
from workbench.histories.store import HistoryStore
from workbench.histories.stored import take_former
from workbench.models.histories import History
from workbench.models.kept_files import ARCHIVE
from workbench.models.opening import open_model
from workbench.models.protocol import Answer, told_answer
from workbench.models.stored.evaluation import FAILED, Evaluation
from workbench.models.values import LARGEST
from workbench.provenance.content import ContentCache
from workbench.provenance.named import model_files
from workbench.provenance.reading import readings_now
from workbench.provenance.state import model_state
from workbench.space.units import counted
from workbench.study.record import Study
from workbench.system.atomic import write_text

__all__ = ["Asked", "CampaignRuns"]

RECYCLE = 400  # runs of a worker of an FMU before it is replaced: units leak instances


@dataclass(frozen=True, slots=True)
class Asked:
    """A run that somebody else is to make: its key, and the parameters to make it with."""

    key: str
    parameters: Mapping[str, Any]


class CampaignRuns(StoredRuns):
    """A study, its folder and its runs: what the stages work on.

    `workbench.Campaign` adds the walk through the stages and the results as tables, and overrides nothing.
    """

    def __init__(
        self,
        study: Study,
        *,
        folder: Path | None = None,
        function: Callable[..., Any] | None = None,
        permissions: Permissions | None = None,
        progress: Progress | None = None,
    ) -> None:
        self.study = study
        self.folder = study.campaign_folder if folder is None else Path(folder)
        self.progress = Silent() if progress is None else progress
        self.permissions = Permissions() if permissions is None else permissions
        self._function = function
        self._engine: Engine | None = None
        self._histories: HistoryStore | None = None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as exc:
            raise StoreError(
                f"cannot make the folder {self.folder}: {exc.strerror}. Choose another --folder"
            ) from exc
        self.store = Store.opened(self.folder / "runs.sqlite")
        shutil.rmtree(self._scratch, ignore_errors=True)  # of a coordinator that was killed with its machine
        try:
            self.spec = study.spec(version=study_version(study, self.store))
            for text in self._state_taken():
                self.progress.note(text)
            for text in check_lock(
                self.folder,
                self.spec,
                runs=self.store.counts().get("ok", 0),
                keep_runs=self.permissions.same_model,
                guarded=not self._knows_states,
            ):
                self.progress.note(text)
            if study.text:
                write_text(self.folder / "study.toml", study.text)
            write_lock(self.folder, study, self.spec)
            self._rename_former_files()
            if taken := take_former(self.folder):
                self.progress.note(f"histories/ moved into one database: of {counted(taken, 'run')}")
            if self.permissions.at_baseline:
                count = take_at_baseline(self.store, self.folder, study.space, self.spec, self.key)
                self.progress.note(f"taken as made at the baseline of what is new: {counted(count, 'run')}")
            if large := set_large_aside(self.store):
                hold = counted(large, "stored run holds", "stored runs hold")
                they = "counts" if large == 1 else "count"
                self.progress.note(f"{hold} a number beyond {LARGEST:.0e} and {they} as failed")
            present_reading(self.store, self.readings)
            self.reread()
        except BaseException:
            self.store.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, exc: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the workers and close the database."""
        if self._engine is not None:
            self._engine.close()
            self._engine = None
        if self._histories is not None:
            self._histories.close()
            self._histories = None
        self.store.close()

    def reread(self, *, every: bool = False) -> Rereading:
        """Read responses again from what stored runs left, where they are read otherwise now.

        A campaign does this by itself when it is opened; nothing is run. `every`: of all runs, though they
        were read in the present way, as after a change that nobody can see in a reader.

        Raises:
            StudyError: a response cannot be read from some runs; nothing has changed then.
        """
        found = reread(
            self.store,
            self.folder,
            self.spec,
            self.readings,
            keep=self._write_histories,
            every=every,
            vouched=self.permissions.same_model,
        )
        if found.missing and (self.permissions.run_again or self.study.model["kind"] == "table"):
            run_again(self.store, found.missing, reason="other reading")
            if self.study.model["kind"] != "table":
                self.progress.note(f"made anew: {counted(len(found.missing), 'run')}; {found.reason}")
            return self.reread(every=every)
        if found.missing:
            runs = counted(len(found.missing), "stored run")
            raise StudyError(
                f"response {found.response!r} cannot be read from {runs} of {self.folder.name}: "
                f"{found.reason}. --run-again makes the {runs} anew; or give it the name and the reading "
                "back that it had"
            )
        if found.read:
            self.progress.note(
                f"responses of {counted(found.read, 'stored run')} read again; nothing was run"
            )
        return found

    def evaluate(
        self,
        rows: Sequence[Mapping[str, Any]],
        *,
        batch: str = "design",
        quiet: bool = False,
        repeat: int = 0,
        beside: tuple[int, int] = (0, 0),
    ) -> list[Evaluation]:
        """Have these rows run, unless the store knows them; the answers in the order of the rows.

        `quiet`: do not tell the progress of single runs. `repeat` k > 0: their k-th repetitions. `beside`:
        answered runs, and runs still to come, that the progress counts as well.

        Raises:
            Interrupted: Ctrl-C, or a model that only others can run has rows without an answer.
            StoreError: the store refused a write.
        """
        keys = self.enqueue(rows, batch=batch, repeat=repeat)
        queued = [key for key, status in self.store.statuses(keys).items() if status == "queued"]
        if queued:
            done = len(set(keys)) - len(queued) + beside[0]
            self._make(queued, done=done, total=done + len(queued) + beside[1], quiet=quiet)
        return self.store.rows(keys=keys)

    def enqueue(self, rows: Sequence[Mapping[str, Any]], *, batch: str, repeat: int = 0) -> list[str]:
        """Queue the rows that are new, and give all keys; what breaks a constraint is skipped at once."""
        space = self.study.space
        plain = space.canonical_rows(rows)
        keys = [self.key(row, repeat=repeat) for row in plain]
        known = self.store.statuses(keys)
        new = {key: row for key, row in zip(keys, plain, strict=True) if key not in known}
        if not new:
            return keys
        with self.store.transaction():
            self.store.enqueue(
                new.items(),
                batch=batch,
                model=self.spec.identity,
                version=self.spec.version,
                seed=self.study.seed,
            )
            for key, row in new.items() if space.constraints else ():
                broken = space.violated(row)
                if broken is not None:
                    self.store.finish(
                        key, Answer(status="skipped", error=f"constraint {broken} is not met"), attempt=0
                    )
        return keys

    def ask(self, n: int | None = None) -> list[Asked]:
        """Up to `n` rows that wait for an answer, in the order they were asked for.

        Rows of a former design that lie outside the present bounds wait on, and are not asked for.
        """
        waiting = (row for row in self.runs() if row.status == "queued" and self._is_inside(row.inputs))
        return [Asked(row.key, row.inputs) for row in islice(waiting, n)]

    def _is_inside(self, row: Mapping[str, Any]) -> bool:
        try:
            self.study.space.canonical(row)
        except StudyError:
            return False
        return True

    def tell(
        self,
        key: str | None,
        outputs: Mapping[str, Any] | float | None = None,
        *,
        parameters: Mapping[str, Any] | None = None,
        failure: str | None = None,
    ) -> str:
        """Store the result of a run made elsewhere: `outputs`, or the `failure` that kept it from giving any.

        Without a `key` the run is named by its `parameters` and joins the campaign. An answer that is there
        already stays; telling the same twice is no error. Gives the key.

        Raises:
            StudyError: no such key, or neither outputs nor a failure.
        """
        if key is None:
            if parameters is None:
                raise StudyError("tell needs the key of an asked run, or the parameters of a new one")
            (key,) = self.enqueue([parameters], batch="told")
        elif not self.store.rows(keys=[key]):
            raise StudyError(f"no run {key!r} was asked for in {self.folder.name}")
        answer = told_answer(outputs, failure, self.study.reductions)
        attempt = self.store.rows(keys=[key])[0].attempt + 1
        self.store.finish(key, answer, attempt=attempt)
        return key

    def retry(self) -> int:
        """Put failed runs back in the queue; how many."""
        keys = [row.key for row in self.runs() if row.status in FAILED]
        self.store.retry(keys)
        return len(keys)

    def _state_taken(self) -> list[str]:
        """Let answers belong to the present state of the model; what a person should know."""
        cache = ContentCache(self.folder / ".content.json")
        wanted = self.study.model.get("state") or {}
        state = model_state(self.spec, wanted, cache=cache)
        self.readings = readings_now(
            self.study.readings, self.spec, model_files(self.spec), wanted, cache=cache
        )
        cache.write()
        self._knows_states = bool(
            self.store.select("SELECT 1 FROM evaluation WHERE state IS NOT NULL LIMIT 1")
        )
        place, allowed = self.folder.name, self.permissions
        try:
            return take_state(self.store, state, self.spec, place=place, same_model=allowed.same_model)
        except StudyError:
            if not allowed.new_version:
                raise
        version = present_version(self.store, str(self.study.model["version"]), anew=True)
        self.spec = self.study.spec(version=version)
        take_state(self.store, state, self.spec, place=place, same_model=False)
        return ["the model changed: its runs are made anew, the old ones stay beside them"]

    def _make(self, keys: Sequence[str], *, done: int, total: int, quiet: bool) -> None:
        """Run queued rows on the engine of the study."""
        if self.study.model["kind"] == "ask":
            waits = counted(len(keys), "run waits for its result", "runs wait for their results")
            raise Interrupted(
                f"{waits}: `holdfast design` lists them, `holdfast tell` takes the results, then the same "
                "command continues"
            )
        counts: Counter[str] = Counter({"ok": done} if done else {})

        def watch(rows: Sequence[Evaluation]) -> None:
            counts.update(row.status for row in rows)
            if not quiet:
                self.progress.runs(counts.total(), total, counts)

        watch(())  # what was known before counts for no pace
        if self._engine is None:
            self._engine = self.opened_engine()
        try:
            policy = Policy(retries=self.study.evaluate.get("retries", 0))
            supervise(
                self._engine,
                self.store,
                keys,
                policy=policy,
                watcher=watch,
                workdir=self._workdir if self.study.model["kind"] == "command" else None,
                keep=self._keep if self._keeps_something else None,
            )
        except HoldfastError:
            self._engine.close()
            self._engine = None
            raise

    def _rename_former_files(self) -> None:
        """Give files of runs that an older schema knew by another key the present one."""
        former = former_keys(self.store)
        for place in ("histories", "work") if former else ():
            for path in (self.folder / place).glob("*"):
                if path.stem in former and not path.with_stem(former[path.stem]).exists():
                    path.rename(path.with_stem(former[path.stem]))

    @property
    def _scratch(self) -> Path:
        """Where runs have their temporary files: in the folder, or our part of where the study says."""
        named = self.study.evaluate.get("scratch")
        whole = self.folder.resolve()
        if named is None:
            return whole / "scratch"
        digest = blake2b(str(whole).encode(), digest_size=6).hexdigest()
        return Path(self.study.folder) / named / f"{whole.name}-{digest}"

    def _workdir(self, key: str) -> Path:
        """Where a run of a command stands."""
        return (self.folder / "work" / key).resolve()

    @property
    def _keeps_something(self) -> bool:
        model = self.study.model
        return any(self.study.reductions.values()) or bool(model.get("keep")) or model["kind"] == "command"

    def _keep(self, answers: Sequence[tuple[str, Answer]]) -> None:
        """Write the time histories of runs, and put the files that they left where they are kept."""
        with_histories = [(key, answer.histories) for key, answer in answers if answer.histories]
        if with_histories:
            self._write_histories(with_histories)
        for key, answer in answers:
            if self.study.model["kind"] == "command" and answer.status == "ok":
                keep_archive(self.folder, key, self._workdir(key) / ARCHIVE)

    def _write_histories(self, runs: Iterable[tuple[str, Mapping[str, History]]]) -> None:
        """Write the time histories of runs, with the units of the study."""
        if self._histories is None:
            self._histories = HistoryStore.opened(self.folder)
        units = {response.name: response.unit for response in self.study.responses}
        self._histories.write(
            (key, {name: (history, units.get(name, "1")) for name, history in histories.items()})
            for key, histories in runs
        )

    def opened_engine(self) -> Engine:
        """What runs the model as the study says; whoever opens it closes it."""
        options = self.study.evaluate
        if self._function is not None:
            from workbench.models.python import PythonModel, check_signature

            check_signature(self._function, self.spec.names)
            return InlineEngine(self.spec, PythonModel(self._function))
        if options.get("engine") == "inline" or self.study.model["kind"] == "table":
            return InlineEngine(self.spec, open_model(self.spec))
        if options.get("engine") == "dask":
            from workbench.workers.dask_engine import DaskEngine

            return DaskEngine(
                self.spec,
                address=options.get("address"),
                workers=options.get("workers", 1),
                timeout=options.get("timeout"),
                memory=self.study.memory_bytes,
            )
        from workbench.workers.processes import ProcessPool

        return ProcessPool(
            self.spec,
            workers=options.get("workers", 1),
            timeout=options.get("timeout"),
            memory=self.study.memory_bytes,
            recycle=RECYCLE if self.study.model["kind"] == "fmu" else None,
            scratch=self._scratch,
        )
