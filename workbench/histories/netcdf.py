"""Histories of all runs as one netCDF file, written run by run.

netCDF 3 with 64-bit offsets, which every netCDF library reads: the dimension `run` is the unlimited one, so
that the numbers of a run stand together and no more than one run is held in memory. scipy writes the head
with the first run; further runs follow in the same form, and their count goes into the head.
"""

import io
import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

import numpy as np

from workbench.errors import StudyError
from workbench.histories.store import Entry, HistoryStore

__all__ = ["write_histories"]

RECORDS = 4  # the byte of the head where the number of runs begins
KEY = 32  # characters of a key


@dataclass(frozen=True, slots=True, kw_only=True)
class _Column:
    """A name: its unit, samples of its longest history, the times if all runs stand on one row of them."""

    name: str
    unit: str
    samples: int
    times: np.ndarray | None


def write_histories(path: Path, folder: Path, keys: Sequence[str]) -> int:
    """Write the histories of these runs of the campaign in `folder`, in this order; how many runs have any.

    `run`: keys.    Where all runs of a name stand on the same times: `name(run, time_name)` over the
    coordinate `time_name`. Else `name(run, sample_name)` beside `time_name(run, sample_name)`, NaN after a
    run's end. A run without the history has NaN.

    Raises:
        StudyError: there are no histories.    StoreError: the store is damaged.
    """
    store = HistoryStore.reading(folder)
    if store is None:
        raise StudyError(
            f"{folder.name} has no time histories; responses with `reduce` have, and [model] keep"
        )
    with store:
        by_run: dict[str, dict[str, Entry]] = {key: {} for key in keys}
        for entry in store.entries():
            if entry.key in by_run:
                by_run[entry.key][entry.name] = entry
        present = {key: entries for key, entries in by_run.items() if entries}
        if not present:
            raise StudyError(f"none of the {len(keys)} runs in {folder.name} has a time history")
        columns = _columns(store, present.values())
        new = path.with_name(f".{path.name}.new")
        try:
            with open(new, "wb") as file:
                _write(file, store, columns, present)
                file.flush()
                os.fsync(file.fileno())
            new.replace(path)
        finally:
            new.unlink(missing_ok=True)
    return len(present)


def _columns(store: HistoryStore, runs: Iterable[Mapping[str, Entry]]) -> list[_Column]:
    found: dict[str, list[Entry]] = {}
    for entries in runs:
        for name, entry in entries.items():
            found.setdefault(name, []).append(entry)
    columns = []
    for name, of_name in sorted(found.items()):
        one = len({entry.axis for entry in of_name}) == 1
        times = store.times(of_name[0].axis) if one else None
        longest = max(entry.samples for entry in of_name)
        columns.append(_Column(name=name, unit=of_name[-1].unit, samples=longest, times=times))
    return columns


def _write(
    file: BinaryIO, store: HistoryStore, columns: Sequence[_Column], runs: Mapping[str, Mapping[str, Entry]]
) -> None:
    for k, (key, entries) in enumerate(runs.items()):
        record = _record(store, key, columns, entries)
        if k == 0:
            file.write(_head(columns, record))
            continue
        for cells in record.values():
            file.write(cells.tobytes())
    file.seek(RECORDS)
    file.write(len(runs).to_bytes(4, "big"))


def _record(
    store: HistoryStore, key: str, columns: Sequence[_Column], entries: Mapping[str, Entry]
) -> dict[str, np.ndarray]:
    """What of one run goes into the file, by variable, high byte first."""
    cells = {"run": np.frombuffer(key.encode().ljust(KEY), dtype="S1")}
    for column in columns:
        entry = entries.get(column.name)
        values = np.full((2, column.samples), np.nan)
        if entry is not None:
            history = store.history(entry)
            values[:, : entry.samples] = history.time, history.values
        if column.times is None:
            cells[f"time_{column.name}"] = values[0].astype(">f8")
        cells[column.name] = values[1].astype(">f8")
    return cells


def _head(columns: Sequence[_Column], first: Mapping[str, np.ndarray]) -> bytes:
    """The file with its first run, as scipy writes it."""
    from scipy.io import netcdf_file

    buffer = io.BytesIO()
    file = netcdf_file(buffer, "w", version=2)
    file.createDimension("run", None)
    file.createDimension("characters", KEY)
    file.createVariable("run", "c", ("run", "characters"))[0] = first["run"]
    for column in columns:
        name = column.name
        axis = f"sample_{name}" if column.times is None else f"time_{name}"
        file.createDimension(axis, column.samples)
        if column.times is None:
            file.createVariable(f"time_{name}", "f8", ("run", axis))[0] = first[f"time_{name}"]
        else:
            file.createVariable(f"time_{name}", "f8", (axis,))[:] = column.times
        file.createVariable(name, "f8", ("run", axis))[0] = first[name]
        setattr(file.variables[name], "units", column.unit.encode())  # noqa: B010 - attributes are made here
    file.flush()
    return buffer.getvalue()
