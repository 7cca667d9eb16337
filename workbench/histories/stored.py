"""Histories of single runs, of this schema and of older campaigns, for whoever asks by the key of a run."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from workbench.errors import StoreError
from workbench.histories.former import former_files, former_histories
from workbench.histories.store import HistoryStore
from workbench.models.histories import History

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["StoredHistories", "copy_histories", "history_dataset", "take_former"]

AT_ONCE = 50  # files of older campaigns per transaction


class StoredHistories:
    """The histories in a campaign's folder. Use it in a `with` block; it opens what is asked for."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._looked = False
        self._store: HistoryStore | None = None

    def __enter__(self) -> "StoredHistories":
        return self

    def __exit__(self, *_: object) -> None:
        if self._store is not None:
            self._store.close()
        self._store, self._looked = None, False

    def of(self, key: str) -> Mapping[str, tuple[History, str]]:
        """History and unit by name of a run; empty without any.

        Raises:
            StoreError: the database of histories cannot be read, or one of these is damaged.
        """
        if not self._looked:
            self._store = HistoryStore.reading(self.folder)
            self._looked = True
        entries = [] if self._store is None else self._store.entries(key=key)
        if self._store is None or not entries:
            return former_histories(self.folder, key)
        return {entry.name: (self._store.history(entry), entry.unit) for entry in entries}


def copy_histories(source: Path, target: Path, runs: Iterable[tuple[str, str]]) -> None:
    """Copy the histories of runs, each under its new key, from one campaign's folder to another or the same.

    Whoever does so has `runs.sqlite` in `target` open for writing.
    """
    with StoredHistories(source) as stored:
        found = ((new, stored.of(old)) for old, new in runs)
        some = [(new, histories) for new, histories in found if histories]
    if some:
        with HistoryStore.opened(target) as store:
            store.write(some)


def take_former(folder: Path) -> int:
    """Bring `histories/<key>.nc` of an older campaign into its database; how many. A file goes when it is in.

    Whoever does so has `runs.sqlite` in `folder` open for writing. Files that cannot be read stay.
    """
    files = former_files(folder)
    if not files:
        return 0
    taken = 0
    with HistoryStore.opened(folder) as store:
        for begin in range(0, len(files), AT_ONCE):
            some = files[begin : begin + AT_ONCE]
            found = {path: former_histories(folder, path.stem) for path in some}
            store.write(
                (path.stem, histories)
                for path, histories in found.items()
                if histories and not store.entries(key=path.stem)
            )
            for path in (path for path, histories in found.items() if histories):
                path.unlink()
                taken += 1
    with suppress(OSError):
        files[0].parent.rmdir()
    return taken


def history_dataset(folder: Path, key: str) -> "xr.Dataset":
    """The histories of a run, `name` over `time_name`.

    Raises:
        StoreError: the run has none.
    """
    import xarray as xr

    with StoredHistories(folder) as stored:
        found = stored.of(key)
    if not found:
        raise StoreError(f"run {key} has no time histories in {folder}")
    return xr.Dataset(
        {name: (f"time_{name}", history.values, {"units": unit}) for name, (history, unit) in found.items()},
        coords={f"time_{name}": history.time for name, (history, _) in found.items()},
    )
