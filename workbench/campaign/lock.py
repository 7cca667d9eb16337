"""`study.lock.json`: what a campaign was resolved to (defaults, versions, seed, hashes), to repeat it.

It also guards the runs: when the model's source changes under stored runs, continuing would mix two models,
so that is refused until the user says which is meant.
"""

import platform
from hashlib import blake2b
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from workbench.errors import StudyError
from workbench.models.protocol import ModelSpec
from workbench.study.record import Study
from workbench.system.atomic import read_json, write_json

__all__ = ["check_lock", "versions", "write_lock"]

FILE = "study.lock.json"
PACKAGES = ("holdfast", "numpy", "scipy", "numba", "scikit-learn", "pyDOE3", "pandas", "xarray", "matplotlib")


def versions() -> dict[str, str]:
    """Python and the packages that results depend on."""
    found = {"python": platform.python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "not installed"
    return found


def write_lock(folder: Path, study: Study, spec: ModelSpec) -> None:
    """Write the lock of a campaign."""
    content = {
        "resolved": study.to_dict(),
        "study_hash": study.hash,
        "space_hash": study.space.hash,
        "seed": study.seed,
        "model": {"identity": spec.identity, "version": spec.version, "source": source(spec)},
        "versions": versions(),
    }
    if read_json(folder / FILE) != content:
        write_json(folder / FILE, content)


def check_lock(folder: Path, spec: ModelSpec, *, runs: int, keep_runs: bool) -> list[str]:
    """What a person should know before continuing with `runs` stored runs.

    Raises:
        StudyError: the model's source is not the one that made the stored runs.
    """
    lock = read_json(folder / FILE)
    if not isinstance(lock, dict) or not runs:
        return []
    notes = []
    model: dict[str, Any] = lock.get("model", {})
    same_name = (model.get("identity"), model.get("version")) == (spec.identity, spec.version)
    now = source(spec)
    if same_name and model.get("source") and now and model["source"] != now:
        if not keep_runs:
            raise StudyError(
                f"the source of the model changed after {runs} runs were stored in {folder.name}. Give "
                '--keep-runs when their results still hold, or set [model] version = "2" to make them anew'
            )
        notes.append(f"the source of the model changed; {runs} runs are kept as you asked")
    before, after = lock.get("versions", {}), versions()
    moved = [f"{n} {before[n]} -> {after[n]}" for n in after if n in before and before[n] != after[n]]
    if moved:
        notes.append(f"continued with other versions than it was begun with: {', '.join(moved)}")
    return notes


def file_digest(path: Path) -> str:
    """A digest of a file; empty when it cannot be read."""
    try:
        return blake2b(path.read_bytes(), digest_size=16).hexdigest()
    except OSError:
        return ""


def source(spec: ModelSpec) -> str:
    """A digest of the source of a Python function or of a command's decks; empty for other models."""
    if spec.kind == "command":
        from workbench.models.command import command_digest

        return command_digest(spec)
    if spec.kind == "fmu":
        return file_digest(Path(spec.folder) / spec.options["file"])
    if spec.kind != "python":
        return ""
    from workbench.models.python import source_digest

    digest = source_digest(spec.options["function"], Path(spec.folder))
    gradient = spec.options.get("gradient", spec.options["function"])
    if gradient.rpartition(":")[0] == spec.options["function"].rpartition(":")[0]:
        return digest
    return digest + source_digest(gradient, Path(spec.folder))
