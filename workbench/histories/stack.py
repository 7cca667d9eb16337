"""The histories of one name of many runs over the same times, read piece by piece when they are asked for.

Runs that stand on one row of times, or on beginnings of it (a run that ended early), are put over that row,
with NaN after the end of a run. Runs on other times need times to be given: a value there lies on the
straight line between two samples, and is NaN outside the time of the run.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from workbench.errors import StudyError
from workbench.histories.encoding import CHUNK
from workbench.histories.store import Entry, HistoryStore

__all__ = ["HistoryStack", "stacked", "stacked_anyway"]


class SeveralAxes(StudyError):
    """Runs stand on different times; all cover `low` to `high`, if that is not empty."""

    def __init__(self, low: float, high: float, message: str) -> None:
        super().__init__(message)
        self.low, self.high = low, high


BLOCK = 4_000_000  # values that are read at once


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class HistoryStack:
    """The histories `name` of runs, over `times` (samples,). `interpolated`: the times were given.

    left_out: how many runs that were asked for have no such history.
    """

    folder: Path
    name: str
    unit: str
    entries: tuple[Entry, ...]
    times: np.ndarray
    interpolated: bool
    left_out: int

    @property
    def keys(self) -> list[str]:
        """The runs, in order."""
        return [entry.key for entry in self.entries]

    @property
    def shape(self) -> tuple[int, int]:
        """Runs and times."""
        return len(self.entries), len(self.times)

    def values(self, runs: Sequence[int] | np.ndarray, samples: Sequence[int] | np.ndarray) -> np.ndarray:
        """Of these runs at these samples, (runs, samples); the parts of the store that hold them are read.

        Raises:
            StoreError: a history is damaged.
        """
        runs, samples = np.asarray(runs, dtype=int), np.asarray(samples, dtype=int)
        found = np.full((len(runs), len(samples)), np.nan)
        if not found.size:
            return found
        store = HistoryStore.reading(self.folder)
        assert store is not None
        with store:
            for axis in dict.fromkeys(self.entries[run].axis for run in runs):
                rows = [k for k, run in enumerate(runs) if self.entries[run].axis == axis]
                some = [self.entries[runs[k]] for k in rows]
                if self.interpolated:
                    found[rows] = _between(store, some, self.times[samples])
                    continue
                for place in np.unique(samples // CHUNK):
                    columns = np.flatnonzero((samples // CHUNK == place) & (samples < some[0].samples))
                    if len(columns):
                        begin = int(samples[columns].min())
                        piece = store.values(some, begin, int(samples[columns].max()) + 1)
                        found[np.array(rows)[:, None], columns] = piece[:, samples[columns] - begin]
        return found

    def by_times(self, runs: Sequence[int] | np.ndarray, samples: np.ndarray) -> Iterator[np.ndarray]:
        """Values of runs at rising samples, some samples after the other: blocks (runs, some samples)."""
        at_once = max(1, BLOCK // max(1, len(runs)))
        ends = [0]
        while ends[-1] < len(samples):  # whole parts: none is read twice
            end = ends[-1] + 1
            while end < len(samples) and (
                samples[end] // CHUNK == samples[ends[-1]] // CHUNK or end - ends[-1] < at_once // CHUNK
            ):
                end += 1
            ends.append(end)
        for begin, end in pairwise(ends):
            yield self.values(runs, samples[begin:end])


def stacked(folder: Path, name: str, keys: Sequence[str], *, times: np.ndarray | None = None) -> HistoryStack:
    """The histories `name` of the runs `keys` that have one, in that order, over common or given `times`.

    Raises:
        StudyError: no run has such a history; the runs stand on several rows of times, and none are given; or
            `times` do not rise.
        StoreError: the store cannot be read.
    """
    store = HistoryStore.reading(folder)
    if store is None:
        raise StudyError(
            f"{folder.name} has no time histories; responses with `reduce` have, and [model] keep"
        )
    with store:
        known = {entry.key: entry for entry in store.entries(name=name)}
        entries = tuple(known[key] for key in keys if key in known)
        if not entries:
            names = ", ".join(store.names()) or "none"
            raise StudyError(f"no run in {folder.name} has a time history {name!r}; there are: {names}")
        if times is None:
            given, times = False, _common(store, name, entries)
        else:
            given, times = True, np.asarray(times, dtype=float)
            if times.ndim != 1 or not len(times) or not (np.diff(times) > 0).all():
                raise StudyError(
                    "times need to be a row of rising numbers, such as numpy.linspace(0, 1, 201)"
                )
    return HistoryStack(
        folder=folder,
        name=name,
        unit=entries[-1].unit,
        entries=entries,
        times=times,
        interpolated=given,
        left_out=len(keys) - len(entries),
    )


def stacked_anyway(folder: Path, name: str, keys: Sequence[str], *, samples: int) -> HistoryStack:
    """`stacked`; where runs stand on different times, over as many `samples` of the time that all cover.

    Raises:
        StudyError: no run has such a history, or no time is covered by all.
    """
    try:
        return stacked(folder, name, keys)
    except SeveralAxes as several:
        if not several.low < several.high:
            raise StudyError(
                f"the histories {name!r} of {len(keys)} runs have no time in common: the last begins at "
                f"{several.low:g}, the first ends at {several.high:g}"
            ) from None
        times = np.linspace(several.low, several.high, samples)
        return stacked(folder, name, keys, times=times)


def _common(store: HistoryStore, name: str, entries: Sequence[Entry]) -> np.ndarray:
    """The times of the longest history, of which all others are beginnings."""
    axes = {entry.axis: entry for entry in entries}
    longest = max(axes.values(), key=lambda entry: entry.samples)
    times = store.times(longest.axis)
    for entry in axes.values():
        ends_within = entry.samples == 0 or (
            entry.first == times[0] and entry.last == times[entry.samples - 1]
        )
        if not ends_within or not np.array_equal(store.times(entry.axis), times[: entry.samples]):
            n = [entry.samples for entry in axes.values()]
            low = max(entry.first for entry in axes.values())
            high = min(entry.last for entry in axes.values())
            raise SeveralAxes(
                low,
                high,
                f"the histories {name!r} of {len(entries)} runs stand on {len(axes)} different rows of "
                f"times, of {min(n)} to {max(n)} samples; all cover {low:g} to {high:g}. Give the times you "
                f"want, such as time=numpy.linspace({low:g}, {high:g}, {max(n)}): values are then on "
                "straight lines between samples",
            )
    return times


def _between(store: HistoryStore, entries: Sequence[Entry], times: np.ndarray) -> np.ndarray:
    """Values of histories on one axis at given times."""
    own = store.times(entries[0].axis)
    if not len(own):
        return np.full((len(entries), len(times)), np.nan)
    begin = max(0, int(np.searchsorted(own, times.min(), side="right")) - 1)
    end = min(len(own), int(np.searchsorted(own, times.max())) + 1)
    if begin >= end:
        return np.full((len(entries), len(times)), np.nan)
    values = store.values(entries, begin, end)
    found = [np.interp(times, own[begin:end], row) for row in values]
    return np.where((times < own[0]) | (times > own[-1]), np.nan, np.array(found))
