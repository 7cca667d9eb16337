"""True runs of layouts in uncertain cases, kept in `layouts.sqlite` and never made twice.

    with LayoutRuns(folder, ...) as runs:
        outcomes = runs.of(density)(rows, purpose="...")      # an Evaluator, as searches take it

All layouts of a study share one set of workers and one database; a run's key is made of the layout model, the
layout's densities and the uncertain case. Asked again after a kill, finished runs come from the database.
"""

from collections import Counter
from collections.abc import Mapping, Sequence
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
from workbench.models.protocol import ModelSpec
from workbench.robust_layout.model import (
    LAYOUT,
    LayoutModel,
    LayoutRun,
    layout_name,
)
from workbench.space.box import Space
from workbench.system.atomic import write_json
from workbench.workers.processes import ProcessPool

__all__ = ["LayoutRuns"]

Array = NDArray[np.float64]


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

    def counts(self) -> dict[str, int]:
        """Runs by status."""
        return dict(Counter(row.status for row in self._store.rows(version=self._spec.version)))

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

    def _opened(self) -> Engine:
        if self._engine is None:
            if self._inline:
                self._engine = InlineEngine(self._spec, LayoutRun(self._model, self.folder / "layouts"))
            else:
                self._engine = ProcessPool(self._spec, **self._pool)  # type: ignore[arg-type]
        return self._engine
