"""Paths that stay inside a folder: no absolute path, no `..`, no symbolic link that leads out."""

from pathlib import Path, PurePosixPath

from workbench.errors import StudyError

__all__ = ["check_inside", "confined"]

LONGEST = 400  # characters


def confined(folder: Path, name: str, *, what: str) -> Path:
    """The path of `name` inside `folder`, which need not exist.

    Raises:
        StudyError: the name leads out of the folder, directly or through a link, or is no file name.
    """
    path = folder / check_inside(name, what=what, folder=folder.name or str(folder))
    try:
        inside = _resolved(path).is_relative_to(folder.resolve())
    except (OSError, RuntimeError, ValueError):
        inside = False
    if not inside:
        raise StudyError(f"{what} {name!r} leads out of {folder.name or folder} through a link")
    return path


def check_inside(name: str, *, what: str, folder: str) -> PurePosixPath:
    """The name as a path below a folder that is called `folder` and need not exist yet.

    >>> check_inside("../deck", what="file", folder="the run")
    Traceback (most recent call last):
    workbench.errors.StudyError: file '../deck' needs to be a path inside the run, without '..' or a root

    Raises:
        StudyError: the name leads out of the folder, or is no file name.
    """
    pure = PurePosixPath(name.replace("\\", "/"))
    drive = len(name) > 1 and name[1] == ":"
    odd = not name.strip() or len(name) > LONGEST or any(ord(c) < 32 for c in name)
    if odd or drive or pure.is_absolute() or ".." in pure.parts or pure.parts[:1] == ("~",):
        raise StudyError(f"{what} {name!r} needs to be a path inside {folder}, without '..' or a root")
    return pure


def _resolved(path: Path) -> Path:
    """The path without links; strict where it exists, since else Python 3.13 passes a loop of links."""
    try:
        return path.resolve(strict=True)
    except FileNotFoundError:
        return path.resolve()
