"""The studies that `holdfast demo` runs: shipped ones, copied where their campaign may be written."""

from importlib.resources import files
from pathlib import Path

from workbench.errors import StoreError, StudyError
from workbench.system.atomic import write_whole

__all__ = ["DEMO", "STUDIES", "copy_study"]

DEMO = "occupant"
STUDIES = {
    "occupant": "occupant_demo.toml",
    "welch20": "welch20.toml",
    "gunner": "gunner/restraints/restraint_demo.toml",
}


def copy_study(folder: Path, name: str = DEMO) -> Path:
    """Copy the demonstration's study file to `folder`, unless it is there; its path.

    Raises:
        StudyError: there is no demonstration of that name.
        StoreError: the folder cannot be written.
    """
    if name not in STUDIES:
        raise StudyError(f"no demonstration {name!r}; there are {', '.join(STUDIES)}")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as exc:
        raise StoreError(f"cannot make the folder {folder}: {exc.strerror}. Choose another --folder") from exc
    place = folder / Path(STUDIES[name]).name
    if not place.exists():
        write_whole(place, (files("studies") / STUDIES[name]).read_bytes())
    return place
