"""The runs of a campaign for the report: what is counted is held, the rest is read when it is asked for.

Of a million runs a few columns fit into memory and the records do not. The list holds of every run its
number, key, status, stage, times and responses; whole records are read of the runs that a figure shows.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, final

import numpy as np

from workbench.models.stored.causes import cause_of, shared_words, without_numbers
from workbench.models.stored.evaluation import FAILED, UNFINISHED, Evaluation
from workbench.models.stored.run_chunks import RunChunk, numbered_runs
from workbench.system.database import explained, opened_for_reading

__all__ = ["Failure", "RunList"]

AT_ONCE = 5_000  # records that are held while all are walked through


@dataclass(slots=True, kw_only=True)
class Failure:
    """Runs that failed for causes that differ in their numbers alone: how many, and the number of the
    first. `cause`: what they share."""

    status: str
    cause: str
    first: int
    count: int = 0


@final
class RunList:
    """Runs in the order asked for: filled chunk by chunk, then read. Positions count from 0 in that order.

    model: identity, version and parameters of the runs that it was filled with; None where nobody said.
    """

    def __init__(self, database: Path | None = None, *, model: tuple[Any, ...] | None = None) -> None:
        self.model = model
        self._database = database
        self._parts: dict[str, list[np.ndarray]] = {name: [] for name in _TYPES}
        self._values: list[tuple[int, dict[str, np.ndarray]]] = []
        self._words: dict[str, int] = {}
        self._failures: dict[tuple[str, str], Failure] = {}

    def take(self, chunk: RunChunk) -> None:
        """Add the runs of a chunk."""
        codes = self._words
        for name, cells in (
            ("ids", chunk.ids),
            ("keys", [key.encode() for key in chunk.keys]),
            ("statuses", [codes.setdefault(word, len(codes)) for word in chunk.statuses]),
            ("stages", [codes.setdefault(word, len(codes)) for word in chunk.batches]),
            ("finished", chunk.finished),
            ("wall", chunk.wall),
            ("cpu", chunk.cpu),
        ):
            self._parts[name].append(np.array(cells, dtype=_TYPES[name]))
        names = sorted(set().union(*chunk.outputs))
        columns = {n: np.array([found.get(n) for found in chunk.outputs], dtype=float) for n in names}
        self._values.append((len(chunk.ids), columns))
        if set(FAILED).isdisjoint(chunk.statuses):
            return
        for number, status, error, log in zip(
            chunk.ids, chunk.statuses, chunk.errors, chunk.logs, strict=True
        ):
            if status in FAILED:
                cause = cause_of(error, log)
                kind = (status, without_numbers(cause))
                known = self._failures.setdefault(kind, Failure(status=status, cause=cause, first=number))
                known.cause = shared_words(known.cause, cause)
                known.count += 1

    def __len__(self) -> int:
        return len(self._column("ids"))

    def __iter__(self) -> Iterator[Evaluation]:
        for begin in range(0, len(self), AT_ONCE):
            yield from self.at(range(begin, min(begin + AT_ONCE, len(self))))

    def at(self, positions: Sequence[int] | np.ndarray) -> list[Evaluation]:
        """The records of the runs at these positions, without gradients.

        Raises:
            StoreError: the database is damaged.
        """
        ids = self._column("ids")[np.asarray(positions, dtype=int)]
        if not len(ids) or self._database is None:
            return []
        db, _ = opened_for_reading(self._database)
        try:
            with explained(self._database):
                return numbered_runs(db, self._database, ids)
        finally:
            db.close()

    def named(self, keys: Sequence[str]) -> dict[str, Evaluation]:
        """The records of the runs with these keys; those that are not there are left out."""
        found = [place for place in map(self.place, keys) if place is not None]
        return {run.key: run for run in self.at(found)}

    def place(self, key: str) -> int | None:
        """The position of the run with this key; None when it is not there."""
        keys, order = self._by_key
        k = int(np.searchsorted(keys, key.encode()))
        return int(order[k]) if k < len(keys) and keys[k] == key.encode() else None

    def number(self, key: str) -> int | None:
        """The number that the run with this key goes by; None when it is not there."""
        place = self.place(key)
        return None if place is None else int(self._column("ids")[place])

    def with_status(self, *statuses: str) -> np.ndarray:
        """Positions of the runs with one of these statuses."""
        return np.flatnonzero(np.isin(self._column("statuses"), self._codes(statuses)))

    @property
    def finished(self) -> np.ndarray:
        """Positions of the runs that have an answer, good or bad."""
        return np.flatnonzero(~np.isin(self._column("statuses"), self._codes(UNFINISHED)))

    def values(self, response: str) -> np.ndarray:
        """The response of every run (n,); NaN without a value."""
        parts = [columns.get(response, np.full(count, np.nan)) for count, columns in self._values]
        return np.concatenate([np.zeros(0), *parts])

    def keys(self, positions: np.ndarray) -> list[str]:
        """The keys of the runs at these positions."""
        return [key.decode() for key in self._column("keys")[positions].tolist()]

    @property
    def counts(self) -> dict[str, int]:
        """Runs by status."""
        return dict(sorted(self._count("statuses", slice(None)).items()))

    @property
    def by_stage(self) -> dict[str, dict[str, int]]:
        """Runs by stage and status, stages in the order in which they began."""
        codes, first = np.unique(self._column("stages"), return_index=True)
        ordered = codes[np.argsort(first)]
        words = list(self._words)
        return {words[code]: self._count("statuses", self._column("stages") == code) for code in ordered}

    @property
    def failures(self) -> list[Failure]:
        """Why runs failed, most first."""
        order = list(dict.fromkeys(status for status, _ in self._failures))
        return sorted(self._failures.values(), key=lambda f: (-f.count, order.index(f.status)))

    @property
    def wall(self) -> float:
        """s that all runs took together."""
        return float(np.nansum(self._column("wall")))

    @property
    def cpu(self) -> float:
        """Processor seconds of all runs together."""
        return float(np.nansum(self._column("cpu")))

    @property
    def last_finished(self) -> float | None:
        """When the last answer came, in seconds since 1970; None without any."""
        moments = self._column("finished")[self.finished]
        known = moments[np.isfinite(moments)]
        return float(known.max()) if len(known) else None

    def sample(
        self, positions: np.ndarray, *, most: int, always: Collection[int] = (), among: str | None = None
    ) -> np.ndarray:
        """About `most` of these positions, each stage with an equal share or whole, at even steps in order.

        `always`: positions that are among them whatever the steps are. `among`: a response, whose smallest
        and largest value are.
        """
        if len(positions) <= most:
            return positions
        chosen = set(always)
        if among is not None:
            values = self.values(among)[positions]
            if np.isfinite(values).any():
                chosen |= {int(positions[end(values)]) for end in (np.nanargmin, np.nanargmax)}
        stages = self._column("stages")[positions]
        codes, counts = np.unique(stages, return_counts=True)
        left = most - len(chosen)
        for k, stage in enumerate(np.argsort(counts, kind="stable")):
            of_stage = positions[stages == codes[stage]]
            share = min(len(of_stage), left // (len(codes) - k))
            chosen |= set(of_stage[np.linspace(0, len(of_stage) - 1, share).astype(int)].tolist())
            left -= share
        return np.array(sorted(chosen), dtype=int)

    def _column(self, name: str) -> np.ndarray:
        parts = self._parts[name]
        if len(parts) != 1:
            parts[:] = [np.concatenate([np.zeros(0, dtype=_TYPES[name]), *parts])]
        return parts[0]

    def _codes(self, words: Collection[str]) -> list[int]:
        return [self._words[word] for word in words if word in self._words]

    def _count(self, column: str, which: slice | np.ndarray) -> dict[str, int]:
        codes, counts = np.unique(self._column(column)[which], return_counts=True)
        words = list(self._words)
        return {words[code]: int(count) for code, count in zip(codes, counts, strict=True)}

    @cached_property
    def _by_key(self) -> tuple[np.ndarray, np.ndarray]:
        """The keys in rising order, and their positions."""
        order = np.argsort(self._column("keys"), kind="stable")
        return self._column("keys")[order], order


_TYPES: Mapping[str, Any] = {
    "ids": np.int64, "keys": "S32", "statuses": np.int16, "stages": np.int16,
    "finished": float, "wall": float, "cpu": float,
}  # fmt: skip
