"""True runs of layouts in uncertain cases, kept in `layouts.sqlite` and never made twice.

    with LayoutRuns(folder, ...) as runs:
        outcomes = runs.of(density)(rows, purpose="...")      # an Evaluator, as searches take it

All layouts of a study share one database and one set of workers, or the threads of this process where the
model runs many cases in one call and neither time nor memory of a run is limited. A run's key is made of the
layout model, the layout's densities and the uncertain case. Asked again after a kill, finished runs come from
the database.
"""

import time
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.campaign.store import Store, run_key
from workbench.campaign.supervisor import (
    Engine,
    InlineEngine,
    Policy,
    supervise,
)
from workbench.models.evaluator import Evaluator, Outcome
from workbench.models.protocol import Answer, ModelSpec, call
from workbench.robust_layout.model import (
    LAYOUT,
    LayoutModel,
    LayoutRun,
    layout_name,
)
from workbench.robust_layout.scouts import coarse_runs
from workbench.space.box import Space
from workbench.system.atomic import write_json
from workbench.workers.processes import ProcessPool

__all__ = ["LayoutRuns"]

Array = NDArray[np.float64]

BATCH = 64  # runs between two looks at Ctrl-C and the store


class LayoutRuns:
    """The runs of all layouts of a study. Close it, or use it in a `with` statement."""

    def __init__(
        self,
        folder: Path,
        *,
        spec: ModelSpec,
        space: Space,
        model: LayoutModel,
        seed: int,
        inline: bool = False,
        workers: int = 1,
        timeout: float | None = None,
        memory: int | None = None,
        retries: int = 0,
    ) -> None:
        self.folder, self.space = folder, space
        self._spec, self._model, self._seed, self._inline = spec, model, seed, inline
        self._pool = {"workers": workers, "timeout": timeout, "memory": memory}
        self._policy = Policy(retries=retries)
        self._engine: Engine | None = None
        (folder / "layouts").mkdir(parents=True, exist_ok=True)
        self._store = Store.opened(folder / "layouts.sqlite")

    def __enter__(self) -> "LayoutRuns":
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
        self._store.close()

    def of(self, density: Array) -> Evaluator:
        """The evaluator of one layout: uncertain rows in, an outcome each out."""
        name = layout_name(density)
        place = self.folder / "layouts" / f"{name}.json"
        if not place.exists():
            write_json(place, {"density": np.asarray(density, dtype=float).tolist()})

        def evaluate(rows: Sequence[Mapping[str, Any]], *, purpose: str) -> list[Outcome]:
            return self._evaluate(name, rows, purpose)

        return evaluate

    @property
    def coarse(self) -> Callable[[Array], Evaluator] | None:
        """density -> evaluator of runs at a longer step, which are not kept; None where the model has none
        or a run has to be one that can be ended."""
        if not self._may_run_here:
            return None
        return coarse_runs(self._model, threads=1 if self._inline else int(self._pool["workers"] or 1))  # type: ignore[call-overload]

    def counts(self) -> dict[str, int]:
        """Runs of this model by status; those of one that it took the place of are stored beside them."""
        rows = self._store.rows(model=self._spec.identity, version=self._spec.version)
        return dict(Counter(row.status for row in rows))

    def _evaluate(self, name: str, rows: Sequence[Mapping[str, Any]], purpose: str) -> list[Outcome]:
        plain = self.space.canonical_rows(rows)
        inputs = [{**row, LAYOUT: name} for row in plain]
        keys = [run_key(self._spec.identity, self._spec.version, row) for row in inputs]
        self._store.enqueue(
            dict(zip(keys, inputs, strict=True)).items(), batch=purpose, model=self._spec.identity,
            version=self._spec.version, seed=self._seed,
        )  # fmt: skip
        waiting = [key for key, status in self._store.statuses(keys).items() if status == "queued"]
        if waiting:
            supervise(self._opened(), self._store, waiting, policy=self._policy)
        found = {row.key: row for row in self._store.rows(keys=keys)}
        return [
            Outcome(
                parameters=row, status=found[key].status, outputs=found[key].outputs, key=key,
                error=found[key].error,
            )
            for key, row in zip(keys, plain, strict=True)
        ]  # fmt: skip

    @property
    def _may_run_here(self) -> bool:
        """Whether no run needs a process that can be ended: no limit of time or memory was set."""
        return self._inline or (self._pool["timeout"] is None and self._pool["memory"] is None)

    def _opened(self) -> Engine:
        if self._engine is None:
            here = LayoutRun(self._model, self.folder / "layouts")
            if self._may_run_here and runs_at_once(self._model):
                threads = int(self._pool["workers"] or 1)
                self._engine = AtOnceEngine(self._spec, here, threads=1 if self._inline else threads)
            elif self._inline:
                self._engine = InlineEngine(self._spec, here)
            else:
                self._engine = ProcessPool(self._spec, **self._pool)  # type: ignore[arg-type]
        return self._engine


def runs_at_once(model: LayoutModel) -> bool:
    """Whether a layout model runs many cases in one call."""
    return callable(getattr(model, "responses_of_cases", None))


class AtOnceEngine(InlineEngine):
    """Runs all rows in line in one call per layout; one that ended a process before runs apart, as ever."""

    capacity = BATCH

    def __init__(self, spec: ModelSpec, run: LayoutRun, *, threads: int) -> None:
        super().__init__(spec, run)
        self._run, self._threads = run, threads

    def completed(self, *, wait: float | None = None) -> list[tuple[Any, Answer]]:
        """Run the rows in line that name the same layout as the first."""
        if not self._waiting or self._waiting[0][0] in self.suspects:
            return super().completed(wait=wait)
        name = self._waiting[0][1][LAYOUT]
        taken = [one for one in self._waiting if one[1][LAYOUT] == name and one[0] not in self.suspects]
        self._waiting = type(self._waiting)(one for one in self._waiting if one not in taken)
        density = self._run.density(str(name))
        cases = [{k: v for k, v in row.items() if k != LAYOUT} for _, row, _ in taken]
        wall, cpu = time.perf_counter(), time.process_time()
        answers = self._answers(density, cases)
        wall, cpu = time.perf_counter() - wall, time.process_time() - cpu
        if answers is None:
            return [(t, call(self._run, self._spec, row, workdir=workdir)) for t, row, workdir in taken]
        known = [call(_Known(a), self._spec, row) for a, (_, row, _) in zip(answers, taken, strict=True)]
        share = 1.0 / len(cases)
        return [
            (task, replace(answer, wall=share * wall, cpu=share * cpu))
            for answer, (task, _, _) in zip(known, taken, strict=True)
        ]

    def _answers(self, density: Any, cases: list[dict[str, Any]]) -> list[Any] | None:
        """Responses or errors of the cases; None where the call as a whole fails: single runs tell why."""
        many: Any = self._run.model
        try:
            found = list(many.responses_of_cases(density, cases, threads=self._threads))
        except Exception:  # a model may raise anything
            return None
        return found if len(found) == len(cases) else None


class _Known:
    """A model whose answer is known: what a run of it would have given or raised."""

    def __init__(self, answer: Any) -> None:
        self._answer = answer

    def run(self, row: Mapping[str, Any], workdir: Path | None) -> Any:
        if isinstance(self._answer, Exception):
            raise self._answer
        return self._answer

    def close(self) -> None:
        """Nothing to release."""
