"""Runs with an answer as columns: very many are read through once, and the records of some when wanted."""

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from workbench.models.evaluator import Reading
from workbench.models.stored.evaluation import Evaluation

__all__ = ["RunColumns", "run_columns"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RunColumns:
    """Runs in the order given, one entry per run in each column.

    keys: their names    is_ok: (n,) whether a run has a value    counts: how many have each status
    values: by name (n,), what was read off a run; NaN where it has no value
    records: the whole records of runs by their keys
    """

    keys: Sequence[str]
    is_ok: np.ndarray
    counts: Mapping[str, int]
    values: Mapping[str, np.ndarray]
    records: Callable[[Sequence[str]], list[Evaluation]]

    def __len__(self) -> int:
        return len(self.keys)

    def at(self, positions: Iterable[int]) -> list[Evaluation]:
        """The records of the runs at these positions, in their order."""
        return self.records([self.keys[int(k)] for k in positions])


def run_columns(
    chunks: Iterable[Sequence[Evaluation]],
    readings: Mapping[str, Reading],
    records: Callable[[Sequence[str]], list[Evaluation]],
) -> RunColumns:
    """The columns of runs that come some at a time; `readings` give the values off the outputs of a run."""
    keys: list[str] = []
    flags: list[np.ndarray] = [np.empty(0, dtype=bool)]
    counts: Counter[str] = Counter()
    parts: dict[str, list[np.ndarray]] = {name: [np.empty(0)] for name in readings}
    for runs in chunks:
        is_ok = np.array([run.status == "ok" for run in runs], dtype=bool)
        keys += [run.key for run in runs]
        flags.append(is_ok)
        counts.update(run.status for run in runs)
        for name, read in readings.items():
            part = np.full(len(runs), np.nan)
            part[is_ok] = [read(run.outputs) for run in runs if run.status == "ok"]
            parts[name].append(part)
    return RunColumns(
        keys=keys,
        is_ok=np.concatenate(flags),
        counts=counts,
        values={name: np.concatenate(part) for name, part in parts.items()},
        records=records,
    )
