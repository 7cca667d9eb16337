"""The study that `holdfast demo` runs: a shipped one, copied where its campaign may be written."""

from importlib.resources import files
from pathlib import Path

from workbench.atomic import write_whole
from workbench.errors import StoreError

__all__ = ["DEMO", "copy_study"]

DEMO = "welch20.toml"


def copy_study(folder: Path) -> Path:
    """Copy the demonstration's study file to `folder`, unless it is there; its path.

    Raises:
        StoreError: the folder cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise StoreError(f"cannot make the folder {folder}: {exc.strerror}. Choose another --folder") from exc
    place = folder / DEMO
    if not place.exists():
        write_whole(place, (files("studies") / DEMO).read_bytes())
    return place
