"""The files and programs that the table `[model]` of a study names, without running anything."""

import re
import shutil
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from workbench.models.protocol import ModelSpec
from workbench.provenance.closure import file_of

__all__ = ["included_files", "is_made_beside", "model_files", "named_files", "programs"]

IN_STUDY = re.compile(r"\{study\}/([^\s,;:=\"']+)")
BESIDE = re.compile(
    r"(^|/)(__pycache__|\.git|[^/]*\.holdfast)/|(~|\.swp|\.bak|\.pyc|\.orig)$|(^|/)(#|\.#)[^/]*$"
)


def model_files(spec: ModelSpec) -> list[Path]:
    """The files of Python that the simulation begins with: those of functions, and those that are named."""
    study = Path(spec.folder)
    given = [spec.options.get(key) for key in ("function", "gradient")] if spec.kind == "python" else []
    places = dict.fromkeys(reference.rpartition(":")[0] for reference in given if reference)
    starts = [file for place in places if (file := file_of(place, study)) is not None]
    starts += [path for path in programs(spec) if path.suffix == ".py"]
    return starts + [study / name for name in named_files(spec) if name.endswith(".py")]


def named_files(spec: ModelSpec) -> list[str]:
    """Files beside the study that the model's table names, those in named folders among them."""
    if spec.kind == "fmu":
        return [spec.options["file"]]
    if spec.kind != "command":
        return []
    names = [table["from"] for table in spec.options.get("templates", ())]
    names += spec.options.get("files", ())
    for command in _commands(spec):
        for argument in command[1:]:
            names += IN_STUDY.findall(argument)
    study = Path(spec.folder)
    found = [file for name in names for file in _files_of(study, name)]
    return list(dict.fromkeys(found))


def included_files(study: Path, patterns: Iterable[str]) -> Iterator[Path]:
    """Files that `[model.state] include` names, less what editors, Python, git and campaigns leave there."""
    for pattern in patterns:
        for file in sorted(study.glob(pattern)):
            if file.is_file() and not is_made_beside(file.relative_to(study).as_posix()):
                yield file


def is_made_beside(name: str) -> bool:
    """Whether a file is made beside others by an editor, by Python, by git or by a campaign."""
    return BESIDE.search(name) is not None


def programs(spec: ModelSpec) -> list[Path]:
    """The programs of the commands, where they are found; this interpreter is known by its version."""
    found = []
    for command in _commands(spec):
        name = shutil.which(command[0].replace("{study}", spec.folder)) if command[0] != "{python}" else None
        if name is not None and Path(name).resolve() != Path(sys.executable).resolve():
            found.append(Path(name).resolve())
    return found


def _files_of(study: Path, name: str) -> list[str]:
    place = study / name
    if not place.is_dir():
        return [name]
    inside = (path.relative_to(study).as_posix() for path in sorted(place.rglob("*")) if path.is_file())
    return [file for file in inside if not is_made_beside(file)]


def _commands(spec: ModelSpec) -> list[list[str]]:
    command = spec.options.get("command", []) if spec.kind == "command" else []
    return [command] if command and isinstance(command[0], str) else list(command)
