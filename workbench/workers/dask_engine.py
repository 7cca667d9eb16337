"""Runs on a Dask cluster: submit and as-completed only, at least once, each run in a supervised process.

On each thread of a Dask worker one process of ours opens the model and runs rows, so time limits, memory
limits and crashes are handled as on one machine. Descriptions and rows travel as plain types; the study's
folder must be reachable under the same path on the workers. Needs the extra `dask`.
"""

import threading
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.protocol import Answer, ModelSpec
from workbench.workers.messages import answer_from_dict, answer_to_dict

__all__ = ["DaskEngine", "run_on_worker"]

REFUSED = "refused: "
_local = threading.local()


class DaskEngine:
    """An engine on an existing cluster (`address`), or on a cluster of `workers` local processes."""

    def __init__(
        self,
        spec: ModelSpec,
        *,
        address: str | None = None,
        workers: int = 1,
        timeout: float | None = None,
        memory: int | None = None,
    ) -> None:
        try:
            from distributed import Client, as_completed
        except ImportError:
            raise StudyError("engine 'dask' needs Dask: pip install 'holdfast[dask]'") from None
        try:
            self._client = (
                Client(n_workers=workers, threads_per_worker=1, dashboard_address=None, set_as_default=False)
                if address is None
                else Client(address, timeout=10, set_as_default=False)
            )
        except (OSError, TimeoutError, ValueError) as exc:
            raise StudyError(f"no Dask scheduler answers at {address}: {exc}") from None
        threads = sum(w["nthreads"] for w in self._client.scheduler_info()["workers"].values())
        self.capacity = max(1, threads)
        self._completed = as_completed(loop=self._client.loop)
        self._tasks: dict[str, Any] = {}
        self._arguments = (spec.to_dict(), timeout, memory)

    def submit(self, task: Any, row: Mapping[str, Any], *, workdir: Path | None = None) -> None:
        """Send a row to the cluster."""
        place = None if workdir is None else str(workdir)
        future = self._client.submit(run_on_worker, *self._arguments, dict(row), place, pure=False, retries=2)
        self._tasks[future.key] = task
        self._completed.add(future)

    def completed(self, *, wait: float | None = None) -> list[tuple[Any, Answer]]:
        """Finished tasks; waits for one at least, up to `wait` seconds."""
        until = None if wait is None else time.monotonic() + wait
        while self._tasks:
            batch = self._completed.next_batch(block=wait is None)
            if batch:
                return [found for future in batch if (found := self._answered(future)) is not None]
            if until is not None and time.monotonic() >= until:
                break
            time.sleep(0.002)
        return []

    def close(self) -> None:
        """Let go of the cluster; a local one ends."""
        self._client.close()
        if self._client.cluster is not None:
            self._client.cluster.close()

    def _answered(self, future: Any) -> tuple[Any, Answer] | None:
        task = self._tasks.pop(future.key, None)
        if task is None:
            return None
        exception = future.exception()
        if exception is not None:
            text = f"{type(exception).__name__}: {exception}"
            return task, Answer(status="killed", error=f"the cluster lost the run: {text}"[:4000])
        answer = answer_from_dict(future.result())
        if answer.error.startswith(REFUSED):
            raise StudyError(answer.error.removeprefix(REFUSED))
        return task, answer


def run_on_worker(
    spec: dict[str, Any], timeout: float | None, memory: int | None, row: dict[str, Any], workdir: str | None
) -> dict[str, Any]:
    """Run one row in this thread's process, on a worker of the cluster; the answer in plain types."""
    from workbench.workers.processes import ProcessPool

    pools = _local.__dict__.setdefault("pools", {})
    address = repr((spec, timeout, memory))
    if address not in pools:
        pools[address] = ProcessPool(ModelSpec.from_dict(spec), workers=1, timeout=timeout, memory=memory)
    pool = pools[address]
    try:
        pool.submit(0, row, workdir=None if workdir is None else Path(workdir))
        ((_, answer),) = pool.completed()
    except StudyError as exc:
        answer = Answer(status="failed", error=f"{REFUSED}{exc}")
    found: dict[str, Any] = answer_to_dict(answer)
    return found
